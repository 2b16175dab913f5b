// OpenCV's dictionaries of markers by name.
#pragma once

#include <string>

#include <opencv2/aruco/dictionary.hpp>

namespace skylight::calibration {

/// Throws std::invalid_argument where there is none of the name (as in dictionary_names()).
cv::Ptr<cv::aruco::Dictionary> dictionary(const std::string& name);

}  // namespace skylight::calibration
