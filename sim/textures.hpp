// Pictures in the scene: a mip pyramid that is sampled without shifting anything, the procedural floors and
// the procedural robot pictures. All of them follow from their seeds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sim/scenario.hpp"

namespace skylight::sim {

/// Blue, green, red; 0 to 255.
using Bgr = Eigen::Vector3f;

/// RGB as written in scenarios, to BGR.
Bgr bgr(const Color& rgb);

class Texture {
 public:
  Texture() = default;
  /// CV_8UC3. Beyond its edges the picture repeats (wrap) or goes on as its last pixels.
  Texture(const cv::Mat& image, bool wrap);

  bool empty() const { return levels_.empty(); }
  int width_px() const { return levels_.front().cols; }
  int height_px() const { return levels_.front().rows; }

  /// The level whose texels are just not larger than `footprint_px` texels of the full picture.
  int level_for(double footprint_px) const;
  /// Bilinear, at a place in pixels of the full picture (pixel centres at whole numbers).
  Bgr sample(int level, float column, float row) const;

 private:
  std::vector<cv::Mat> levels_;  ///< each about half of the one before, by area means
  bool wrap_ = false;
};

/// A floor from above: +x of `map` to the right, +y up, the room's middle in the picture's middle (or, for
/// pictures from a file, repeated from there).
struct FloorTexture {
  Texture texture;
  double metres_per_px = 0.002;
};
FloorTexture make_floor(const RoomSpec& room, std::uint64_t seed, const std::filesystem::path& folder);

/// A square picture (CV_8UC3) with many corners and no symmetry, different for each seed.
cv::Mat draw_robot_picture(std::uint64_t seed, int size_px);

/// Reads a picture as CV_8UC3 or CV_8UC4. Throws std::invalid_argument naming `key` where there is none, or
/// it is no picture, or larger than 8192 x 8192.
cv::Mat load_picture(const std::filesystem::path& folder, const std::string& file, const std::string& key);

}  // namespace skylight::sim
