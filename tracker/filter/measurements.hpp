// What is observed and what a robot says of itself, as measurements of the motion filter's state.
#pragma once

#include "tracker/filter/imm.hpp"
#include "tracker/types.hpp"

namespace skylight {

/// What a robot says of its own motion: wheel odometry, or the velocity it was commanded to have.
struct BodyVelocity {
  Time at{};
  double forward = 0.0;   ///< m/s
  double sideways = 0.0;  ///< m/s, to the left
  double yaw_rate = 0.0;  ///< rad/s
  /// Of (forward, sideways, yaw rate). Scale errors and readings that err together are allowed for beyond it.
  Covariance3 covariance = Eigen::Vector3d(4e-4, 4e-4, 2.5e-3).asDiagonal();
};

namespace motion {

/// Readings of odometry closer together than this share their errors, s.
inline constexpr double kOdometryMemory = 0.25;

/// Finite, within 1000 km, and with a positive definite covariance.
bool usable(const Observation& observation);
bool usable(const BodyVelocity& velocity);

/// Yaw modulo the turns under which the robot looks the same.
LinearMeasurement pose_measurement(const Observation& observation);

/// `since_last`: s since the reading before.
LinearMeasurement velocity_measurement(const BodyVelocity& velocity, double since_last);

}  // namespace motion
}  // namespace skylight
