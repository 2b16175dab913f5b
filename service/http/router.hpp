// Which handler answers which method and path.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/http/message.hpp"

namespace skylight::http {

/// Which workers run a handler: `quick` for reads from memory (microseconds to a few milliseconds), `slow`
/// for everything that encodes, decodes, searches or touches a disk; its queue is bounded (503 when full).
enum class Lane { quick, slow };

/// Runs on a worker, several at a time. Whatever it throws is answered.
using Handler = std::function<Reply(const Request&)>;

struct RouteOptions {
  Lane lane = Lane::quick;
  std::size_t max_body_bytes = 0;  ///< 0: the server's bound
  /// What a body may be, lower case, without parameters; anything else is a 415.
  std::vector<std::string> content_types = {"application/json"};
};

struct Route {
  std::string method;
  std::string pattern;
  Handler handler;
  RouteOptions options;
};

/// Literal segments win over `{parameters}`. GET routes answer HEAD too; OPTIONS is answered by the front.
class Router {
 public:
  /// `method`: GET, POST, PUT, PATCH or DELETE. `pattern`: "/api/v1/robots/{id}/pose"; a parameter fills a
  /// whole segment. Throws std::invalid_argument for another method, a malformed pattern, or a pattern
  /// that is already there for this method (whatever its parameters are called).
  void add(std::string method, std::string pattern, Handler handler, RouteOptions options);
  void add(std::string method, std::string pattern, Handler handler, Lane lane = Lane::quick) {
    add(std::move(method), std::move(pattern), std::move(handler), RouteOptions{.lane = lane});
  }
  /// In the order in which they were added; the contract test holds them against the OpenAPI file.
  std::vector<Route> routes() const { return routes_; }

  struct Match {
    const Route* route = nullptr;  ///< null: nothing here, or not for this method
    std::map<std::string, std::string> path_params;
    /// For "Allow" when the path is known ("GET, HEAD, OPTIONS"); empty: no such path.
    std::string allow;
  };
  /// `segments`: the decoded parts between the slashes. The route pointer holds until the next add().
  Match match(std::string_view method, const std::vector<std::string>& segments) const;

 private:
  struct Node {
    std::map<std::string, Node, std::less<>> literals;
    std::unique_ptr<Node> parameter;
    std::map<std::string, std::size_t, std::less<>> route_by_method;
  };
  static const Node* find(const Node& node, const std::vector<std::string>& segments, std::size_t depth);

  std::vector<Route> routes_;
  Node root_;
};

}  // namespace skylight::http
