#include "service/http/router.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <stdexcept>

#include "service/http/text.hpp"

namespace skylight::http {
namespace {

[[noreturn]] void refuse(const std::string& method, const std::string& pattern, const std::string& why) {
  throw std::invalid_argument("route " + method + " " + pattern + ": " + why);
}

std::vector<std::string> split(std::string_view pattern) {
  std::vector<std::string> parts;
  while (!pattern.empty()) {
    pattern.remove_prefix(1);  // the slash
    const std::size_t end = std::min(pattern.find('/'), pattern.size());
    parts.emplace_back(pattern.substr(0, end));
    pattern.remove_prefix(end);
  }
  return parts;
}

bool is_parameter(std::string_view part) {
  return part.size() > 2 && part.front() == '{' && part.back() == '}';
}

void check(const Route& route, const std::vector<std::string>& parts) {
  constexpr std::array<std::string_view, 5> kMethods{"GET", "POST", "PUT", "PATCH", "DELETE"};
  if (std::find(kMethods.begin(), kMethods.end(), route.method) == kMethods.end()) {
    refuse(route.method, route.pattern, "the method must be GET, POST, PUT, PATCH or DELETE");
  }
  if (!route.handler) refuse(route.method, route.pattern, "it has no handler");
  std::set<std::string_view> names;
  for (const std::string& part : parts) {
    const bool braces = part.find_first_of("{}") != std::string::npos;
    const bool plain_name = is_parameter(part) &&
                            is_token(std::string_view(part).substr(1, part.size() - 2)) &&
                            part.find_first_of("{}", 1) == part.size() - 1;
    if (braces && !plain_name) refuse(route.method, route.pattern, "a parameter must fill a whole segment");
    if (braces && !names.insert(part).second) refuse(route.method, route.pattern, "a parameter comes twice");
    if (part.empty() && parts.size() > 1) refuse(route.method, route.pattern, "a segment is empty");
  }
}

}  // namespace

void Router::add(std::string method, std::string pattern, Handler handler, RouteOptions options) {
  Route route{std::move(method), std::move(pattern), std::move(handler), std::move(options)};
  if (route.pattern.empty() || route.pattern.front() != '/') {
    refuse(route.method, route.pattern, "the pattern must begin with '/'");
  }
  const std::vector<std::string> parts = split(route.pattern);
  check(route, parts);

  Node* node = &root_;
  for (const std::string& part : parts) {
    if (!is_parameter(part)) {
      node = &node->literals[part];
      continue;
    }
    if (!node->parameter) node->parameter = std::make_unique<Node>();
    node = node->parameter.get();
  }
  if (!node->route_by_method.emplace(route.method, routes_.size()).second) {
    refuse(route.method, route.pattern, "it is already there");
  }
  routes_.push_back(std::move(route));
}

// Depth first, the literal before the parameter, so that /robots/{id}/pose is found beside /robots/new.
const Router::Node* Router::find(const Node& node, const std::vector<std::string>& segments,
                                 std::size_t depth) {
  if (depth == segments.size()) return node.route_by_method.empty() ? nullptr : &node;
  if (const auto literal = node.literals.find(segments[depth]); literal != node.literals.end()) {
    if (const Node* found = find(literal->second, segments, depth + 1)) return found;
  }
  const bool fills = node.parameter && !segments[depth].empty();
  return fills ? find(*node.parameter, segments, depth + 1) : nullptr;
}

Router::Match Router::match(std::string_view method, const std::vector<std::string>& segments) const {
  Match match;
  const Node* node = find(root_, segments, 0);
  if (node == nullptr) return match;
  for (const auto& [name, index] : node->route_by_method)
    match.allow += name == "GET" ? "GET, HEAD, " : name + ", ";
  match.allow += "OPTIONS";

  const auto entry = node->route_by_method.find(method == "HEAD" ? std::string_view("GET") : method);
  if (entry == node->route_by_method.end()) return match;
  match.route = &routes_[entry->second];
  const std::vector<std::string> parts = split(match.route->pattern);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (is_parameter(parts[i]))
      match.path_params.emplace(parts[i].substr(1, parts[i].size() - 2), segments[i]);
  }
  return match;
}

}  // namespace skylight::http
