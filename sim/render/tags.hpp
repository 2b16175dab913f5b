// AprilTags as they are printed.
#pragma once

#include <string>

#include <opencv2/core/mat.hpp>

#include "sim/scenario/robot.hpp"

namespace skylight::sim {

/// An upright tag, one pixel a cell (CV_8UC1, 0 or 255), with the white rim that its family asks for.
struct TagPattern {
  cv::Mat cells;
  int border_cells = 8;  ///< between the corners that a detector reports; TagSpec::size_m is their width
};

/// The tag's pattern, from libapriltag. Throws std::invalid_argument, naming `key` (of the tag) and what is
/// allowed, where there is no such family or its tags do not go up to this id.
TagPattern tag_pattern(const TagSpec& tag, const std::string& key);

}  // namespace skylight::sim
