// The camera near one place of a plane, as a quadratic: what a patch needs of it, at a few operations per
// sample instead of a lens model per sample.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "tracker/camera.hpp"

namespace skylight {

/// pixel = origin + J d + (dx^2 xx + dx dy xy + dy^2 yy) for the offset d in metres from the place, by
/// central differences over `reach_m`. What is left over is third order: below 0.02 px for a 0.3 m robot
/// under the lenses of tests/tracker.
struct LocalProjection {
  Eigen::Vector2d centre_m;  ///< the place, in `map`
  Eigen::Vector2d origin_px;
  Eigen::Matrix2d jacobian;    ///< px per metre
  Eigen::Vector2d xx, xy, yy;  ///< px per square metre

  /// None where the camera model does not hold around the place.
  static std::optional<LocalProjection> at(const CameraModel& camera, const Eigen::Vector2d& centre_m,
                                           double height_m, double reach_m);

  Eigen::Vector2d pixel(const Eigen::Vector2d& d) const {
    return origin_px + jacobian * d + d.x() * d.x() * xx + d.x() * d.y() * xy + d.y() * d.y() * yy;
  }
  double metres_per_px() const { return 1.0 / std::sqrt(std::abs(jacobian.determinant())); }
};

}  // namespace skylight
