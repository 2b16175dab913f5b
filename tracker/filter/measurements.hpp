// What is observed and what a robot says of itself, as measurements of the motion filter's state.
#pragma once

#include "tracker/filter/imm.hpp"
#include "tracker/types.hpp"

namespace skylight {

namespace motion {

/// Readings of odometry closer together than this share their errors, s.
inline constexpr double kOdometryMemory = 0.25;

/// Finite, within 1000 km, with a positive definite covariance and no negative variance of what is
/// correlated.
bool usable(const Observation& observation);
bool usable(const BodyVelocity& velocity);

/// Variances of place and of yaw over what the detector claims, >= 1.
struct NoiseScale {
  double place = 1.0;
  double yaw = 1.0;
};

/// Judges whether a detector claims too much, from the observations alone: of three that follow each other,
/// how far the middle one lies from the line between its neighbours, over what the claims allow for that. A
/// robot that changes its speed does so too, but seldom in most of the frames: so the median counts, not the
/// mean, followed in small steps (the sign algorithm of stochastic approximation; H. Robbins, S. Monro, Ann.
/// Math. Stat. 22(3), 1951). Never below 1: errors that stay from frame to frame do not show here.
class NoiseJudge {
 public:
  void see(const Observation& observation);
  /// `most`: largest factor of a standard deviation.
  NoiseScale scale(double most) const;

 private:
  struct Seen {
    Time at{};
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  };
  Seen before_, last_;
  int seen_ = 0;
  int judged_ = 0;
  double log_place_ = 0.0;  ///< of the median's ratio to the one expected
  double log_yaw_ = 0.0;
};

/// Yaw modulo the turns under which the robot looks the same.
LinearMeasurement pose_measurement(const Observation& observation, const NoiseScale& scale);

/// `since_last`: s since the reading before.
LinearMeasurement velocity_measurement(const BodyVelocity& velocity, double since_last);

}  // namespace motion
}  // namespace skylight
