// A run of a robot taken apart: what it did when, and how far its wheels say that it went. For robot.cpp.
#pragma once

#include "service/calibration/robot.hpp"

namespace skylight::calibration {

/// Where a picture lies at the height `height_m` that seems to be at `seen` at the height `assumed_m`.
Pose2 carried(const Pose2& seen, const Eigen::Vector3d& camera, double assumed_m, double height_m);

/// base_link's place, from the place of what is mounted on it.
Eigen::Vector2d base_of(const Pose2& picture, const Eigen::Vector2d& mounting_in_picture_axes);

/// Standing, turning on the spot and driving, per camera, by what the assumed geometry makes of the looks
/// (which may be off by decimetres); `left_out` counts the others. Where a robot turns, it turns on the spot
/// if base_link goes round a point nearer than 0.2 m, and drives if that is further away than 0.35 m.
std::vector<Stretch> stretches_of(const RobotRun& run, std::vector<LeftOut>& left_out);

/// How far the wheels say that the robot went.
class OdometryPath {
 public:
  /// Finds how the odometry's clock stands against the cameras' (within 2 s) by the turns that both saw. With
  /// no odometry, or where the two do not go together, there is no path, and problem() says why.
  explicit OdometryPath(const RobotRun& run);

  const std::string& problem() const { return problem_; }
  double clock_offset_s() const { return offset_s_; }  ///< robot's clock less the cameras'

  /// Forward and to the left between two instants of the cameras' clock, metres; none outside of the
  /// odometry.
  std::optional<Eigen::Vector2d> between(Time from, Time to) const;

 private:
  std::optional<Eigen::Vector3d> at(double time_s) const;
  double misfit(const std::vector<Eigen::Vector2d>& yaws, double offset_s) const;

  Time origin_{};
  std::vector<double> times_s_;
  std::vector<Eigen::Vector3d> sums_;  ///< forward, left, turned
  double offset_s_ = 0.0;
  std::string problem_;
};

}  // namespace skylight::calibration
