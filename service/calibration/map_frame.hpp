// Whose map: a rigid motion on the floor that gives every camera new origin and axes.
#pragma once

#include "service/calibration/extrinsics.hpp"

namespace skylight::calibration {

/// The motion for a map whose origin and x axis lie at `frame` of the present one: old places become new
/// ones.
Eigen::Isometry3d new_from_old(const FloorPlace& frame);

/// The frame whose origin is the first place and whose x axis runs through the second, both on the floor.
/// Throws std::invalid_argument where they are closer than 1 cm.
FloorPlace frame_of(const Eigen::Vector2d& origin, const Eigen::Vector2d& on_x_axis);

/// The camera's uncertainty in the new map: turned with it. What a place chosen for the origin is itself
/// known to is not part of it: the map is where it was put.
CameraUncertainty turned(const CameraUncertainty& uncertainty, const Eigen::Isometry3d& new_from_old);

}  // namespace skylight::calibration
