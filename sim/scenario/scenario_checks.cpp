#include "sim/scenario/scenario_checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "settings/text.hpp"
#include "sim/scenario/outline.hpp"
#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {
namespace {

using settings::number_text;

std::optional<Problem> check_camera(const CameraSpec& camera, const std::string& path) {
  if (camera.position_m[2] <= 0.0) {
    return Problem{path + ".position_m[2]", "the camera must hang above the floor (0 m), it is at " +
                                                number_text(camera.position_m[2]) + " m"};
  }
  const bool rolling = camera.shutter == Shutter::rolling;
  const double busy = camera.exposure_s + (rolling ? camera.readout_s : 0.0);
  if (busy > 1.0 / camera.frame_rate_hz) {
    return Problem{path + ".exposure_s", number_text(busy) + " s" + (rolling ? " with the readout" : "") +
                                             " is longer than the time from frame to frame (" +
                                             number_text(1.0 / camera.frame_rate_hz) + " s)"};
  }
  if (camera.cx_px && *camera.cx_px > camera.width_px - 1) {
    return Problem{path + ".cx_px", number_text(*camera.cx_px) +
                                        " px lies outside the picture, allowed 0 to " +
                                        std::to_string(camera.width_px - 1)};
  }
  if (camera.cy_px && *camera.cy_px > camera.height_px - 1) {
    return Problem{path + ".cy_px", number_text(*camera.cy_px) +
                                        " px lies outside the picture, allowed 0 to " +
                                        std::to_string(camera.height_px - 1)};
  }
  if (camera.lens == Lens::kannala_brandt && camera.distortion[4] != 0.0) {
    return Problem{path + ".distortion[4]",
                   "a kannala_brandt lens has four coefficients: this one must be 0"};
  }
  return std::nullopt;
}

std::optional<Problem> check_top(const RobotSpec& robot, const RobotModel& model, const std::string& path) {
  const PictureSpec& picture = robot.picture;
  if (!picture.enabled && (!picture.file.empty() || picture.width_m))
    return Problem{path + ".picture.enabled", "is false, yet a file or width is given for the picture"};
  const double plate = model.plate.max.y() - model.plate.min.y();
  if (picture.width_m.value_or(0.0) > plate + 1e-9) {
    return Problem{path + ".picture.width_m", number_text(*picture.width_m) + " m is wider than the plate (" +
                                                  number_text(plate) + " m)"};
  }
  return std::nullopt;
}

/// One robot of the scenario with its copies: within the room, on nothing and nobody else.
class Placing {
 public:
  explicit Placing(const Scenario& scenario) : scenario_(scenario) {}

  std::optional<Problem> object(const ObjectSpec& object, const std::string& path) {
    if (!in_room(scenario_.room, object.x_m, object.y_m))
      return Problem{path, "lies outside the room (" + room_range(scenario_.room) + ")"};
    if (object.bottom_m > 0.0) return std::nullopt;
    const std::vector<Outline> parts{outline(object)};
    const auto hit = std::find_if(standing_.begin(), standing_.end(), [&](const Standing& other) {
      return (other.pushable || object.pushable) && overlap(parts, other.parts);
    });
    if (hit != standing_.end()) return Problem{path, "overlaps " + hit->name + " at the start"};
    standing_.push_back({"thing " + object.id, parts, object.pushable});
    return std::nullopt;
  }

  std::optional<Problem> robot(const RobotSpec& robot, const std::string& path) {
    const std::vector<Outline> parts = outlines(robot_model(robot.model), robot.start);
    for (const Outline& part : parts) {
      if (!within(scenario_.room, part))
        return Problem{path, "the robot" + called(robot, path) + " stands outside the room or in its wall (" +
                                 room_range(scenario_.room) + ", with its whole body)"};
    }
    const auto hit = std::find_if(standing_.begin(), standing_.end(),
                                  [&](const Standing& other) { return overlap(parts, other.parts); });
    if (hit != standing_.end())
      return Problem{path, "the robot" + called(robot, path) + " overlaps " + hit->name + " at the start"};
    standing_.push_back({"robot " + robot.id, parts, true});
    return std::nullopt;
  }

 private:
  struct Standing {
    std::string name;
    std::vector<Outline> parts;
    bool pushable;
  };
  /// A copy is named: its place in the list is the first one's.
  static std::string called(const RobotSpec& robot, const std::string& path) {
    std::string name;
    if (path.ends_with(".copies")) name.append(" ").append(robot.id);
    return name;
  }

