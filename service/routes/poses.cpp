#include <algorithm>
#include <sstream>

#include "service/routes/context.hpp"
#include "service/trajectory.hpp"

namespace skylight::service {
namespace {

// `now` is the present, to which only a prediction reaches; without `at` it is the newest frame that answers.
PoseQuery query_of(const http::Request& request) {
  const AskedInstant asked = query_instant(request, "at");
  const auto kind = query_kind(request);
  if (!asked.now) return {.at = asked.at, .kind = kind};
  if (kind && *kind != PoseKind::predicted) {
    throw http::Problem(422, "No answer for that instant",
                        "kind is " + std::string(to_string(*kind)) +
                            ", but at is now, allowed: predicted (leave out at for the newest frame's pose)");
  }
  return {.at = {}, .kind = PoseKind::predicted};
}

PoseAnswer answer_or_refuse(const Snapshot& snapshot, const RobotSnapshot& robot, const PoseQuery& query,
                            const QueryContext& context) {
  try {
    return answer(snapshot, robot, query, context);
  } catch (const QueryError& e) {
    throw http::Problem(422, "No answer for that instant", e.what());
  }
}

http::Reply get_pose(const http::Request& request, const RouteContext& context) {
  check_query(request, {"at", "kind"});
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& robot = robot_of(request, *snapshot);
  const QueryContext around{.now = context.pipeline.now(), .horizon = context.horizon};
  const PoseQuery query = query_of(request);
  return json_reply(to_json(answer_or_refuse(*snapshot, robot, query, around), around.now));
}

// All robots at one instant, from one snapshot.
http::Reply get_poses(const http::Request& request, const RouteContext& context) {
  check_query(request, {"at", "kind", "limit", "offset"});
  const auto snapshot = context.pipeline.snapshot();
  const QueryContext around{.now = context.pipeline.now(), .horizon = context.horizon};
  const PoseQuery query = query_of(request);
  std::vector<Json> items;
  std::optional<std::string> refused;
  for (const RobotSnapshot& robot : snapshot->robots) {
    try {
      items.push_back(to_json(answer(*snapshot, robot, query, around), around.now));
    } catch (const QueryError& e) {  // a robot that was added later must not silence the others
      refused = e.what();
      items.push_back(to_json(
          PoseAnswer{.robot = robot.view.id, .state = robot.view.state, .reason = e.what()}, around.now));
    }
  }
  const bool none =
      std::all_of(items.begin(), items.end(), [](const Json& item) { return item["pose"].is_null(); });
  if (refused && none) throw http::Problem(422, "No answer for that instant", *refused);
  return json_reply(page_of(request, items));
}

http::Reply get_trajectory(const http::Request& request, const RouteContext& context) {
  check_query(request, {"from", "to", "kind", "format"});
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& robot = robot_of(request, *snapshot);
  const PoseKind kind = query_kind(request).value_or(PoseKind::filtered);
  if (kind == PoseKind::predicted) {
    throw http::Problem(422, "No such trajectory",
                        "kind is predicted, allowed for a trajectory: measured, filtered, smoothed");
  }
  if (kind == PoseKind::smoothed && robot.view.filter->smoothing_lag() <= Duration::zero()) {
    throw http::Problem(422, "No such trajectory",
                        "kind is smoothed: this robot's filter has no smoother, allowed: measured, filtered");
  }
  const std::string* named = request.query_value("format");
  const auto format = trajectory_format(named != nullptr ? *named : "json");
  if (!format)
    throw http::Problem(400, "Bad query parameter", "format is '" + *named + "', allowed: json, csv, tum");
  const Time from = query_time(request, "from").value_or(Time{});
  const Time to = query_time(request, "to").value_or(Time::max());
  if (from > to) throw http::Problem(422, "No such trajectory", "from is after to");

  std::ostringstream out;
  write_trajectory(out, make_trajectory(robot.view, kind, from, to), *format);
  const char* type = *format == TrajectoryFormat::json  ? "application/json"
                     : *format == TrajectoryFormat::csv ? "text/csv; charset=utf-8"
                                                        : "text/plain; charset=utf-8";
  return {.content_type = type, .body = out.str()};
}

}  // namespace

void add_pose_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  router.add("GET", "/api/v1/poses", bound(get_poses));
  router.add("GET", "/api/v1/robots/{id}/pose", bound(get_pose));
  router.add("GET", "/api/v1/robots/{id}/trajectory", bound(get_trajectory), http::Lane::slow);
}

}  // namespace skylight::service
