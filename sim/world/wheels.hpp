// A robot's driven wheels: how fast each turns under a motion of the body, and what its tyre can give.
//
// Differential: two wheels left and right of base_link; each tyre holds along and across within a friction
// circle (Coulomb). Holonomic: four omni-wheels on a ring at 45, 135, 225 and 315 degrees, each driving along
// the ring; their rollers let everything else pass.
#pragma once

#include <array>

#include <Eigen/Core>

#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {

/// A motion of base_link in the robot frame, or a change of it: m/s forward, m/s to the left, rad/s.
using BodyMotion = Eigen::Vector3d;

class Wheels {
 public:
  explicit Wheels(const RobotModel& model);

  int count() const { return count_; }
  /// Where wheel i stands, robot frame.
  const Eigen::Vector2d& place(int i) const { return places_[static_cast<std::size_t>(i)]; }
  /// Speeds of the wheels' treads under a motion without slip; 0 beyond count().
  Eigen::Vector4d speeds(const BodyMotion& motion) const;
  /// The motion that wheels of these speeds make without slip (least squares for four).
  BodyMotion motion(const Eigen::Vector4d& speeds) const;

  /// What the tyres must do to the body (N s on each, robot frame) to change its motion by `change`.
  std::array<Eigen::Vector2d, 4> impulses(const BodyMotion& change) const;
  /// The same cut to what tyre i can give: `load_ns` is its load times the step's length times the floor's
  /// factor.
  Eigen::Vector2d within_grip(const Eigen::Vector2d& impulse, double load_ns) const;

 private:
  const RobotModel* model_;
  int count_;
  std::array<Eigen::Vector2d, 4> places_;
  std::array<Eigen::Vector2d, 4> rolls_;  ///< the direction in which the wheel drives
};

}  // namespace skylight::sim
