// What a kind of robot is: its solids (for pictures), its footprint and drive (for the world). Robot frame:
// base_link on the floor between the wheels, x forward, y left, z up, metres. Sources in robot_model.cpp.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

enum class SolidKind : std::uint8_t {
  box,       ///< min to max
  cylinder,  ///< upright, inscribed in min to max
  wheel,     ///< axis along y, inscribed in min to max
};

struct Solid {
  SolidKind kind = SolidKind::box;
  Eigen::Vector3d min = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();
  Color top_rgb{};
  Color side_rgb{};
  bool carries_picture = false;  ///< the robot's picture lies on its top
};

/// An axis-aligned rectangle on the floor, robot frame.
struct Rectangle {
  Eigen::Vector2d min;
  Eigen::Vector2d max;
};

struct RobotModel {
  std::vector<Solid> solids;         ///< highest top first
  std::vector<Rectangle> footprint;  ///< what collides, from above; of a round robot rectangles in its circle
  double round_radius_m = 0.0;       ///< of a round robot's outline about base_link; 0: not round
  Rectangle plate;                   ///< the top plate that carries the picture
  double plate_height_m = 0.0;       ///< of the plate's upper side above the floor
  Eigen::Vector2d lidar_m{0.0, 0.0};  ///< axis of the lidar tower, and its radius
  double lidar_radius_m = 0.0;        ///< 0: it has none

  double mass_kg = 0.0;
  double yaw_inertia_kgm2 = 0.0;  ///< about the centre of mass
  double centre_of_mass_x_m = 0.0;
  bool holonomic = false;       ///< on omni-wheels: it drives sideways as well
  double wheel_radius_m = 0.0;  ///< of the driven wheels
  double wheel_separation_m =
      0.0;                     ///< between the two; of omni-wheels the diameter of the ring they stand on
  double wheel_load = 0.0;     ///< share of the weight on the driven wheels; casters carry the rest
  double max_speed_mps = 0.0;  ///< forward and back
  double max_side_speed_mps = 0.0;  ///< to the left and right; 0 unless holonomic
  double max_yaw_rate_radps = 0.0;
  double max_acceleration_mps2 = 0.0;  ///< of the motors, both ways
  double max_yaw_acceleration_radps2 = 0.0;
  double rolling_friction = 0.0;  ///< coefficient of the tyres along their rolling direction
  double lateral_friction = 0.0;  ///< and across
};

const RobotModel& robot_model(RobotModelName name);

}  // namespace skylight::sim
