// Lens and board poses by least squares: what calibrate_intrinsics() is made of.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "service/calibration/intrinsics.hpp"

namespace skylight::calibration {

/// One view's board pose, or none where no pose was found.
struct LensFit {
  Intrinsics intrinsics;
  std::vector<Eigen::Isometry3d> camera_from_board;  ///< one for each view
  double cost = 0.0;                                 ///< 1/2 sum of squares, px^2, as weighted
};

/// Which corners count, and how.
struct FitOptions {
  std::vector<std::vector<bool>> used;  ///< by view and corner
  /// Residuals beyond are taken less seriously (Cauchy's loss), px; 0: least squares.
  double robust_px = 0.0;
  /// Distortion coefficients that are held at 0, counted from the last of the model's order of importance
  /// (k3, k2 of brown_conrady).
  bool hold_k3 = false;
  bool hold_k2 = false;
};

/// A first fit from nothing: the best of several focal lengths. None where no pinhole or fisheye fits at all.
std::optional<LensFit> first_fit(const std::vector<BoardView>& views, const IntrinsicsOptions& options,
                                 LensModel lens, const FitOptions& fit);

/// Improves a fit. False where the model does not hold.
bool improve(const std::vector<BoardView>& views, const FitOptions& options, LensFit& fit);

/// Reprojection errors by view and corner, px; infinite where the model does not hold.
std::vector<std::vector<double>> reprojection_errors(const std::vector<BoardView>& views, const LensFit& fit);

/// Covariance of the intrinsics for corners whose coordinates err by 1 px each; none where the views do not
/// determine them.
std::optional<IntrinsicsCovariance> unit_covariance(const std::vector<BoardView>& views,
                                                    const FitOptions& options, const LensFit& fit);

}  // namespace skylight::calibration
