// The rays of a camera's pixels, and how a pixel's area and an exposure are sampled.
#pragma once

#include <array>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sim/camera/camera_model.hpp"

namespace skylight::sim {

inline constexpr std::size_t kSamples = 16;

/// Sample i lies at column (i + 0.5) / 16, row (kRow[i] + 0.5) / 16 of the pixel, at share (kTime[i] + 0.5) /
/// 16 of the exposure: each sixteenth of each of the three is used once, the three are uncorrelated, and the
/// set is its own mirror image through the middle, so that its odd moments vanish and nothing is shifted.
inline constexpr std::array<int, kSamples> kRow{2, 9, 15, 4, 12, 8, 1, 5, 10, 14, 7, 3, 11, 0, 6, 13};
inline constexpr std::array<int, kSamples> kTime{7, 3, 14, 4, 9, 5, 15, 13, 2, 0, 10, 6, 11, 1, 12, 8};
constexpr double sixteenth(int i) {
  return (i + 0.5) / static_cast<double>(kSamples);
}

/// Directions in `map` through one pixel, those off its centre from its neighbours'.
struct PixelRays {
  Eigen::Vector3d centre, along_x, along_y;  ///< direction, and its change over a pixel

  Eigen::Vector3d sample(std::size_t i) const {
    return centre + along_x * (sixteenth(static_cast<int>(i)) - 0.5) + along_y * (sixteenth(kRow[i]) - 0.5);
  }
  /// False beyond the lens's range: nothing is seen there.
  bool valid() const { return along_x.allFinite() && along_y.allFinite() && centre.allFinite(); }
};

/// The directions of all pixels of a camera, worked out once: in the optical frame z = 1 (or, of a fisheye,
/// unit length); not a number where the lens sees nothing.
class RayField {
 public:
  explicit RayField(const CameraModel& camera);
  PixelRays pixel(int x, int y) const {
    return {at(x, y), 0.5 * (at(x + 1, y) - at(x - 1, y)), 0.5 * (at(x, y + 1) - at(x, y - 1))};
  }
  /// Component 0 to 2 of the directions of a row, -1 to height, from pixel 0 on; pixels -1 to width + 8 can
  /// be read.
  const float* row(std::size_t component, int y) const { return planes_[component].ptr<float>(y + 1) + 1; }

 private:
  Eigen::Vector3d at(int x, int y) const {
    return {static_cast<double>(row(0, y)[x]), static_cast<double>(row(1, y)[x]),
            static_cast<double>(row(2, y)[x])};
  }
  std::array<cv::Mat, 3> planes_;  ///< CV_32FC1, one pixel more to each side, nine to the right
};

}  // namespace skylight::sim
