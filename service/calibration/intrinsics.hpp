// The lens and sensor of a camera from pictures of a board in many poses.
//
// Zhang, "A flexible new technique for camera calibration", PAMI 22 (2000): least squares on the reprojection
// error over the lens and the board's pose in each picture, all together. Covariance: the inverse Hessian at
// the solution times the residuals' variance (Hartley and Zisserman, "Multiple View Geometry", result 5.10),
// so that corners found badly make a calibration that says so.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "service/calibration/coverage.hpp"
#include "tracker/camera_uncertainty.hpp"

namespace skylight::calibration {

/// A board as one picture shows it.
struct BoardView {
  std::string name;                     ///< of the picture, for people
  std::vector<Eigen::Vector3d> points;  ///< in the board's frame, z = 0, m
  std::vector<Pixel> pixels;            ///< where they are seen, as many
};

/// What became of a view.
struct ViewResult {
  std::string name;
  bool used = true;
  std::string why_not;  ///< of a view that is not used
  double rms_px = 0.0;  ///< reprojection error, distance; also of a dropped view where it was computed
  int points = 0;
  int points_left_out = 0;  ///< corners far off the others of a view that is used
  double tilt_rad = 0.0;    ///< of the board against the picture's plane
};

using IntrinsicsCovariance = Eigen::Matrix<double, kCameraPosition, kCameraPosition>;

struct IntrinsicsOptions {
  int width_px = 0;
  int height_px = 0;
  std::optional<LensModel> lens{};  ///< absent: the data decide
};

struct IntrinsicsResult {
  Intrinsics intrinsics;
  /// Of fx fy cx cy and the distortion, in the order of camera_uncertainty.hpp; zero where a coefficient is
  /// not part of the model.
  IntrinsicsCovariance covariance = IntrinsicsCovariance::Zero();
  double rms_px = 0.0;  ///< of all corners used, distance
  std::vector<ViewResult> views;
  Coverage coverage;
  std::string lens_reason;            ///< why this model, in words; empty where it was asked for
  std::vector<std::string> warnings;  ///< what to distrust, and which views are still missing
};

/// Throws std::invalid_argument where the views make no calibration, saying why: fewer than three, none
/// tilted, points that contradict each other.
IntrinsicsResult calibrate_intrinsics(const std::vector<BoardView>& views, const IntrinsicsOptions& options);

}  // namespace skylight::calibration
