#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "settings/text.hpp"
#include "sim/scenario/outline.hpp"
#include "sim/scenario/robot_model.hpp"
#include "sim/scenario/scenario_checks.hpp"

namespace skylight::sim {
namespace {

using settings::number_text;

/// What an action or condition names, against what the scenario has.
class NameCheck {
 public:
  explicit NameCheck(const Scenario& scenario) : scenario_(scenario), robots_(all_robots(scenario)) {}

  const RobotSpec* find_robot(const std::string& id) const {
    const auto at =
        std::find_if(robots_.begin(), robots_.end(), [&](const RobotSpec& robot) { return robot.id == id; });
    return at == robots_.end() ? nullptr : &*at;
  }
  std::optional<Problem> robot(const std::string& id, const std::string& path) const {
    if (find_robot(id) != nullptr) return std::nullopt;
    return Problem{path, "there is no robot called \"" + id + "\""};
  }
  std::optional<Problem> camera(const std::string& id, const std::string& path) const {
    const bool known = std::any_of(scenario_.cameras.begin(), scenario_.cameras.end(),
                                   [&](const CameraSpec& camera) { return camera.id == id; });
    if (known) return std::nullopt;
    return Problem{path, "there is no camera called \"" + id + "\""};
  }
  std::optional<Problem> event(const std::string& name, const std::string& path) const {
    const bool known = std::any_of(scenario_.events.begin(), scenario_.events.end(),
                                   [&](const EventSpec& event) { return event.name == name; });
    if (known) return std::nullopt;
    return Problem{path, "there is no event called \"" + name + "\""};
  }

  std::optional<Problem> check(const SignalAction&, const std::string&) const { return std::nullopt; }
  std::optional<Problem> check(const LightAction&, const std::string&) const { return std::nullopt; }
  std::optional<Problem> check(const ShadowAction&, const std::string&) const { return std::nullopt; }
  std::optional<Problem> check(const BumpAction& action, const std::string& path) const {
    if (auto problem = camera(action.camera, path + "camera")) return problem;
    const auto hit = std::find_if(scenario_.cameras.begin(), scenario_.cameras.end(),
                                  [&](const CameraSpec& spec) { return spec.id == action.camera; });
    if (hit->position_m[2] + 1e-3 * action.by_mm[2] > 0.0) return std::nullopt;
    return Problem{path + "by_mm[2]", "would push the camera below the floor"};
  }
  std::optional<Problem> check(const FreezeAction& action, const std::string& path) const {
    return camera(action.camera, path + "camera");
  }
  std::optional<Problem> check(const BlackoutAction& action, const std::string& path) const {
    return camera(action.camera, path + "camera");
  }
  std::optional<Problem> check(const KidnapAction& action, const std::string& path) const {
    if (auto problem = robot(action.robot, path + "robot")) return problem;
    for (const Outline& part : outlines(robot_model(find_robot(action.robot)->model), action.to)) {
      if (!within(scenario_.room, part))
        return Problem{path + "to", "lies outside the room or in its wall (" + room_range(scenario_.room) +
                                        ", with the robot's whole body)"};
    }
    return std::nullopt;
  }
  std::optional<Problem> check(const PowerAction& action, const std::string& path) const {
    return robot(action.robot, path + "robot");
  }
  std::optional<Problem> check(const CoverAction& action, const std::string& path) const {
    if (auto problem = robot(action.robot, path + "robot")) return problem;
    if (!action.tag_only || find_robot(action.robot)->tag) return std::nullopt;
    return Problem{path + "tag_only", "robot " + action.robot + " has no tag to be covered"};
  }
  std::optional<Problem> check(const SlipAction& action, const std::string& path) const {
    return robot(action.robot, path + "robot");
  }
  std::optional<Problem> check(const PushAction& action, const std::string& path) const {
    return robot(action.robot, path + "robot");
  }
  std::optional<Problem> check(const DriveAction& action, const std::string& path) const {
    if (auto problem = robot(action.robot, path + "robot")) return problem;
    const RobotModel& model = robot_model(find_robot(action.robot)->model);
    const auto most = [&](double value, double limit, const char* key,
                          const char* unit) -> std::optional<Problem> {
      if (std::abs(value) <= limit * (1.0 + 1e-9)) return std::nullopt;
      return Problem{path + key, number_text(value) + unit +
                                     " is more than the robot can do, allowed up to " + number_text(limit) +
                                     unit};
    };
    if (action.side_mps != 0.0 && !model.holonomic)
      return Problem{path + "side_mps", "only a holonomic robot can drive sideways: this must be 0"};
    if (auto problem = most(action.v_mps, model.max_speed_mps, "v_mps", " m/s")) return problem;
    if (auto problem = most(action.side_mps, model.max_side_speed_mps, "side_mps", " m/s")) return problem;
    const double rate = std::floor(10.0 * model.max_yaw_rate_radps * 180.0 / std::numbers::pi + 0.5) / 10.0;
    return most(action.w_degps, rate, "w_degps", " deg/s");
  }
  std::optional<Problem> check(const PutAction& action, const std::string& path) const {
    if (in_room(scenario_.room, action.object.x_m, action.object.y_m)) return std::nullopt;
    return Problem{path + "object", "lies outside the room (" + room_range(scenario_.room) + ")"};
  }
  std::optional<Problem> check(const RemoveAction& action, const std::string& path) const {
    const auto is_it = [&](const ObjectSpec& object) { return object.id == action.object; };
    const bool there = std::any_of(scenario_.objects.begin(), scenario_.objects.end(), is_it);
    const bool comes =
        std::any_of(scenario_.events.begin(), scenario_.events.end(), [&](const EventSpec& event) {
          const auto* put = std::get_if<PutAction>(&event.action);
          return put != nullptr && is_it(put->object);
        });
    if (there || comes) return std::nullopt;
    return Problem{path + "object", "there is no thing called \"" + action.object + "\""};
  }

