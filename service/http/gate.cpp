#include "service/http/gate.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "service/http/text.hpp"

namespace skylight::http {
namespace {

// Each passed header must fit into the library's line of 8 KiB, even if every byte of it grows threefold.
constexpr std::size_t kMaxPassedHeaderBytes = 2048;

[[noreturn]] void malformed(const std::string& why) {
  throw Problem(400, "Malformed request", why);
}

std::string quoted(std::string_view text) {
  return '"' + std::string(text) + '"';
}

// "name", "name:port", "[v6]:port" without the port; empty where it is none of these.
std::string_view host_of(std::string_view authority) {
  const bool bracketed = !authority.empty() && authority.front() == '[';
  const std::size_t name_end = bracketed ? authority.find(']') : authority.find(':');
  if (name_end == std::string_view::npos) return bracketed ? std::string_view() : authority;
  const std::size_t end = bracketed ? name_end + 1 : name_end;
  const std::string_view port = authority.substr(end);
  const bool digits = std::all_of(port.begin() + (port.empty() ? 0 : 1), port.end(),
                                  [](char c) { return c >= '0' && c <= '9'; });
  const bool fits = port.empty() || (port.front() == ':' && port.size() >= 2 && port.size() <= 6 && digits);
  return fits ? authority.substr(0, end) : std::string_view();
}

// The authority as it is compared: lower case, without the scheme's own port.
std::string canonical(std::string_view authority, std::string_view scheme) {
  const std::string_view usual_port = scheme == "https" ? ":443" : ":80";
  if (authority.size() > usual_port.size() &&
      authority.substr(authority.size() - usual_port.size()) == usual_port) {
    authority.remove_suffix(usual_port.size());
  }
  return lower_case(authority);
}

// Fills has_body and expected_bytes from the framing headers; refuses every framing on which two programs
// could disagree (request smuggling).
void read_framing(const Head& head, Admission& admission) {
  const std::size_t lengths = head.count("content-length");
  const std::size_t codings = head.count("transfer-encoding");
  if (codings > 0) {
    if (lengths > 0) malformed("Content-Length and Transfer-Encoding exclude each other");
    const bool chunked = codings == 1 && equal_ignoring_case(head.value("transfer-encoding"), "chunked");
    if (!chunked || head.http10) malformed("the only Transfer-Encoding taken is \"chunked\", of HTTP/1.1");
    admission.has_body = true;
    return;
  }
  if (lengths == 0) return;
  const std::string_view text = head.value("content-length");
  std::uint64_t bytes = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), bytes);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (lengths > 1 || !whole) malformed("Content-Length must be one number");
  admission.has_body = bytes > 0;
  admission.expected_bytes = static_cast<std::size_t>(bytes);
}

HeaderList passed_headers(const Head& head) {
  HeaderList passed;
  for (const auto& [name, value] : head.headers) {
    const std::string lower = lower_case(name);
    if (std::find(std::begin(kPassedHeaders), std::end(kPassedHeaders), lower) == std::end(kPassedHeaders))
      continue;
    if (value.size() > kMaxPassedHeaderBytes) {
      throw Problem(
          431, "",
          "the header " + lower + " is longer than " + std::to_string(kMaxPassedHeaderBytes) + " bytes");
    }
    if (head.count(lower) > 1) malformed("the header " + lower + " comes more than once");
    passed.emplace_back(lower, trim(value));
  }
  return passed;
}

// OPTIONS is answered here; another method gets the route or 405.
std::optional<StaticFiles::Found> answer_options(std::string_view method, const std::string& allow) {
  if (method != "OPTIONS") return std::nullopt;
  return StaticFiles::Found{.reply = {.status = 204, .headers = {{"Allow", allow}}}, .body = {}};
}

[[noreturn]] void wrong_method(std::string_view method, const std::string& allow) {
  Reply reply = problem(405, "", "this resource does not take " + quoted(method) + ", only " + allow);
  reply.headers.emplace_back("Allow", allow);
  throw Problem(std::move(reply));
}

}  // namespace

std::size_t Head::count(std::string_view name) const {
  return static_cast<std::size_t>(std::count_if(headers.begin(), headers.end(), [&](const auto& header) {
    return equal_ignoring_case(header.first, name);
  }));
}

std::string_view Head::value(std::string_view name) const {
  const auto found = std::find_if(headers.begin(), headers.end(), [&](const auto& header) {
    return equal_ignoring_case(header.first, name);
  });
  return found == headers.end() ? std::string_view() : trim(found->second);
}

Gate::Gate(const ServerOptions& options, const Router& router, const StaticFiles& files)
    : options_(options), router_(router), files_(files) {}

// A name that an attacker points at this machine would make his page "the same origin" (DNS rebinding);
// so only names that are known to be ours pass, whatever the port (a tunnel may change it).
void Gate::check_host(std::string_view authority, std::string_view local_address) const {
  const std::string host = lower_case(host_of(authority));
  if (host.empty()) malformed("Host is no name or address with an optional port");
  const bool loopback = host == "localhost" || host == "127.0.0.1" || host == "[::1]";
  const bool own = host == local_address || host == '[' + std::string(local_address) + ']';
  const bool allowed = std::any_of(options_.allowed_hosts.begin(), options_.allowed_hosts.end(),
                                   [&](const std::string& name) { return equal_ignoring_case(name, host); });
  if (loopback || own || allowed) return;
  throw Problem(421, "", "the name " + quoted(host) + " in Host is not one that this server answers to");
}

