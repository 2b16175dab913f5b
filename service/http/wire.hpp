// The head of an answer: which headers it carries, and its bytes for answers of the front itself.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "service/http/message.hpp"

namespace skylight::http {

using HeaderList = std::vector<std::pair<std::string, std::string>>;

/// How the connection goes on after an answer.
struct Envelope {
  bool head_only = false;   ///< the request was HEAD: lengths as for GET, but no body
  bool keep_alive = false;  ///< another request may follow
  bool http10 = false;      ///< the peer speaks HTTP/1.0: keeping alive must be said
};

/// True where an answer of that status never has a body, nor a length (RFC 9110, 8.6).
bool is_bodiless(int status);

/// The headers of `reply`: its own where they fit into a header line, the safe defaults where it says
/// nothing, Date, and Content-Type with a body. Without Content-Length and Connection.
HeaderList answer_headers(const Reply& reply, bool with_body);

/// Status line and headers, with the blank line. `body_bytes`: what Content-Length says.
std::string answer_head(const Reply& reply, std::size_t body_bytes, const Envelope& envelope);

/// The whole answer; takes no body along for HEAD.
std::string answer_bytes(const Reply& reply, const Envelope& envelope);

}  // namespace skylight::http
