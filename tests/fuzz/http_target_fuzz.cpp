// What the front parses by itself: targets, percent-encoding, the gate's headers, entity tags, JSON text.
// Input: lines; the first is "METHOD target", the others "name: value".
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "service/http/gate.hpp"
#include "service/http/message.hpp"
#include "service/http/text.hpp"

namespace {

using namespace skylight::http;  // NOLINT(google-build-using-namespace)

void expect(bool law) {
  if (!law) std::abort();
}

void check_target(std::string_view text) {
  Target target;
  try {
    target = parse_target(text);
  } catch (const Problem&) {
    return;
  }
  expect(is_utf8(target.path) && !has_control(target.path));
  std::string joined;
  std::string encoded;
  for (const std::string& segment : target.segments) {
    expect(segment.find('/') == std::string::npos);
    joined += '/' + segment;
    encoded += '/' + percent_encode(segment);
  }
  expect(joined == target.path);
  char mark = '?';
  for (const auto& [name, value] : target.query) {
    encoded += mark + percent_encode(name) + '=' + percent_encode(value);
    mark = '&';
  }
  const Target again = parse_target(encoded);
  expect(again.path == target.path && again.query == target.query);
}

std::string_view take_line(std::string_view& text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(line.size() + 1, text.size()));
  return line;
}

void check_gate(std::string_view text) {
  static const ServerOptions kOptions;
  static const StaticFiles kFiles({{"/", "text/html", "page"}});
  static const Router kRouter = [] {
    Router router;
    router.add("GET", "/robots/{id}", [](const Request&) { return Reply{}; });
    router.add("PUT", "/robots/{id}", [](const Request&) { return Reply{}; });
    return router;
  }();
  const std::string_view line = take_line(text);
  const std::size_t space = std::min(line.find(' '), line.size());
  Head head{.method = line.substr(0, space),
            .target = line.substr(std::min(space + 1, line.size())),
            .local_address = "192.0.2.7"};
  check_target(head.target);
  while (!text.empty()) {
    const std::string_view header = take_line(text);
    const std::size_t colon = std::min(header.find(':'), header.size());
    head.headers.emplace_back(header.substr(0, colon), header.substr(std::min(colon + 1, header.size())));
  }
  names_etag(head.value("if-none-match"), "\"1\"");
  try {
    const Admission admission = Gate(kOptions, kRouter, kFiles).admit(head);
    expect(admission.answer.has_value() || admission.match.route != nullptr);
    expect(admission.expected_bytes <= admission.max_body_bytes);
    expect(head.count("host") == 1);
  } catch (const Problem& problem) {
    expect(problem.answer().status >= 400 && problem.answer().status < 500);
    expect(is_utf8(problem.answer().body));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  check_gate(text);
  expect(is_utf8(json_quote(text)));
  return 0;
}
