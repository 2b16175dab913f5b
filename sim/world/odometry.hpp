// A robot's own idea of its way: dead reckoning from what its wheel encoders count.
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "sim/scenario/robot.hpp"
#include "sim/scenario/robot_model.hpp"
#include "sim/world/wheels.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// What a robot's own odometry says: dead reckoning from where it started, in its own frame and time.
struct OdometryReport {
  std::size_t robot = 0;  ///< index into Simulation::robots()
  Time at{};              ///< by the robot's own clock
  Pose2 pose;             ///< from (0, 0, 0) at the start
  double v_mps = 0.0;     ///< forward, since the last report
  double side_mps = 0.0;  ///< to the left (holonomic robots)
  double w_radps = 0.0;
};

/// Differential drive: with wheel travels dl and dr, ds = (dl + dr) / 2 and dyaw = (dr - dl) / separation;
/// the position advances by ds in the direction half-way through the turn (Siegwart, Nourbakhsh and
/// Scaramuzza, "Introduction to Autonomous Mobile Robots", 2nd edition, eq. 5.4-5.7). Holonomic: the
/// displacement in the body's frame from the four wheels' travels, turned likewise. Travels are whole encoder
/// ticks times what the robot takes for its wheel's circumference, so that rounding does not add up.
class Odometry {
 public:
  /// The errors of its wheels are drawn from the seed: normal, at most three standard deviations.
  Odometry(const OdometrySpec& spec, const RobotModel& model, std::uint64_t seed);

  /// The wheels' treads go at these speeds (World::wheel_speeds) for so long.
  void turn(const Eigen::Vector4d& speeds_mps, double dt_s);

  const Pose2& pose() const { return pose_; }
  /// Whether a report is due. `time` counts from the scenario's start.
  bool due(Duration time) const;
  /// The report of this moment; robot and start are the caller's: `at` counts from the scenario's start by
  /// the robot's clock. The next one is due a period later.
  OdometryReport report(Duration time);
  /// Nothing is reported at this moment: the next one is due a period later.
  void skip(Duration time);

  /// What the robot takes for its wheels' radii over their true ones, and for their distance over the true
  /// one.
  const Eigen::Vector4d& radius_factors() const { return radius_factors_; }
  double separation_factor() const { return separation_factor_; }

 private:
  BodyMotion moved(const Eigen::Vector4d& travels) const;

  OdometrySpec spec_;
  const RobotModel* model_;
  Wheels wheels_;
  Eigen::Vector4d radius_factors_ = Eigen::Vector4d::Ones();
  double separation_factor_ = 1.0;
  Eigen::Vector4d turned_m_ = Eigen::Vector4d::Zero();   ///< by the wheels' treads, truly
  Eigen::Vector4d counted_m_ = Eigen::Vector4d::Zero();  ///< as the robot has it from its ticks
  Pose2 pose_;
  std::int64_t reports_ = 0;
  Duration last_time_{};
  Eigen::Vector4d last_counted_m_ = Eigen::Vector4d::Zero();
};

}  // namespace skylight::sim
