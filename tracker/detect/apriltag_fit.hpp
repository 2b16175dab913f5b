// Where exactly does a tag lie that has been read? All of its pattern is known by then, so all of its cells'
// edges tell, not only the border's.
#pragma once

#include <optional>

#include "tracker/detect/apriltag.hpp"

namespace skylight {

struct TagFit {
  TagCorners corners_px{};
  Eigen::Matrix<double, 8, 8> covariance = Eigen::Matrix<double, 8, 8>::Identity();  ///< px^2
  double score = 0.0;  ///< correlation of picture and pattern
};

/// Moves the corners until the pattern, blurred as the camera blurs, agrees best with the picture: least
/// squares over the homography's eight unknowns and the light's gain and level, Gauss-Newton with Levenberg's
/// damping, robust weights. Picture: CV_8UC1; corners in its pixels. None where the pattern does not fit: the
/// fit ends elsewhere than it began, or too little of the tag lies in the picture.
std::optional<TagFit> fit_tag(const cv::Mat& grey, const TagPattern& pattern, const TagCorners& corners_px);

}  // namespace skylight
