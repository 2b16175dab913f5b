#include "tracker/heading.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace skylight {
namespace {

// The same picture read with the robot turned by `angle` about the picture's centre.
Pose2 turned(const Pose2& pose, const Eigen::Vector2d& centre_m, double angle) {
  const Eigen::Vector2d centre = pose.position() + Eigen::Rotation2Dd(pose.yaw) * centre_m;
  const double yaw = wrap_angle(pose.yaw + angle);
  const Eigen::Vector2d base = centre - Eigen::Rotation2Dd(yaw) * centre_m;
  return {base.x(), base.y(), yaw};
}

}  // namespace

void HeadingResolver::apply(Observation& observation, const std::optional<Pose2>& expected) {
  if (turns_ == 1) return;
  const double step = 2.0 * std::numbers::pi / turns_;
  const auto turn_towards = [&](double yaw) {
    const double k = std::round(wrap_angle(yaw - observation.pose.yaw) / step);
    if (k != 0.0) observation.pose = turned(observation.pose, centre_m_, k * step);
  };
  if (expected) turn_towards(expected->yaw);
  observation.heading_turns = settled_ ? 1 : turns_;
  if (settled_) return;
  const Eigen::Vector2d centre =
      observation.pose.position() + Eigen::Rotation2Dd(observation.pose.yaw) * centre_m_;
  if (!from_) from_ = centre;
  const Eigen::Vector2d way = centre - *from_;
  if (way.norm() < distance_m_) return;
  turn_towards(std::atan2(way.y(), way.x()));
  observation.heading_turns = 1;
  settled_ = true;
}

void HeadingResolver::forget() {
  from_.reset();
  settled_ = false;
}

}  // namespace skylight
