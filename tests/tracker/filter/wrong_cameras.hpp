// Cameras that are wrong by what their calibration left unknown.
#pragma once

#include <Eigen/Cholesky>

#include "tests/tracker/filter/motion_feed.hpp"

namespace skylight::test {

inline constexpr Detector kTenthOfAMillimetre{.sigma_m = 1e-4, .sigma_rad = 4e-4};

/// Of one camera: 2 mm and 0.1 degrees per axis, x and yaw together.
inline Covariance3 calibration(double scale = 1.0) {
  Covariance3 out = Eigen::Vector3d(4e-6, 4e-6, 3e-6).asDiagonal();
  out(0, 2) = out(2, 0) = 1.5e-6;
  return scale * scale * out;
}

/// A camera with the error that its calibration left.
struct WrongCamera {
  std::size_t index = 0;
  Covariance3 correlated = Covariance3::Zero();
  Eigen::Vector3d error = Eigen::Vector3d::Zero();

  void draw(Random& random) {
    const Eigen::Vector3d normal(random.normal(), random.normal(), random.normal());
    error = Eigen::LLT<Covariance3>(correlated).matrixL() * normal;
  }
  std::optional<Observation> see(const Pose2& truth, double t, Random& random) const {
    auto out = detect(kTenthOfAMillimetre, truth, t, random);
    if (!out) return out;
    out->pose.x += error.x();
    out->pose.y += error.y();
    out->pose.yaw = wrap_angle(out->pose.yaw + error.z());
    out->camera = index;
    out->correlated = correlated;
    return out;
  }
};

}  // namespace skylight::test
