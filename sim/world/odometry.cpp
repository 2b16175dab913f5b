#include "sim/world/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "sim/world/chance.hpp"

namespace skylight::sim {

Odometry::Odometry(const OdometrySpec& spec, const RobotModel& model, std::uint64_t seed)
    : spec_(spec), model_(&model), wheels_(model) {
  Chance chance(seed, 0);
  const auto error = [&](double deviation) { return deviation * std::clamp(chance.normal(), -3.0, 3.0); };
  separation_factor_ += error(spec.separation_error);
  for (double& factor : radius_factors_) factor += error(spec.wheel_radius_error);
}

/// The robot's motion from its wheels' travels, by its own idea of it: m forward, m to the left, rad.
BodyMotion Odometry::moved(const Eigen::Vector4d& travels) const {
  BodyMotion motion = wheels_.motion(travels);
  motion.z() /= separation_factor_;
  return motion;
}

void Odometry::turn(const Eigen::Vector4d& speeds_mps, double dt_s) {
  turned_m_ += speeds_mps * dt_s;
  const double tick_m = 2.0 * std::numbers::pi * model_->wheel_radius_m / spec_.ticks_per_turn;
  const Eigen::Vector4d counted = (turned_m_ / tick_m).array().floor() * tick_m * radius_factors_.array();
  const BodyMotion step = moved(counted - counted_m_);
  counted_m_ = counted;
  const double yaw = moved(counted_m_).z();  // from the whole count: rounding does not add up
  const Eigen::Vector2d way = Eigen::Rotation2Dd(yaw - 0.5 * step.z()) * step.head<2>();
  pose_ = {pose_.x + way.x(), pose_.y + way.y(), wrap_angle(yaw)};
}

bool Odometry::due(Duration time) const {
  return time >= from_seconds(static_cast<double>(reports_) / spec_.rate_hz);
}

void Odometry::skip(Duration time) {
  while (due(time)) ++reports_;
  last_time_ = time;
  last_counted_m_ = counted_m_;
}

OdometryReport Odometry::report(Duration time) {
  OdometryReport report;
  report.at = Time{time + from_seconds(spec_.clock_offset_s)};
  report.pose = pose_;
  if (time > last_time_) {
    const BodyMotion speed = moved(counted_m_ - last_counted_m_) / to_seconds(time - last_time_);
    report.v_mps = speed.x();
    report.side_mps = speed.y();
    report.w_radps = speed.z();
  }
  skip(time);
  return report;
}

}  // namespace skylight::sim
