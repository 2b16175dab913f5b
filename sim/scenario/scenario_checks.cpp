#include "sim/scenario/scenario_checks.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "settings/text.hpp"
#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {
namespace {

using settings::number_text;
using Corners = std::array<Eigen::Vector2d, 4>;

std::string element(const std::string& list, std::size_t index) {
  return list + "[" + std::to_string(index) + "]";
}

Corners corners(const Rectangle& part, const StartSpec& start) {
  const Eigen::Rotation2Dd turn(start.yaw_deg * std::numbers::pi / 180.0);
  const Eigen::Vector2d at(start.x_m, start.y_m);
  const auto place = [&](double x, double y) { return Eigen::Vector2d(at + turn * Eigen::Vector2d(x, y)); };
  return {place(part.min.x(), part.min.y()), place(part.max.x(), part.min.y()),
          place(part.max.x(), part.max.y()), place(part.min.x(), part.max.y())};
}

/// Whether a side of `a` has all of `b` on its far side.
bool separates(const Corners& a, const Corners& b) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d side = a[(i + 1) % 4] - a[i];
    const Eigen::Vector2d outward(side.y(), -side.x());  // corners run counter-clockwise
    bool all = true;
    for (const Eigen::Vector2d& corner : b) all = all && outward.dot(corner - a[i]) >= 0.0;
    if (all) return true;
  }
  return false;
}

bool overlap(const RobotSpec& a, const RobotSpec& b) {
  for (const Rectangle& part_a : robot_model(a.model).footprint) {
    for (const Rectangle& part_b : robot_model(b.model).footprint) {
      const Corners corners_a = corners(part_a, a.start);
      const Corners corners_b = corners(part_b, b.start);
      if (!separates(corners_a, corners_b) && !separates(corners_b, corners_a)) return true;
    }
  }
  return false;
}

