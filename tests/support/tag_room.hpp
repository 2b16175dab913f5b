// Robots with tags in the simulator's room, every effect on: pictures whose truth is exact.
#pragma once

#include <string>
#include <vector>

#include "sim/camera/camera_model.hpp"
#include "sim/render/artwork.hpp"
#include "sim/scenario/robot_model.hpp"
#include "sim/simulation.hpp"
#include "tracker/camera.hpp"
#include "tracker/detect/apriltag.hpp"

namespace skylight::test {

struct TagRoomSpec {
  std::string family = "36h11";
  double edge_px = 16.0;
  double focal_px = 350.0;
  double analogue_gain = 1.0;
  std::uint64_t seed = 11;
};

/// A room of 3 x 3 m seen from 2 m above by 960 x 540 px: robots in rows that turn on the spot, tags of
/// different ids on bare tops, out to where the picture ends.
class TagRoom {
 public:
  explicit TagRoom(const TagRoomSpec& spec)
      : scenario_(scenario(spec)), simulation_(scenario_), lens_(sim::camera_model(scenario_.cameras[0])) {
    for (std::size_t robot = 0; robot < robots(); ++robot) tags_.push_back(tag_of(robot));
  }

  static double plate_height_m() { return model().plate_height_m; }
  std::size_t robots() const { return scenario_.robots.size(); }
  sim::Shot next() { return simulation_.next().value(); }

  /// The tag of a robot, as its owner would configure it.
  const TagSpec& tag(std::size_t robot) const { return tags_.at(robot); }

  /// Where its corners truly are in the picture: top left, top right, bottom right, bottom left.
  TagCorners corners(std::size_t robot, const Pose2& pose) const {
    const TagSpec& spec = tag(robot);
    const double half = 0.5 * spec.size_m;
    const std::array<Eigen::Vector2d, 4> own{Eigen::Vector2d(half, half), Eigen::Vector2d(half, -half),
                                             Eigen::Vector2d(-half, -half), Eigen::Vector2d(-half, half)};
    TagCorners corners;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d on_robot =
          spec.mounting.position() + Eigen::Rotation2Dd(spec.mounting.yaw) * own[i];
      const Eigen::Vector2d at = pose.position() + Eigen::Rotation2Dd(pose.yaw) * on_robot;
      corners[i] = lens_.project_map({at.x(), at.y(), spec.height_m}).value();
    }
    return corners;
  }

  /// The true camera.
  CameraModel camera() const {
    const sim::CameraSpec& spec = scenario_.cameras[0];
    return CameraModel({.width_px = spec.width_px,
                        .height_px = spec.height_px,
                        .fx_px = spec.fx_px,
                        .fy_px = spec.fy_px,
                        .cx_px = (spec.width_px - 1) / 2.0,
                        .cy_px = (spec.height_px - 1) / 2.0,
                        .distortion = spec.distortion},
                       sim::map_from_camera(spec));
  }

 private:
  TagSpec tag_of(std::size_t robot) const {
    const sim::TagSpec& tag = *scenario_.robots[robot].tag;
    const sim::TagPlace place = *sim::tag_place(scenario_, robot);
    const Eigen::Vector2d plate = 0.5 * (model().plate.min + model().plate.max);
    return {.family = tag.family,
            .id = tag.id,
            .size_m = tag.size_m,
            .height_m = plate_height_m(),
            .mounting = {plate.x() + place.x_m, plate.y() + place.y_m, place.yaw}};
  }

  static const sim::RobotModel& model() { return sim::robot_model(sim::RobotModelName::differential); }

  static sim::Scenario scenario(const TagRoomSpec& spec) {
    sim::Scenario scenario;
    scenario.seed = spec.seed;
    scenario.room.size_m = {3.0, 3.0};
    scenario.light.lamps[0].position_m = {0.7, 0.5, 1.9};
    sim::CameraSpec& camera = scenario.cameras.front();
    camera.position_m = {0.0, 0.0, 2.0};
    camera.width_px = 960;
    camera.height_px = 540;
    camera.fx_px = camera.fy_px = spec.focal_px;
    camera.frame_rate_hz = 3.0;
    camera.sensor.gain = spec.analogue_gain;
    const double px_per_metre = spec.focal_px / (2.0 - plate_height_m());
    const double size_m = spec.edge_px / px_per_metre;
    // As far as a whole tag is in the picture, and the robot inside the room.
    const double x = std::min(1.35, 440.0 / px_per_metre);
    const double y = std::min(1.35, 225.0 / px_per_metre);
    const int columns = 1 + static_cast<int>(2.0 * x / 0.42);
    const int rows = 1 + static_cast<int>(2.0 * y / 0.42);
    scenario.robots.clear();
    for (int i = 0; i < columns * rows; ++i) {
      sim::RobotSpec robot;
      robot.id = std::string("r").append(std::to_string(i));
      robot.model = sim::RobotModelName::differential;
      robot.picture.enabled = false;
      robot.tag =
          sim::TagSpec{.family = spec.family, .id = (i * 23 + 7) % tag_count(spec.family), .size_m = size_m};
      robot.tag->yaw_deg = i % 4 * 90.0;
      robot.start = {-x + 2.0 * x * (i % columns) / (columns - 1.0),
                     -y + 2.0 * y * (i / columns) / (rows - 1.0), i * 37 % 360 * 1.0};
      robot.program = {{sim::TurnStep{.angle_deg = 3600.0, .rate_degps = 40.0}}};
      scenario.robots.push_back(robot);
    }
    return scenario;
  }

  sim::Scenario scenario_;
  sim::Simulation simulation_;
  sim::CameraModel lens_;
  std::vector<TagSpec> tags_;
};

}  // namespace skylight::test
