// What a handler takes and gives back: plain values, so that neither the socket library nor the library
// behind the seam shows in any route.
#pragma once

#include <exception>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace skylight::http {

/// One whole request, already checked: the target is decoded, the body is complete and within its bound.
/// Valid while the handler runs.
struct Request {
  std::string method;  ///< upper case; HEAD arrives as GET
  std::string
      path;  ///< percent-decoded, without the query; begins with '/', valid UTF-8, no control characters
  std::map<std::string, std::string>
      path_params;  ///< by the names in the route's pattern; decoded, never empty
  std::multimap<std::string, std::string> query;  ///< decoded; a key may come more than once
  std::map<std::string, std::string> headers;  ///< the few that handlers may see (kPassedHeaders), lower case
  std::string_view body;                       ///< empty where there was none
  std::string remote_address;                  ///< numeric address of the peer, without port

  /// The first value of that name; null where there is none.
  const std::string* query_value(const std::string& name) const;
  const std::string* header(const std::string& lower_case_name) const;
  /// A parameter of the route's own pattern. Throws std::out_of_range for a name that the pattern lacks.
  const std::string& path_param(const std::string& name) const { return path_params.at(name); }
};

/// Headers of a request that reach a handler; everything else is the front's business.
inline constexpr std::string_view kPassedHeaders[] = {"accept",        "content-type",    "if-match",
                                                      "if-none-match", "idempotency-key", "prefer"};

struct Reply {
  int status = 200;  ///< 200 to 599
  std::string content_type = "application/json";
  std::string body = {};
  /// Further headers. They replace the front's defaults (Cache-Control: no-store and the like). Length,
  /// Connection, Date and Transfer-Encoding belong to the front; a name or value that does not fit into
  /// a header line is left out.
  std::vector<std::pair<std::string, std::string>> headers = {};
};

/// RFC 9457. `title` says the kind of problem and stays the same from case to case (empty: the standard
/// words of the status), `detail` this case: what, where, the allowed range.
struct ProblemDetails {
  int status = 500;
  std::string title = {};
  std::string detail = {};
  std::string instance = {};  ///< a URI reference; left out where empty
  std::string type = "about:blank";
  /// Extension members: name, and value as JSON text.
  std::vector<std::pair<std::string, std::string>> members = {};
};

/// An application/problem+json answer. Text that is no valid UTF-8 has its bad bytes replaced (U+FFFD).
Reply problem(const ProblemDetails& details);
Reply problem(int status, std::string title, std::string detail);

/// A problem to throw from a handler, for convenience; it becomes the answer. Any other exception becomes
/// a 500 that says nothing of it (the log does).
class Problem : public std::exception {
 public:
  explicit Problem(Reply answer) : answer_(std::move(answer)) {}
  Problem(int status, std::string title, std::string detail)
      : answer_(problem(status, std::move(title), std::move(detail))) {}
  const Reply& answer() const { return answer_; }
  const char* what() const noexcept override { return answer_.body.c_str(); }

 private:
  Reply answer_;
};

/// `text` as a JSON string with its quotes; bad UTF-8 replaced by U+FFFD.
std::string json_quote(std::string_view text);
/// The standard words of a status ("Not Found"); "Unknown" for others.
std::string_view status_words(int status);

}  // namespace skylight::http
