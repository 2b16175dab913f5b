// The handlers through the router, without sockets.
#pragma once

#include <map>
#include <memory>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "service/routes/context.hpp"
#include "tests/service/fakes.hpp"

namespace skylight::service::test {

struct Answer {
  int status = 0;
  std::string type;
  std::string body;
  std::map<std::string, std::string> headers;

  Json json() const { return Json::parse(body); }
  std::string detail() const { return json()["detail"]; }
};

inline std::multimap<std::string, std::string> query_of(const std::string& text) {
  std::multimap<std::string, std::string> query;
  std::istringstream in(text);
  for (std::string pair; std::getline(in, pair, '&');) {
    const auto equals = pair.find('=');
    query.emplace(pair.substr(0, equals), equals == std::string::npos ? "" : pair.substr(equals + 1));
  }
  return query;
}

inline std::vector<std::string> segments_of(const std::string& path) {
  std::vector<std::string> segments;
  std::istringstream in(path.substr(1));
  for (std::string segment; std::getline(in, segment, '/');) segments.push_back(segment);
  return segments;
}

/// `target`: a path, and a query without percent signs.
inline Answer call_route(const http::Router& router, const std::string& method, const std::string& target,
                         const std::string& body = {}, std::map<std::string, std::string> headers = {}) {
  const auto mark = target.find('?');
  http::Request request{
      .method = method, .path = target.substr(0, mark), .headers = std::move(headers), .body = body};
  if (mark != std::string::npos) request.query = query_of(target.substr(mark + 1));
  const http::Router::Match match = router.match(method, segments_of(request.path));
  if (match.route == nullptr) return {.status = match.allow.empty() ? 404 : 405};
  request.path_params = match.path_params;
  http::Reply reply;
  try {
    reply = match.route->handler(request);
  } catch (const http::Problem& problem) {
    reply = problem.answer();
  }
  return {reply.status, reply.content_type, reply.body, {reply.headers.begin(), reply.headers.end()}};
}

class Routes : public testing::Test {
 protected:
  explicit Routes(std::vector<RobotSpec> robots = {robot_of(small_room())})
      : rig_(small_room(), robots), store_({{"anna", robots.empty() ? nullptr : robots[0].appearance}}) {
    default_method_.filter.kind = WindowFilterConfig{.window_size = 7};
    context_ = std::make_unique<RouteContext>(RouteContext{.pipeline = *rig_.pipeline,
                                                           .appearances = store_,
                                                           .default_method = default_method_,
                                                           .horizon = std::chrono::seconds(2)});
    add_health_routes(router_, *context_);
    add_robot_routes(router_, *context_);
    add_pose_routes(router_, *context_);
    add_appearance_routes(router_, *context_);
    add_camera_routes(router_, *context_);
    add_odometry_routes(router_, *context_);
    add_geometry_routes(router_, *context_);
    rig_.pipeline->start();
  }

  Answer call(const std::string& method, const std::string& target, const std::string& body = {}) const {
    return call_route(router_, method, target, body);
  }
  Answer get(const std::string& target) const { return call("GET", target); }

  Rig rig_;
  AppearanceStore store_;
  MethodConfig default_method_;
  std::unique_ptr<RouteContext> context_;
  http::Router router_;
};

}  // namespace skylight::service::test
