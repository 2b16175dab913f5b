#include "sim/scenario/scenario.hpp"

#include <numbers>

namespace skylight::sim {

Scenario::Scenario() = default;

CameraModel camera_model(const CameraSpec& camera) {
  CameraParameters parameters;
  parameters.width_px = camera.width_px;
  parameters.height_px = camera.height_px;
  parameters.lens = camera.lens;
  parameters.fx_px = camera.fx_px;
  parameters.fy_px = camera.fy_px;
  parameters.cx_px = camera.cx_px.value_or(0.5 * (camera.width_px - 1));
  parameters.cy_px = camera.cy_px.value_or(0.5 * (camera.height_px - 1));
  parameters.distortion = camera.distortion;
  parameters.map_from_camera = map_from_camera(camera);
  return CameraModel(parameters);
}

Eigen::Isometry3d map_from_camera(const CameraSpec& camera) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  const auto turn = [&](std::size_t i, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(camera.rpy_deg[i] * kRadians, axis);
  };
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(camera.position_m[0], camera.position_m[1], camera.position_m[2]);
  // Straight down: the image's right is map x, its downward side -y, the view -z.
  const Eigen::Matrix3d straight_down = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  pose.linear() = (turn(2, Eigen::Vector3d::UnitZ()) * turn(1, Eigen::Vector3d::UnitY()) *
                   turn(0, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix() *
                  straight_down;
  return pose;
}

}  // namespace skylight::sim
