// Regions of the floor that are never searched: shelves, a poster of the robot, the next room.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core/types.hpp>

#include "tracker/camera.hpp"

namespace skylight {

struct FloorMask {
  static constexpr std::size_t kMostCorners = 100;

  std::string name;
  /// A polygon in `map`, m, either way round, 3 to 100 corners within 10 km, whose sides do not meet but at
  /// the corners.
  std::vector<Eigen::Vector2d> corners;
};

/// Empty, or what is wrong, naming the corner (`corners[2]: ...`).
std::string check(const FloorMask& mask);

/// Whether a place lies within the polygon (even-odd rule: a ray from it crosses an odd number of sides).
bool covers(const FloorMask& mask, const Eigen::Vector2d& place);
bool any_covers(const std::vector<FloorMask>& masks, const Eigen::Vector2d& place);

/// Whether all that a part of a picture shows of the plane height_m above the floor lies within one of the
/// masks. Its edge is looked at every few pixels: a polygon has no holes, so what has its edge inside is
/// inside.
bool any_covers(const std::vector<FloorMask>& masks, const CameraModel& camera, const cv::Rect& part,
                double height_m);

}  // namespace skylight
