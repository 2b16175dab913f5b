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

/// What a robot that goes steadily bends its path by: on a circle at 0.3 m/s and 1 rad/s, and a slow change
/// of turning.
constexpr double kUsualBend = 0.3;       // m/s^2
constexpr double kUsualYawBend = 0.3;    // rad/s^2
constexpr double kLongestPause = 0.5;    // s; observations further apart say nothing of each other
constexpr double kMedianOfPair = 0.693;  // of the mean of two squared standard normals
constexpr double kMedianOfOne = 0.455;   // of one
constexpr double kStep = 0.03;
/// The median that is followed wavers by about this much when the claims are right.
constexpr double kDeadBand = 1.25;

bool positive(const Covariance3& m) {
  return m.allFinite() && m.diagonal().minCoeff() > 0.0 && m.diagonal().maxCoeff() < 1e6 &&
         Eigen::LLT<Covariance3>(0.5 * (m + m.transpose())).info() == Eigen::Success;
}

}  // namespace

bool usable(const Observation& o) {
  return std::isfinite(o.pose.x) && std::isfinite(o.pose.y) && std::isfinite(o.pose.yaw) &&
         std::abs(o.pose.x) < 1e6 && std::abs(o.pose.y) < 1e6 && positive(o.covariance) &&
         o.correlated.allFinite() && o.correlated.diagonal().minCoeff() >= 0.0;
}

bool usable(const BodyVelocity& v) {
  return std::isfinite(v.forward) && std::isfinite(v.sideways) && std::isfinite(v.yaw_rate) &&
         positive(v.covariance);
}

void NoiseJudge::see(const Observation& o) {
  const Seen now{
      .at = o.captured, .value = {o.pose.x, o.pose.y, o.pose.yaw}, .variance = o.covariance.diagonal()};
  if (seen_ > 0 && (now.at <= last_.at || to_seconds(now.at - last_.at) > kLongestPause)) seen_ = 0;
  if (seen_ >= 2) {
    const double first = to_seconds(last_.at - before_.at);
    const double second = to_seconds(now.at - last_.at);
    const double share = first / (first + second);
    const double period = 2.0 * std::numbers::pi / std::max(1, o.heading_turns);
    Eigen::Vector3d up = now.value - last_.value;
    Eigen::Vector3d down = before_.value - last_.value;
    up[2] = std::remainder(up[2], period);
    down[2] = std::remainder(down[2], period);
    const Eigen::Vector3d off = share * up + (1.0 - share) * down;
    const double bend = 0.5 * first * second;
    Eigen::Vector3d allowed =
        last_.variance + share * share * now.variance + (1.0 - share) * (1.0 - share) * before_.variance;
    allowed += bend * bend *
               Eigen::Vector3d(0.5 * kUsualBend * kUsualBend, 0.5 * kUsualBend * kUsualBend,
                               kUsualYawBend * kUsualYawBend);
    const Eigen::Vector3d ratio = off.cwiseAbs2().cwiseQuotient(allowed);
    const double step = std::max(kStep, std::min(0.3, 1.0 / ++judged_));
    const auto follow = [step](double& log_median, double value) {
      log_median += std::log(value + 1e-12) > log_median ? step : -step;
      log_median = std::clamp(log_median, -1.0, 10.0);
    };
    follow(log_place_, 0.5 * (ratio[0] + ratio[1]) / kMedianOfPair);
    follow(log_yaw_, ratio[2] / kMedianOfOne);
  }
  before_ = last_;
  last_ = now;
  ++seen_;
}

NoiseScale NoiseJudge::scale(double most) const {
  return {.place = std::clamp(std::exp(log_place_) / kDeadBand, 1.0, most * most),
          .yaw = std::clamp(std::exp(log_yaw_) / kDeadBand, 1.0, most * most)};
}

LinearMeasurement pose_measurement(const Observation& o, const NoiseScale& scale) {
  LinearMeasurement out;
  out.first = kX;
  out.value = {o.pose.x, o.pose.y, wrap_angle(o.pose.yaw)};
  out.noise = 0.5 * (o.covariance + o.covariance.transpose());
  const double place = std::sqrt(scale.place);
  const Eigen::DiagonalMatrix<double, 3> factor(place, place, std::sqrt(scale.yaw));
  out.noise = (factor * out.noise * factor).eval();
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
