// An RGB-D recording as the TUM RGB-D benchmark lays it out: rgb.txt and depth.txt, each line a time and a
// file (J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, and its web page
// on file formats: "timestamp filename", lines of comment begin with #; depth pictures are 16 bits, 5000 to
// the metre).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "tracker/types.hpp"

namespace skylight::service {

struct TumFrame {
  std::string image{};  ///< relative to the folder
  std::string depth{};  ///< empty where none is near enough in time
  Time captured{};      ///< of the image
};

/// Depth goes with the image that is nearest in time, within this (the benchmark's own associate.py); each at
/// most once, the closest pairs first.
inline constexpr Duration kTumTolerance = std::chrono::milliseconds(20);

bool is_tum_folder(const std::filesystem::path& folder);

/// In the order of their times. Throws SourceError naming file and line: malformed, a path that leads out of
/// the folder, no pictures, a time that comes twice. Without depth.txt there is no depth.
std::vector<TumFrame> read_tum_folder(const std::filesystem::path& folder);

/// 5000 to the metre as millimetres, rounded; 0 stays no reading. Throws SourceError where it is not 16 bits.
cv::Mat millimetres_from_tum(const cv::Mat& depth, const std::string& name);

}  // namespace skylight::service