std::optional<Problem> check_camera(const CameraSpec& camera, const std::string& path) {
  if (camera.position_m[2] <= 0.0) {
    return Problem{path + ".position_m[2]", "the camera must hang above the floor (0 m), it is at " +
                                                number_text(camera.position_m[2]) + " m"};
  }
  if (camera.exposure_s > 1.0 / camera.frame_rate_hz) {
    return Problem{path + ".exposure_s", number_text(camera.exposure_s) +
                                             " s is longer than the time from frame to frame (" +
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

/// Checks the steps of a program against the robot and the room.
class ProgramCheck {
 public:
  ProgramCheck(const RobotModel& model, const RoomSpec& room) : model_(model), room_(room) {}

  std::optional<Problem> steps(const std::vector<ProgramStep>& steps, const std::string& path) const {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::string here = element(path, i);
      if (auto problem = std::visit([&](const auto& step) { return check(step, here); }, steps[i].action))
        return problem;
      if (never_ends(steps[i]) && i + 1 < steps.size()) {
        return Problem{element(path, i + 1), "is never reached: the step before it goes on for ever"};
      }
    }
    return std::nullopt;
  }

 private:
  static bool never_ends(const ProgramStep& step) {
    if (const auto* repeat = std::get_if<RepeatStep>(&step.action)) {
      if (repeat->times == 0) return true;
      return !repeat->steps.empty() && never_ends(repeat->steps.back());
    }
    const auto* path = std::get_if<WaypointsStep>(&step.action);
    return path != nullptr && path->loop;
  }

  std::optional<Problem> speed(double value, const std::string& path) const {
    if (std::abs(value) <= model_.max_speed_mps + 1e-9) return std::nullopt;
    return Problem{path, number_text(value) + " m/s is more than the robot can do, allowed up to " +
                             number_text(model_.max_speed_mps) + " m/s"};
  }
  std::optional<Problem> rate(double degps, const std::string& path) const {
    const double most = model_.max_yaw_rate_radps * 180.0 / std::numbers::pi;
    if (std::abs(degps) <= most + 1e-6) return std::nullopt;
    return Problem{path, number_text(degps) + " deg/s is more than the robot can do, allowed up to " +
                             number_text(std::round(10.0 * most) / 10.0) + " deg/s"};
  }

  std::optional<Problem> check(const LineStep& step, const std::string& path) const {
    return speed(step.speed_mps, path + ".speed_mps");
  }
  std::optional<Problem> check(const ArcStep& step, const std::string& path) const {
    return speed(step.speed_mps, path + ".speed_mps");
  }
  std::optional<Problem> check(const TurnStep& step, const std::string& path) const {
    return rate(step.rate_degps, path + ".rate_degps");
  }
  template <class Step>
  std::optional<Problem> check(const Step&, const std::string&) const {
    return std::nullopt;
  }
  std::optional<Problem> check(const DriveStep& step, const std::string& path) const {
    if (auto problem = speed(step.v_mps, path + ".v_mps")) return problem;
    return rate(step.w_degps, path + ".w_degps");
  }
  std::optional<Problem> check(const RepeatStep& step, const std::string& path) const {
    return steps(step.steps, path + ".steps");
  }
  std::optional<Problem> check(const WaypointsStep& step, const std::string& path) const {
    for (std::size_t i = 0; i < step.points_m.size(); ++i) {
      const auto& point = step.points_m[i];
      if (std::abs(point[0]) > 0.5 * room_.size_m[0] || std::abs(point[1]) > 0.5 * room_.size_m[1]) {
        return Problem{element(path + ".points_m", i), "lies outside the room"};
      }
    }
    return speed(step.speed_mps, path + ".speed_mps");
  }

  const RobotModel& model_;
  const RoomSpec& room_;
};

std::optional<Problem> check_robot(const Scenario& scenario, std::size_t index) {
  const RobotSpec& robot = scenario.robots[index];
  const std::string path = element("robots", index);
  const RobotModel& model = robot_model(robot.model);
  for (const Rectangle& part : model.footprint) {
    for (const Eigen::Vector2d& corner : corners(part, robot.start)) {
      if (std::abs(corner.x()) > 0.5 * scenario.room.size_m[0] ||
          std::abs(corner.y()) > 0.5 * scenario.room.size_m[1]) {
        return Problem{path + ".start", "the robot stands outside the room or in its wall (x within -" +
                                            number_text(0.5 * scenario.room.size_m[0]) + " to " +
                                            number_text(0.5 * scenario.room.size_m[0]) + " m, y within -" +
                                            number_text(0.5 * scenario.room.size_m[1]) + " to " +
                                            number_text(0.5 * scenario.room.size_m[1]) +
                                            " m, with its whole body)"};
      }
    }
  }
  const double plate = model.plate.max.y() - model.plate.min.y();
  if (robot.picture.width_m.value_or(0.0) > plate + 1e-9) {
    return Problem{
        path + ".picture.width_m",
        number_text(*robot.picture.width_m) + " m is wider than the plate (" + number_text(plate) + " m)"};
  }
  for (std::size_t other = 0; other < index; ++other) {
    if (overlap(robot, scenario.robots[other])) {
      return Problem{path + ".start",
                     "the robot overlaps robot " + scenario.robots[other].id + " at the start"};
    }
  }
  return ProgramCheck(model, scenario.room).steps(robot.program, path + ".program");
}

template <class Items>
std::optional<Problem> check_ids(const Items& items, const std::string& list) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!seen.insert(items[i].id).second)
      return Problem{element(list, i) + ".id", "\"" + items[i].id + "\" is taken by an earlier entry"};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Problem> find_problem(const Scenario& scenario) {
  if (auto problem = check_ids(scenario.cameras, "cameras")) return problem;
  if (auto problem = check_ids(scenario.robots, "robots")) return problem;
  for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
    if (auto problem = check_camera(scenario.cameras[i], element("cameras", i))) return problem;
  }
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    if (auto problem = check_robot(scenario, i)) return problem;
  }
  return std::nullopt;
}

}  // namespace skylight::sim
