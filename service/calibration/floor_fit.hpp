// Cameras and sheets by least squares: what calibrate_extrinsics() is made of.
#pragma once

#include <vector>

#include "service/calibration/extrinsics.hpp"

namespace skylight::calibration {

/// Where everything is, so far.
struct FloorState {
  std::vector<CameraModel> cameras;
  std::vector<FloorPlace> sheets;
  bool holds = true;  ///< false: the last step left a camera that is none
};

struct FloorFitOptions {
  std::vector<std::vector<bool>> used;  ///< by camera and point
  /// Points further off than so many standard deviations are taken less seriously (Cauchy); 0: least squares.
  double robust = 0.0;
  int most_steps = 100;
  double noise_scale = 1.0;  ///< on the standard deviations of the points (not on what is known beforehand)
};

/// The point in `map`.
Eigen::Vector3d in_map(const FloorPlace& place, const Eigen::Vector3d& at);

/// Improves the state. False where some point cannot be seen at all from where the camera is.
bool improve(const ExtrinsicsInput& input, const FloorFitOptions& options, FloorState& state);

/// Sum of squares of the used points' residuals over their variances (noise_scale counted), and how many
/// numbers more there are than unknowns.
struct Surplus {
  double chi_square = 0.0;
  int freedom = 0;
};
Surplus surplus(const ExtrinsicsInput& input, const FloorFitOptions& options, const FloorState& state);

/// Covariance of each camera's parameters. Empty where the points do not determine them.
std::vector<CameraUncertainty> uncertainties(const ExtrinsicsInput& input, const FloorFitOptions& options,
                                             const FloorState& state);

}  // namespace skylight::calibration
