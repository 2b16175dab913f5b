// Things of a robot's height and size: where a search looks first.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/types.hpp>

#include "tracker/depth/floor_depth.hpp"

namespace skylight {

struct Blob {
  cv::Rect part_px;         ///< of the frame, half a robot larger than the blob on every side
  Eigen::Vector2d place_m;  ///< its middle on the surface's plane, in `map`
  double area_m2 = 0.0;     ///< on that plane
};

/// CV_32FC1, one height per cell, metres; NaN where there is none.
cv::Mat height_map(const FloorDepth& floor, const cv::Mat& depth);

struct BlobQuery {
  double height_m = 0.0;  ///< of the surface above the floor
  Eigen::Vector2d size_m{0.0, 0.0};
  double largest = 4.0;  ///< largest area of a blob, in the surface's
};

/// Connected parts of the map that are level with the surface (DepthConfig: tolerance_m, sigmas) and have 0.4
/// to `largest` times its area: it may be seen in part, and robots may touch. From the top of the picture
/// down. None where such a surface is not told from the floor.
std::vector<Blob> find_blobs(const FloorDepth& floor, const cv::Mat& heights, const BlobQuery& query);

}  // namespace skylight
