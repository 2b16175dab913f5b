#include "tracker/mounting.hpp"

#include <Eigen/Geometry>

namespace skylight {

Mounting::Mounting(const Appearance& appearance, const Pose2& picture) {
  const Eigen::Vector2d at = appearance.centre_m() - Eigen::Rotation2Dd(-picture.yaw) * picture.position();
  appearance_from_base_ = {at.x(), at.y(), wrap_angle(-picture.yaw)};
}

Pose2 Mounting::base_at(const Pose2& appearance) const {
  const Eigen::Vector2d at =
      appearance.position() + Eigen::Rotation2Dd(appearance.yaw) * appearance_from_base_.position();
  return {at.x(), at.y(), wrap_angle(appearance.yaw + appearance_from_base_.yaw)};
}

Pose2 Mounting::appearance_at(const Pose2& base) const {
  const double yaw = wrap_angle(base.yaw - appearance_from_base_.yaw);
  const Eigen::Vector2d at = base.position() - Eigen::Rotation2Dd(yaw) * appearance_from_base_.position();
  return {at.x(), at.y(), yaw};
}

Observation Mounting::of_base(Observation observation) const {
  const Eigen::Vector2d arm = Eigen::Rotation2Dd(observation.pose.yaw) * appearance_from_base_.position();
  Eigen::Matrix3d by = Eigen::Matrix3d::Identity();
  by(0, 2) = -arm.y();
  by(1, 2) = arm.x();
  observation.pose = base_at(observation.pose);
  observation.covariance = by * observation.covariance * by.transpose();
  return observation;
}

}  // namespace skylight
