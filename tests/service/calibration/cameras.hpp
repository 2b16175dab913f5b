// Cameras with known truth for the tests of the calibration, by the simulator's model; and the tracker's of
// the same parameters.
#pragma once

#include "sim/camera/camera_model.hpp"
#include "tests/support/board_scene.hpp"
#include "tracker/camera_uncertainty.hpp"

namespace skylight::test {

/// The camera of the paper's scenarios (sim/scenarios/paper): 1920 x 1080 px, 4 m above the room's middle.
inline sim::CameraParameters ceiling_camera() {
  return sim::camera_model(sim::CameraSpec{}).parameters();
}

/// A fisheye of the same size that sees 160 degrees across.
inline sim::CameraParameters fisheye_camera() {
  sim::CameraSpec spec;
  spec.lens = sim::Lens::kannala_brandt;
  spec.fx_px = spec.fy_px = 640.0;
  spec.distortion = {-0.02, 0.004, -0.001, 0.0002, 0.0};
  return sim::camera_model(spec).parameters();
}

/// A webcam: small pictures for quick tests.
inline sim::CameraParameters small_camera() {
  sim::CameraSpec spec;
  spec.width_px = 640;
  spec.height_px = 480;
  spec.fx_px = 520.0;
  spec.fy_px = 522.0;
  spec.cx_px = 325.0;
  spec.cy_px = 236.0;
  spec.distortion = {-0.21, 0.06, 0.0008, -0.0005, 0.0};
  return sim::camera_model(spec).parameters();
}

inline Intrinsics intrinsics_of(const sim::CameraParameters& p) {
  return {.width_px = p.width_px,
          .height_px = p.height_px,
          .fx_px = p.fx_px,
          .fy_px = p.fy_px,
          .cx_px = p.cx_px,
          .cy_px = p.cy_px,
          .lens = p.lens == sim::Lens::brown_conrady ? LensModel::brown_conrady : LensModel::kannala_brandt,
          .distortion = p.distortion};
}

/// Estimate less truth, in the order of camera_uncertainty.hpp.
inline Eigen::Matrix<double, kCameraPosition, 1> intrinsics_error(const Intrinsics& estimate,
                                                                  const Intrinsics& truth) {
  Eigen::Matrix<double, kCameraPosition, 1> error;
  error << estimate.fx_px - truth.fx_px, estimate.fy_px - truth.fy_px, estimate.cx_px - truth.cx_px,
      estimate.cy_px - truth.cy_px, 0, 0, 0, 0, 0;
  for (std::size_t i = 0; i < 5; ++i)
    error[kDistortion + static_cast<Eigen::Index>(i)] = estimate.distortion[i] - truth.distortion[i];
  return error;
}

/// e^T C^-1 e over the parameters whose variance is not 0.
template <class Error, class Covariance>
double nees(const Error& error, const Covariance& covariance) {
  std::vector<Eigen::Index> live;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (covariance(i, i) > 0.0) live.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(live.size());
  Eigen::VectorXd e(count);
  Eigen::MatrixXd c(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index a = live[static_cast<std::size_t>(i)];
    e[i] = error[a] / std::sqrt(covariance(a, a));
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Index b = live[static_cast<std::size_t>(j)];
      c(i, j) = covariance(a, b) / std::sqrt(covariance(a, a) * covariance(b, b));
    }
  }
  return e.dot(c.ldlt().solve(e));
}

}  // namespace skylight::test
