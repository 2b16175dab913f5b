#include "tracker/filter/measurements.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

namespace skylight::motion {
namespace {

/// No detector is finer than this: 0.01 mm and 0.0006 degrees.
constexpr double kFinest = 1e-5;
/// Odometry's error of scale (wheel radius, track width, floor), which stays.
constexpr double kScaleError = 0.03;

bool positive(const Covariance3& m) {
  return m.allFinite() && m.diagonal().minCoeff() > 0.0 && m.diagonal().maxCoeff() < 1e6 &&
         Eigen::LLT<Covariance3>(0.5 * (m + m.transpose())).info() == Eigen::Success;
}

}  // namespace

bool usable(const Observation& o) {
  return std::isfinite(o.pose.x) && std::isfinite(o.pose.y) && std::isfinite(o.pose.yaw) &&
         std::abs(o.pose.x) < 1e6 && std::abs(o.pose.y) < 1e6 && positive(o.covariance);
}

bool usable(const BodyVelocity& v) {
  return std::isfinite(v.forward) && std::isfinite(v.sideways) && std::isfinite(v.yaw_rate) &&
         positive(v.covariance);
}

LinearMeasurement pose_measurement(const Observation& o) {
  LinearMeasurement out;
  out.first = kX;
  out.value = {o.pose.x, o.pose.y, wrap_angle(o.pose.yaw)};
  out.noise = 0.5 * (o.covariance + o.covariance.transpose());
  out.noise.diagonal().array() += kFinest * kFinest;
  out.yaw_period = 2.0 * std::numbers::pi / std::max(1, o.heading_turns);
  return out;
}

LinearMeasurement velocity_measurement(const BodyVelocity& v, double since_last) {
  LinearMeasurement out;
  out.first = kU;
  out.value = {v.forward, v.sideways, v.yaw_rate};
  out.noise = 0.5 * (v.covariance + v.covariance.transpose());
  const double speed = std::hypot(v.forward, v.sideways);
  const double scale = kScaleError * kScaleError;
  out.noise.diagonal() +=
      Eigen::Vector3d(scale * speed * speed, scale * speed * speed, scale * v.yaw_rate * v.yaw_rate + 1e-6);
  out.noise *= std::max(1.0, kOdometryMemory / std::max(since_last, 1e-3));
  return out;
}

}  // namespace skylight::motion
