#include <cmath>

#include "service/routes/context.hpp"
#include "service/simulator_desk.hpp"

namespace skylight::service {

/// Bodies of the requests.
struct ScenarioChoice {
  std::string scenario;
  std::optional<std::uint64_t> seed;
};
struct SpeedChange {
  double speed = 1.0;
};
struct StepRequest {
  int frames = 1;
};
struct VelocityCommand {
  double v_mps = 0.0;
  double w_radps = 0.0;
  double side_mps = 0.0;
};

void describe(settings::Fields& fields, ScenarioChoice& choice) {
  fields.about("Which scenario is to run.");
  fields.field("scenario", choice.scenario,
               {.min_length = 1,
                .max_length = 200,
                .required = true,
                .help = "Name of a scenario that comes with Skylight, as /api/v1/scenarios lists it."});
  fields.field("seed", choice.seed, {.help = "Absent: the scenario's own."});
}

void describe(settings::Fields& fields, SpeedChange& change) {
  fields.about("How fast the scenario runs.");
  fields.field("speed", change.speed,
               {.min = 0.01, .max = 100, .required = true, .help = "Against real time."});
}

void describe(settings::Fields& fields, StepRequest& step) {
  fields.about("How far a paused scenario goes on.");
  fields.field("frames", step.frames, {.min = 1, .max = 1000, .help = "Of all cameras together."});
}

void describe(settings::Fields& fields, VelocityCommand& command) {
  fields.about("How fast a robot is to go, in its own frame; it obeys for half a second.");
  fields.field("v_mps", command.v_mps,
               {.min = -5, .max = 5, .unit = "m/s", .required = true, .help = "Forward."});
  fields.field("w_radps", command.w_radps,
               {.min = -20, .max = 20, .unit = "rad/s", .required = true, .help = "Counter-clockwise."});
  fields.field("side_mps", command.side_mps,
               {.min = -5, .max = 5, .unit = "m/s", .help = "To the left; for robots that can."});
}

namespace {

constexpr double kWatchdogS = 0.5;  ///< as ROS bases do: who says nothing more has let go

std::shared_ptr<LiveSimulator> simulator_of(const RouteContext& context) {
  auto live = context.simulator != nullptr ? context.simulator->running().live : nullptr;
  if (!live) throw http::Problem(404, "No simulator", "the source of this service is not the simulator");
  return live;
}

[[noreturn]] void refuse_ended(const LiveSimulator& live) {
  throw http::Problem(409, "The scenario has ended",
                      "scenario '" + live.shows().name() + "' has ended; reset it, or load another");
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json truth_json(const Truth& truth, const Json& at) {
  const bool known = truth.present;
  return {{"id", truth.id},
          {"at", at},
          {"x", known ? number(truth.pose.x) : Json(nullptr)},
          {"y", known ? number(truth.pose.y) : Json(nullptr)},
          {"yaw", known ? number(truth.pose.yaw) : Json(nullptr)},
          {"velocity", known ? Json{{"x", number(truth.velocity.x)},
                                    {"y", number(truth.velocity.y)},
                                    {"yaw_rate", number(truth.velocity.yaw_rate)}}
                             : Json(nullptr)},
          {"present", truth.present},
          {"in_view", truth.in_view},
          {"visible", number(truth.visible)},
          {"touches", truth.touches}};
}

Json simulator_json(const RouteContext& context) {
  simulator_of(context);
  const SimulatorDesk::Running running = context.simulator->running();
  const LiveSimulator& live = *running.live;
  const SimulatorFrames& shows = live.shows();
  const SimulatorStatus status = live.status();
  const bool seen = !status.truth.empty();
  Json cameras = Json::array();
  for (const SimulatedCamera& camera : shows.cameras()) cameras.push_back(camera.id);
  Json robots = Json::array();
  const Json at = seen ? Json(unix_seconds(status.captured)) : Json(nullptr);
  for (const Truth& truth : status.truth) robots.push_back(truth_json(truth, at));
  return {{"scenario", running.scenario},
          {"seed", shows.seed()},
          {"state", to_string(status.state)},
          {"speed", status.speed},
          {"time", to_seconds(status.time)},
          {"duration", shows.duration_s() > 0 ? Json(shows.duration_s()) : Json(nullptr)},
          {"cameras", std::move(cameras)},
          {"camera", seen ? Json(shows.cameras()[status.camera].id) : Json(nullptr)},
          {"robots", std::move(robots)}};
}

http::Reply list_scenarios(const http::Request& request, const RouteContext&) {
  check_query(request, {"limit", "offset"});
  std::vector<Json> items;
  for (const ScenarioSummary& scenario : shipped_scenarios()) {
    items.push_back({{"name", scenario.name},
                     {"description", scenario.description},
                     {"cameras", scenario.cameras},
                     {"robots", scenario.robots},
                     {"duration", scenario.duration_s > 0 ? Json(scenario.duration_s) : Json(nullptr)}});
  }
  return json_reply(page_of(request, items));
}

http::Reply get_simulator(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  return json_reply(simulator_json(context));
}

// What a scenario refuses is the request's fault, and what ran runs on.
template <class Change>
http::Reply change_scenario(const RouteContext& context, const Change& change) {
  try {
    change();
  } catch (const settings::Error& error) {
    refuse_body(error);
  } catch (const SourceError& error) {
    throw http::Problem(422, "The scenario is refused", error.what());
  } catch (const std::invalid_argument& error) {
    throw http::Problem(422, "The scenario is refused", error.what());
  }
  return json_reply(simulator_json(context));
}

http::Reply load_scenario(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  simulator_of(context);
  const auto choice = read_body<ScenarioChoice>(body_document(request));
  return change_scenario(context, [&] { context.simulator->load(choice.scenario, choice.seed); });
}

http::Reply reset(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  simulator_of(context);
  return change_scenario(context, [&] { context.simulator->reset(); });
}

http::Reply set_speed(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto live = simulator_of(context);
  live->set_speed(read_body<SpeedChange>(body_document(request)).speed);
  return json_reply(simulator_json(context));
}

http::Reply start(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto live = simulator_of(context);
  if (!live->run()) refuse_ended(*live);
  return json_reply(simulator_json(context));
}

http::Reply pause(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto live = simulator_of(context);
  if (!live->pause()) refuse_ended(*live);
  return json_reply(simulator_json(context));
}

http::Reply step(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto live = simulator_of(context);
  const auto asked = read_body<StepRequest>(body_document(request));
  if (live->status().state == RunState::ended) refuse_ended(*live);
  if (!live->step(asked.frames))
    throw http::Problem(409, "The scenario is not paused", "pause it first: only what stands can be stepped");
  return json_reply(simulator_json(context), 202);
}

// What an action came to; what it refuses becomes a 422 problem with the key path.
template <class Action>
http::Reply act(const LiveSimulator& live, const Action& action) {
  std::optional<Duration> at;
  try {
    at = action();
  } catch (const settings::Error& error) {
    refuse_body(error);
  } catch (const std::invalid_argument& error) {
    throw http::Problem(422, "The action is refused", std::string("body: ") + error.what());
  }
  if (!at) refuse_ended(live);
  return json_reply({{"time", to_seconds(*at)}}, 202);
}

http::Reply post_action(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto live = simulator_of(context);
  body_document(request);  // no JSON at all is told from an action that is none
  return act(*live, [&] { return live->act(request.body, "body"); });
}

const SimulatedRobot& simulated_robot(const http::Request& request, const LiveSimulator& live) {
  const std::string& id = request.path_param("id");
  for (const SimulatedRobot& robot : live.shows().robots()) {
    if (robot.id == id) return robot;
  }
  throw http::Problem(404, "No such robot", "there is no robot '" + id + "' in this scenario");
}

http::Reply drive(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto live = simulator_of(context);
  const SimulatedRobot& robot = simulated_robot(request, *live);
  const auto command = read_body<VelocityCommand>(body_document(request));
  return act(*live, [&] {
    return live->drive({.robot = robot.id,
                        .v_mps = command.v_mps,
                        .side_mps = command.side_mps,
                        .w_radps = command.w_radps,
                        .for_s = kWatchdogS});
  });
}

http::Reply list_events(const http::Request& request, const RouteContext& context) {
  check_query(request, {"since", "limit", "offset"});
  const auto live = simulator_of(context);
  const auto since = query_number(request, "since");
  if (since && !(*since >= 0.0 && *since <= 1e9)) {
    throw http::Problem(400, "Bad query parameter",
                        "since is '" + *request.query_value("since") +
                            "', allowed: seconds of the scenario's time, 0 to 1000000000");
  }
  std::vector<Json> items;
  for (const Happening& happening : live->happenings()) {
    const double time = to_seconds(happening.at - live->shows().start());
    if (since && time <= *since) continue;
    items.push_back({{"time", time},
                     {"name", happening.name.empty() ? Json(nullptr) : Json(happening.name)},
                     {"action", Json::parse(happening.action)}});
  }
  return json_reply(page_of(request, items));
}

}  // namespace

void add_simulator_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  const auto slow = http::Lane::slow;
  router.add("GET", "/api/v1/scenarios", bound(list_scenarios), slow);
  router.add("GET", "/api/v1/simulator", bound(get_simulator));
  router.add("PUT", "/api/v1/simulator", bound(load_scenario), slow);
  router.add("PATCH", "/api/v1/simulator", bound(set_speed));
  router.add("POST", "/api/v1/simulator/start", bound(start));
  router.add("POST", "/api/v1/simulator/pause", bound(pause));
  router.add("POST", "/api/v1/simulator/step", bound(step));
  router.add("POST", "/api/v1/simulator/reset", bound(reset), slow);
  router.add("POST", "/api/v1/simulator/actions", bound(post_action), slow);
  router.add("GET", "/api/v1/simulator/events", bound(list_events));
  router.add("POST", "/api/v1/robots/{id}/cmd_vel", bound(drive), slow);
}

}  // namespace skylight::service