  const Scenario& scenario_;
  std::vector<Standing> standing_;
};

std::optional<Problem> check_places(const Scenario& scenario) {
  Placing placing(scenario);
  for (std::size_t i = 0; i < scenario.objects.size(); ++i) {
    if (auto problem = placing.object(scenario.objects[i], element("objects", i))) return problem;
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    Scenario alone;
    alone.robots = {scenario.robots[i]};
    const std::vector<RobotSpec> copies = all_robots(alone);
    count += copies.size();
    if (count > 500) return Problem{element("robots", i) + ".copies.count", "makes more than 500 robots"};
    for (std::size_t k = 0; k < copies.size(); ++k) {
      const std::string path = element("robots", i) + (k == 0 ? ".start" : ".copies");
      if (auto problem = placing.robot(copies[k], path)) return problem;
    }
  }
  return std::nullopt;
}

/// Ids that must differ from each other: of robots, things and people together, as contacts name them.
class Ids {
 public:
  template <class Items>
  std::optional<Problem> add(const Items& items, const std::string& list) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (!seen_.insert(items[i].id).second)
        return Problem{element(list, i) + ".id", "\"" + items[i].id + "\" is taken by an earlier entry"};
    }
    return std::nullopt;
  }

 private:
  std::set<std::string> seen_;
};

std::optional<Problem> check_ids(const Scenario& scenario) {
  if (auto problem = Ids().add(scenario.cameras, "cameras")) return problem;
  Ids ids;
  if (auto problem = ids.add(scenario.robots, "robots")) return problem;
  if (auto problem = ids.add(scenario.objects, "objects")) return problem;
  if (auto problem = ids.add(scenario.people, "people")) return problem;
  std::set<std::string> all;
  for (const RobotSpec& robot : all_robots(scenario)) {
    if (!all.insert(robot.id).second)
      return Problem{"robots", "\"" + robot.id + "\" is the name of a robot and of another one's copy"};
  }
  return std::nullopt;
}

std::optional<Problem> check_expectation(const Scenario& scenario, const Expectation& expectation,
                                         const std::string& path) {
  const bool of_all = expectation.figure == Figure::id_switches || expectation.figure == Figure::idf1 ||
                      expectation.figure == Figure::mota;
  if (expectation.robot.empty()) return std::nullopt;
  if (of_all) return Problem{path + ".robot", "this figure is one of all robots together: name none"};
  const auto robots = all_robots(scenario);
  const bool known = std::any_of(robots.begin(), robots.end(),
                                 [&](const RobotSpec& robot) { return robot.id == expectation.robot; });
  if (known) return std::nullopt;
  return Problem{path + ".robot", "there is no robot called \"" + expectation.robot + "\""};
}

}  // namespace

std::string element(const std::string& list, std::size_t index) {
  return list + "[" + std::to_string(index) + "]";
}

std::string room_range(const RoomSpec& room) {
  std::string text;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const std::string half = number_text(0.5 * room.size_m[axis]);
    text.append(axis == 0 ? "x" : ", y")
        .append(" within -")
        .append(half)
        .append(" to ")
        .append(half)
        .append(" m");
  }
  return text;
}

bool in_room(const RoomSpec& room, double x_m, double y_m) {
  return std::abs(x_m) <= 0.5 * room.size_m[0] && std::abs(y_m) <= 0.5 * room.size_m[1];
}

std::optional<Problem> find_problem(const Scenario& scenario) {
  if (auto problem = check_ids(scenario)) return problem;
  for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
    if (auto problem = check_camera(scenario.cameras[i], element("cameras", i))) return problem;
  }
  if (auto problem = check_places(scenario)) return problem;
  if (auto problem = find_program_cycle(scenario)) return problem;
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    const RobotSpec& robot = scenario.robots[i];
    const std::string path = element("robots", i);
    if (auto problem = check_top(robot, robot_model(robot.model), path)) return problem;
    if (auto problem = find_program_problem(scenario, robot, path + ".program")) return problem;
  }
  if (auto problem = find_event_problem(scenario)) return problem;
  for (std::size_t i = 0; i < scenario.expect.size(); ++i) {
    if (auto problem = check_expectation(scenario, scenario.expect[i], element("expect", i))) return problem;
  }
  return std::nullopt;
}

}  // namespace skylight::sim
