// Everything that is asked of a request before its body is read: framing, Host, target, route, Origin,
// content type, size. Knows no sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "service/http/router.hpp"
#include "service/http/server.hpp"
#include "service/http/static_files.hpp"
#include "service/http/target.hpp"
#include "service/http/wire.hpp"

namespace skylight::http {

/// The head of a request as it came off the wire; views into the parser's memory.
struct Head {
  std::string_view method;
  std::string_view target;
  bool http10 = false;
  std::vector<std::pair<std::string_view, std::string_view>> headers = {};
  std::string_view local_address;  ///< numeric, of this connection

  std::size_t count(std::string_view name) const;
  /// The first one's value, trimmed; empty where there is none.
  std::string_view value(std::string_view name) const;
};

/// What is to be done with a request that may pass.
struct Admission {
  /// An answer of the front itself (a file, OPTIONS); none: the route's handler answers.
  std::optional<StaticFiles::Found> answer;
  Router::Match match;
  Target target;
  HeaderList headers;  ///< of kPassedHeaders, lower-case names
  bool has_body = false;
  std::size_t max_body_bytes = 0;  ///< of this route
  std::size_t expected_bytes = 0;  ///< of the body: its length, or the bound where it comes in chunks
  bool wants_continue = false;     ///< waits for "100 Continue" before it sends its body
};

class Gate {
 public:
  /// Keeps references to all three.
  Gate(const ServerOptions& options, const Router& router, const StaticFiles& files);
  /// Throws Problem for a request that must not pass.
  Admission admit(const Head& head) const;

 private:
  void check_host(std::string_view authority, std::string_view local_address) const;
  std::string_view origin_form(const Head& head) const;
  void find_answer(const Head& head, Admission& admission) const;
  void check_write(const Head& head, const Admission& admission) const;
  void check_origin(const Head& head) const;

  const ServerOptions& options_;
  const Router& router_;
  const StaticFiles& files_;
};

}  // namespace skylight::http