std::string_view Gate::origin_form(const Head& head) const {
  if (head.target.size() > options_.max_target_bytes) {
    throw Problem(414, "",
                  "the target is longer than " + std::to_string(options_.max_target_bytes) + " bytes");
  }
  const std::size_t scheme_end = head.target.find("://");
  const std::string scheme = lower_case(head.target.substr(0, std::min<std::size_t>(scheme_end, 6)));
  if (scheme != "http" && scheme != "https") return head.target;
  const std::string_view rest = head.target.substr(scheme_end + 3);
  const std::size_t path = std::min(rest.find('/'), rest.size());
  check_host(rest.substr(0, path), head.local_address);
  return path == rest.size() ? std::string_view("/") : rest.substr(path);
}

void Gate::find_answer(const Head& head, Admission& admission) const {
  constexpr std::string_view kFileAllow = "GET, HEAD, OPTIONS";
  const bool read = head.method == "GET" || head.method == "HEAD";
  if (files_.has(admission.target.path)) {
    if (read) {
      admission.answer = files_.find(admission.target.path, head.value("if-none-match"));
      return;
    }
    admission.answer = answer_options(head.method, std::string(kFileAllow));
    if (!admission.answer) wrong_method(head.method, std::string(kFileAllow));
    return;
  }
  admission.match = router_.match(head.method, admission.target.segments);
  if (admission.match.allow.empty())
    throw Problem(404, "", "there is nothing at " + quoted(admission.target.path));
  admission.answer = answer_options(head.method, admission.match.allow);
  if (!admission.answer && admission.match.route == nullptr) wrong_method(head.method, admission.match.allow);
}

// Every browser names the origin of a page that writes; programs name none.
void Gate::check_origin(const Head& head) const {
  if (head.count("origin") > 1) malformed("the header origin comes more than once");
  const std::string origin = lower_case(head.value("origin"));
  if (head.count("origin") == 0) {
    const std::string_view site = head.value("sec-fetch-site");
    if (site.empty() || site == "same-origin" || site == "none") return;
    throw Problem(403, "", "a page of another site may not write here");
  }
  const std::size_t scheme_end = origin.find("://");
  const std::string scheme = origin.substr(0, std::min(scheme_end, origin.size()));
  const bool web = scheme == "http" || scheme == "https";
  const bool same = web && canonical(std::string_view(origin).substr(scheme_end + 3), scheme) ==
                               canonical(head.value("host"), scheme);
  const bool allowed =
      std::any_of(options_.allowed_origins.begin(), options_.allowed_origins.end(),
                  [&](const std::string& other) { return equal_ignoring_case(other, origin); });
  if (!same && !allowed) throw Problem(403, "", "the origin " + quoted(origin) + " may not write here");
}

void Gate::check_write(const Head& head, const Admission& admission) const {
  if (head.method == "GET" || head.method == "HEAD" || head.method == "OPTIONS") {
    if (admission.has_body) malformed(std::string(head.method) + " takes no body");
    return;
  }
  check_origin(head);
  if (!admission.has_body && head.count("content-type") == 0) return;
  const std::string_view type = head.value("content-type");
  const std::string bare = lower_case(trim(type.substr(0, type.find(';'))));
  const auto& taken = admission.match.route->options.content_types;
  if (std::find(taken.begin(), taken.end(), bare) != taken.end()) return;
  std::string list;
  for (const std::string& one : taken) list += (list.empty() ? "" : ", ") + one;
  throw Problem(415, "", "Content-Type is " + quoted(bare) + "; this resource takes " + list);
}

Admission Gate::admit(const Head& head) const {
  Admission admission;
  read_framing(head, admission);
  if (head.count("host") != 1) malformed("a request carries Host exactly once");
  check_host(head.value("host"), head.local_address);
  const std::string_view target = origin_form(head);
  if (head.method == "OPTIONS" && target == "*") {
    admission.answer = answer_options(head.method, "GET, HEAD, POST, PUT, PATCH, DELETE, OPTIONS");
  } else {
    admission.target = parse_target(target);
    find_answer(head, admission);
  }
  const std::string_view expect = head.value("expect");
  if (!expect.empty() && !equal_ignoring_case(expect, "100-continue")) {
    throw Problem(417, "", "the only expectation met here is \"100-continue\"");
  }
  check_write(head, admission);
  admission.wants_continue = admission.has_body && !expect.empty() && !head.http10;
  admission.headers = passed_headers(head);
  const bool routed = admission.match.route != nullptr;
  const std::size_t own_bound = routed ? admission.match.route->options.max_body_bytes : 0;
  admission.max_body_bytes = own_bound > 0 ? own_bound : options_.max_body_bytes;
  if (admission.expected_bytes > admission.max_body_bytes) {
    throw Problem(413, "", "the body is longer than " + std::to_string(admission.max_body_bytes) + " bytes");
  }
  if (admission.has_body && head.count("transfer-encoding") > 0)
    admission.expected_bytes = admission.max_body_bytes;
  return admission;
}

}  // namespace skylight::http
