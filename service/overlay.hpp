// A frame with what the tracker made of it drawn in.
#pragma once

#include <opencv2/core/mat.hpp>

#include "service/snapshot.hpp"

namespace skylight::service {

/// Outline of each robot's picture where it was measured or (dashed by colour) filtered, an arrow along its
/// heading, its name and state. `image` is not changed; the result has `width_px` columns (0: as it is).
cv::Mat draw_overlay(const Snapshot& snapshot, const CameraSnapshot& camera, int width_px);

}  // namespace skylight::service
