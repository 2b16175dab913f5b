#include "service/calibration/map_frame.hpp"

#include <cmath>
#include <stdexcept>

namespace skylight::calibration {

Eigen::Isometry3d new_from_old(const FloorPlace& frame) {
  Eigen::Isometry3d old_from_new = Eigen::Isometry3d::Identity();
  old_from_new.translation() << frame.x_m, frame.y_m, 0.0;
  old_from_new.linear() = Eigen::AngleAxisd(frame.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return old_from_new.inverse();
}

FloorPlace frame_of(const Eigen::Vector2d& origin, const Eigen::Vector2d& on_x_axis) {
  const Eigen::Vector2d way = on_x_axis - origin;
  if (!(way.norm() >= 0.01))
    throw std::invalid_argument("the two points of the map's x axis must be at least 1 cm apart");
  return {origin.x(), origin.y(), std::atan2(way.y(), way.x())};
}

CameraUncertainty turned(const CameraUncertainty& uncertainty, const Eigen::Isometry3d& new_from_old) {
  Eigen::Matrix<double, kCameraParameters, kCameraParameters> turn =
      Eigen::Matrix<double, kCameraParameters, kCameraParameters>::Identity();
  turn.block<3, 3>(kCameraPosition, kCameraPosition) = new_from_old.linear();
  turn.block<3, 3>(kCameraRotation, kCameraRotation) = new_from_old.linear();
  const auto covariance = (turn * uncertainty.covariance * turn.transpose()).eval();
  return {0.5 * (covariance + covariance.transpose())};
}

}  // namespace skylight::calibration
