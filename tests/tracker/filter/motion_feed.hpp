// Feeds a motion filter with what a detector sees of a route, and scores it.
#pragma once

#include <optional>

#include <Eigen/LU>

#include "tests/tracker/filter/route_truth.hpp"
#include "tracker/filter/motion.hpp"

namespace skylight::test {

inline Observation at_pose(double t, const Pose2& pose, double sigma_m = 1e-3, double sigma_rad = 3e-3) {
  Observation out;
  out.captured = instant(t);
  out.pose = {pose.x, pose.y, wrap_angle(pose.yaw)};
  out.covariance = Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
  return out;
}

/// For detectors that err without any slow part, as the simulated ones here.
inline MotionFilterConfig white() {
  MotionFilterConfig config;
  config.observation_bias_m = 0.0;
  config.observation_bias_rad = 0.0;
  return config;
}

/// Means over the frames that had an estimate.
struct Score {
  double place_m = 0.0;
  double heading_rad = 0.0;
  double nees = 0.0;
  double inside = 0.0;  ///< share inside the 95 % ellipse
  std::size_t frames = 0;

  void add(const Estimate& e, const Pose2& truth) {
    const double n = static_cast<double>(++frames);
    place_m += (place_error(e.pose, truth) - place_m) / n;
    heading_rad += (heading_error(e.pose, truth) - heading_rad) / n;
    nees += (test::nees(e, truth) - nees) / n;
    inside += ((nees_place(e, truth) < 5.991 ? 1.0 : 0.0) - inside) / n;
  }
};

}  // namespace skylight::test
