// Where a robot that is not seen may be: under what covers it, or gone.
#pragma once

#include "tracker/depth/surface.hpp"

namespace skylight {

/// What depth shows of the places where it may be, as shares of their probability. The rest is neither: no
/// readings, out of the picture, or something of its own height.
struct Whereabouts {
  double covered = 0.0;
  double empty = 0.0;  ///< the floor is seen there
};

/// `pose`: where base_link is thought to be, `covariance` of its x and y, m^2; out to three standard
/// deviations. The cost is that of 25 looks.
Whereabouts whereabouts(const FloorDepth& floor, const cv::Mat& depth, const Surface& surface,
                        const Pose2& pose, const Eigen::Matrix2d& covariance);

/// It is likelier to be covered than at any other place where it can be: those that are empty are none.
bool covered(const Whereabouts& whereabouts);
/// The floor is seen wherever it might be.
bool gone(const Whereabouts& whereabouts);

}  // namespace skylight
