// Setting single values over what a document says.
#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <optional>

#include "settings/document.hpp"
#include "settings/text.hpp"

namespace skylight::settings {
namespace {

/// One step of a key path. A number in brackets is an index, or the key of an object that has it.
struct Step {
  std::string key;
  std::optional<std::size_t> index;
};

/// The number in brackets or the "quoted key" in them, taken off the path; none where it is neither.
std::optional<Step> bracket_step(std::string_view& path) {
  const bool quoted = path.starts_with("[\"");
  const std::string_view close = quoted ? "\"]" : "]";
  const std::size_t begin = quoted ? 2 : 1;
  const std::size_t end = path.find(close, begin);
  if (end == std::string_view::npos) return std::nullopt;
  Step step{std::string(path.substr(begin, end - begin)), std::nullopt};
  path.remove_prefix(end + close.size());
  if (!quoted) {
    std::size_t index = 0;
    const char* last = step.key.data() + step.key.size();
    const auto [stop, error] = std::from_chars(step.key.data(), last, index);
    if (error != std::errc{} || stop != last) return std::nullopt;
    step.index = index;
  }
  return step;
}

/// The steps of `a.b[2]["c d"].e`; none where the text is no such path.
std::optional<std::vector<Step>> steps_of(std::string_view path) {
  std::vector<Step> steps;
  while (!path.empty()) {
    if (path.front() == '[') {
      const auto step = bracket_step(path);
      if (!step) return std::nullopt;
      steps.push_back(*step);
    } else {
      if (!steps.empty()) {
        if (path.front() != '.') return std::nullopt;
        path.remove_prefix(1);
      }
      const std::size_t end = std::min(path.find_first_of(".["), path.size());
      if (end == 0) return std::nullopt;
      steps.push_back({std::string(path.substr(0, end)), std::nullopt});
      path.remove_prefix(end);
    }
  }
  if (steps.empty() || steps.size() > kMaxDepth) return std::nullopt;
  return steps;
}

void mark(Node& node, std::uint16_t source) {
  node.source = source;
  node.line = 0;
  for (Node& child : node.children) mark(child, source);
}

/// The value as JSON, or as the string that it is. What opens like JSON must be JSON.
Node value_node(std::string_view value, const std::string& origin, const std::string& path) {
  const std::size_t first = value.find_first_not_of(" \t\r\n");
  const bool structured = first != std::string_view::npos &&
                          std::string_view("{[\"").find(value[first]) != std::string_view::npos;
  try {
    return parse(value, origin).root;
  } catch (const Error& error) {
    const bool is_key = !error.key_path.empty() && error.key_path.front() != '[';
    if (structured) throw Error(origin, 0, path + (is_key ? "." : "") + error.key_path, error.message);
  }
  if (!is_utf8(value)) throw Error(origin, 0, path, "the value is no UTF-8");
  Node node;
  node.scalar = std::string(value);
  return node;
}

struct Setter {
  Document& document;
  const std::string& origin;
  const std::string& path;
  std::uint16_t source;

  [[noreturn]] void fail(const std::string& message) const { throw Error(origin, 0, path, message); }

  /// The child that the step names, made where it may be.
  Node& descend(Node& node, const Step& step) const {
    const bool is_null =
        node.kind == Node::Kind::scalar && std::holds_alternative<std::monostate>(node.scalar);
    if (is_null) {  // a place that was just made, or that the text left null
      node.kind = step.index ? Node::Kind::array : Node::Kind::object;
    }
    if (node.kind == Node::Kind::scalar)
      fail("cannot be set: what " + printable(step.key, 64) + " is asked of holds no keys");
    if (node.kind == Node::Kind::array) {
      if (!step.index)
        fail("cannot be set: the list has entries [0], [1] ... and no key " + printable(step.key, 64));
      if (*step.index > node.children.size()) {
        fail("cannot be set: the list has " + std::to_string(node.children.size()) + " entries");
      }
      if (*step.index == node.children.size()) mark(node.children.emplace_back(), source);
      return node.children[*step.index];
    }
    const auto found = std::find(node.keys.begin(), node.keys.end(), step.key);
    if (found != node.keys.end()) return node.children[static_cast<std::size_t>(found - node.keys.begin())];
    node.keys.push_back(step.key);
    mark(node.children.emplace_back(), source);
    return node.children.back();
  }
};

}  // namespace

const Node& nearest_node(const Node& node, std::string_view path) {
  const Node* at = &node;
  for (const Step& step : steps_of(path).value_or(std::vector<Step>{})) {
    const bool is_index = step.index && at->kind == Node::Kind::array;
    const Node* next = at->find(step.key);
    if (is_index) next = *step.index < at->children.size() ? &at->children[*step.index] : nullptr;
    if (next == nullptr) break;
    at = next;
  }
  return *at;
}

void set(Document& document, std::string_view path, std::string_view value, const std::string& origin) {
  const std::string path_text = printable(path, 200);
  const auto steps = is_utf8(path) ? steps_of(path) : std::nullopt;
  if (!steps)
    throw Error(origin, 0, "", "\"" + path_text + "\" is no key path such as server.port or robots[0].id");
  if (document.sources.size() >= std::numeric_limits<std::uint16_t>::max()) {
    throw Error(origin, 0, path_text, "too many values are set");
  }
  const auto source = static_cast<std::uint16_t>(document.sources.size());
  Node given = value_node(value, origin, path_text);
  mark(given, source);
  const bool is_scalar = given.kind == Node::Kind::scalar;
  document.sources.push_back({origin, is_scalar ? std::string(value) : std::string()});
  const Setter setter{document, origin, path_text, source};
  Node* node = &document.root;
  for (const Step& step : *steps) node = &setter.descend(*node, step);
  *node = std::move(given);
}

void set(Document& document, std::string_view assignment, const std::string& origin) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) {
    throw Error(origin, 0, "", "\"" + printable(assignment, 200) + "\" is not of the form key.path=value");
  }
  set(document, assignment.substr(0, equals), assignment.substr(equals + 1), origin);
}

}  // namespace skylight::settings
