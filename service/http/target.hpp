// The target of a request taken apart: the one place where percent-encoding is undone.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace skylight::http {

struct Target {
  std::string path;                   ///< decoded, begins with '/'
  std::vector<std::string> segments;  ///< the decoded parts between the slashes; {""} for "/"
  std::vector<std::pair<std::string, std::string>> query;  ///< decoded, '+' read as a space, in their order
};

/// `target` in origin form ("/path?query"). Throws Problem (400) for anything else, for a broken percent
/// encoding, an encoded slash in the path, control characters, '#', text that is not UTF-8 once decoded, and
/// the segments "." and "..".
Target parse_target(std::string_view target);

/// Percent-encoded but for the unreserved characters of RFC 3986, section 2.3.
std::string percent_encode(std::string_view text);

}  // namespace skylight::http
