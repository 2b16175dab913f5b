// How detections err before any filter: where they lie on average, how they scatter, and how long an error
// lasts. White noise is what a filter averages away; what lasts for seconds it cannot tell from motion.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "service/reproduce/replay.hpp"

namespace skylight::service::reproduce {

/// Of one route. Errors as vectors from where the point truly is to where it was
/// detected.
struct DetectionErrors {
  std::string route;
  std::size_t frames = 0;
  std::size_t found = 0;
  double mean_m = 0.0;                                       ///< of the distances
  double p99_m = 0.0;                                        ///< of the distances
  Eigen::Vector2d bias_map_m = Eigen::Vector2d::Zero();      ///< mean error vector, in `map`
  Eigen::Vector2d bias_robot_m = Eigen::Vector2d::Zero();    ///< the same, forward and left of the robot
  Eigen::Vector2d bias_outward_m = Eigen::Vector2d::Zero();  ///< away from and (left) around the camera
  double mean_yaw_error = 0.0;                               ///< rad, absolute
  double std_m = 0.0;  ///< of each run's vectors about the run's mean, root of the sum over both axes
  /// Correlation of a frame's error vector with the next frame's, each run's mean removed; 0 where there is
  /// nothing to tell.
  double lag_1 = 0.0;
  /// Time after which that correlation has fallen to 1/e, s, linear between frames; none where it has not
  /// after half of the runs' frames.
  std::optional<double> e_folding_s;
};
/// Route by route, in the order in which they first come. Throws std::invalid_argument where a run has no
/// such variant.
std::vector<DetectionErrors> detection_errors(const Runs& runs, std::string_view variant);

}  // namespace skylight::service::reproduce
