// Tags on the floor: their corners in a picture, to a small part of a pixel. By OpenCV's detector, so that
// the tracker's own is not calibrated by itself.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "tracker/camera.hpp"

namespace skylight::calibration {

/// Corners of the black border's outer edge: top left, top right, bottom right, bottom left of the upright
/// tag.
struct TagSighting {
  int id = 0;
  std::array<Pixel, 4> corners;
};

/// The same corners in the tag's frame (origin in its middle, x right, y up) of a tag `size_m` wide.
std::array<Eigen::Vector2d, 4> tag_points(double size_m);

/// The dictionary of a family of tags: 36h11, 25h9, 16h5, or any of dictionary_names(). Throws
/// std::invalid_argument, naming what there is.
std::string tag_dictionary(const std::string& family);

/// Tags of a dictionary in a picture (CV_8UC1 or CV_8UC3). Each edge is a line fitted to where the picture
/// turns from dark to light, straight as the lens (`camera`, whose pose does not matter) says; corners are
/// where they cross.
std::vector<TagSighting> find_tags(const cv::Mat& image, const std::string& dictionary,
                                   const CameraModel& camera);

}  // namespace skylight::calibration
