// What a robot is told, what it can do, and what whoever tells it knows.
#pragma once

#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tracker/types.hpp"

namespace skylight::sim {

/// What is asked of a drive: forward speed and speed to the left (m/s, the latter of holonomic robots only),
/// yaw rate (rad/s, counter-clockwise).
struct Command {
  double v_mps = 0.0;
  double side_mps = 0.0;
  double w_radps = 0.0;
  friend bool operator==(const Command&, const Command&) = default;
};

struct DriveLimits {
  double max_speed_mps = 0.26;
  double max_side_mps = 0.0;  ///< 0 unless holonomic
  double max_yaw_rate_radps = 1.82;
  double max_yaw_acceleration_radps2 = 3.2;
  double reach_m = 0.24;  ///< from base_link to the farthest corner of the robot's outline
};

/// Something on the floor to keep clear of.
struct Obstacle {
  std::size_t actor = 0;
  std::vector<Eigen::Vector2d> outline;                ///< convex, in map, counter-clockwise
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();    ///< of a circle around the outline, in map
  double radius_m = 0.0;                               ///< of that circle
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< m/s, in map
};

/// Everything on the floor, the robots included.
struct Surroundings {
  std::array<double, 2> room_m{6.0, 6.0};
  std::vector<Obstacle> obstacles;
};

/// What a program looks at each time that it is asked for a command.
struct ProgramContext {
  double time_s = 0.0;   ///< the program's: it stands still while somebody else has the robot
  Pose2 pose;            ///< of the robot, true
  std::size_t self = 0;  ///< the robot's own place among the actors
  const Surroundings* surroundings = nullptr;    ///< absent: there is nothing to avoid
  const std::set<std::string>* fired = nullptr;  ///< events that have happened; absent: none
};

}  // namespace skylight::sim
