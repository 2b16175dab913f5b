// What most tests of depth begin with: a camera that looks down, and a floor that was learnt from its depth.
#pragma once

#include "tests/support/flat_scene.hpp"
#include "tests/tracker/depth_scene.hpp"
#include "tracker/depth/surface.hpp"

namespace skylight::test {

inline CameraModel camera_of(const DepthScene& scene, double tilt_rad = 0.0) {
  FlatScene flat{.width_px = scene.width_px,
                 .height_px = scene.height_px,
                 .focal_px = scene.focal_px,
                 .camera_height_m = scene.camera_height_m};
  const CameraModel straight = flat.camera();
  Eigen::Isometry3d pose = straight.map_from_camera();
  pose.linear() = Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitX()) * pose.linear();
  return {straight.intrinsics(), pose};
}

inline FloorDepth learnt(DepthScene scene, const CameraModel& camera, int frames = 5) {
  FloorDepth floor(camera, {});
  for (int i = 0; i < frames; ++i) {
    scene.seed = 100 + static_cast<std::uint32_t>(i);
    floor.learn(scene.render());
  }
  return floor;
}

inline Surface square(double side_m, double height_m) {
  return surface_of(Eigen::Vector2d::Constant(side_m), Eigen::Vector2d::Zero(), height_m);
}

// A Kinect's noise at 3 m (Nguyen et al.), and a lasting error of -5 cm that grows to the right.
inline DepthScene erring() {
  DepthScene scene;
  scene.noise_m = 0.0012 + 0.0019 * 2.6 * 2.6;
  scene.error = [](double z, double x, double y) {
    return 1.0 / (1.0 / z + 0.006 + 0.003 * x - 0.001 * y * y) - z;
  };
  return scene;
}

}  // namespace skylight::test