  std::optional<Problem> check(const AfterEvent& condition, const std::string& path) const {
    return event(condition.event, path + "event");
  }
  std::optional<Problem> check(const RobotAt& condition, const std::string& path) const {
    if (auto problem = robot(condition.robot, path + "robot")) return problem;
    if (in_room(scenario_.room, condition.place_m[0], condition.place_m[1])) return std::nullopt;
    return Problem{path + "place_m", "lies outside the room (" + room_range(scenario_.room) + ")"};
  }
  std::optional<Problem> check(const RobotsNear& condition, const std::string& path) const {
    if (auto problem = robot(condition.robot, path + "robot")) return problem;
    if (auto problem = robot(condition.other, path + "other")) return problem;
    if (condition.robot != condition.other) return std::nullopt;
    return Problem{path + "other", "must be another robot than " + condition.robot};
  }
  std::optional<Problem> check(const RobotTouches& condition, const std::string& path) const {
    return robot(condition.robot, path + "robot");
  }
  std::optional<Problem> check(const ProgramDone& condition, const std::string& path) const {
    return robot(condition.robot, path + "robot");
  }

 private:
  const Scenario& scenario_;
  std::vector<RobotSpec> robots_;
};

/// Events that wait for each other in a ring never happen.
std::optional<Problem> find_ring(const std::vector<EventSpec>& events) {
  for (std::size_t i = 0; i < events.size(); ++i) {
    const EventSpec* at = &events[i];
    std::string way = at->name;
    for (std::size_t steps = 0; steps <= events.size() && at->when; ++steps) {
      const auto* after = std::get_if<AfterEvent>(&at->when->is);
      if (after == nullptr) break;
      const auto next = std::find_if(events.begin(), events.end(),
                                     [&](const EventSpec& event) { return event.name == after->event; });
      if (next == events.end()) break;
      at = &*next;
      way += " after " + at->name;
      if (at == &events[i])
        return Problem{element("events", i) + ".when.event", "these events wait for each other: " + way};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Problem> find_action_problem(const Scenario& scenario, const Action& action,
                                           const std::string& path) {
  const NameCheck names(scenario);
  const std::string prefix = path.empty() ? path : path + ".";
  return std::visit([&](const auto& one) { return names.check(one, prefix); }, action);
}

std::optional<Problem> find_event_problem(const Scenario& scenario) {
  const NameCheck names(scenario);
  std::set<std::string> seen;
  for (std::size_t i = 0; i < scenario.events.size(); ++i) {
    const EventSpec& event = scenario.events[i];
    const std::string path = element("events", i);
    if (!event.name.empty() && !seen.insert(event.name).second)
      return Problem{path + ".name", "\"" + event.name + "\" is taken by an earlier event"};
    if (event.at_s && scenario.duration_s > 0.0 && *event.at_s > scenario.duration_s)
      return Problem{path + ".at_s", number_text(*event.at_s) + " s is never reached: the scenario ends at " +
                                         number_text(scenario.duration_s) + " s"};
    if (event.when) {
      const auto problem = std::visit(
          [&](const auto& condition) { return names.check(condition, path + ".when."); }, event.when->is);
      if (problem) return problem;
    }
    if (auto problem = find_action_problem(scenario, event.action, path)) return problem;
  }
  return find_ring(scenario.events);
}

}  // namespace skylight::sim
