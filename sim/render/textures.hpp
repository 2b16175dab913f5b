// Pictures in the scene: a mip pyramid that is sampled without shifting anything, the procedural floors and
// the procedural robot pictures. All of them follow from their seeds.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sim/scenario/scenario.hpp"

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
  int width_px() const { return levels_.front().image.cols; }
  int height_px() const { return levels_.front().image.rows; }

  /// The level whose texels are just not larger than `footprint_px` texels of the full picture.
  int level_for(double footprint_px) const;
  /// Bilinear, at a place in pixels of the full picture (pixel centres at whole numbers).
  Bgr sample(int level, float column, float row) const;

 private:
  struct Level {
    cv::Mat image;
    float columns_per_full, rows_per_full;  ///< size over that of the full picture
  };
  int place(int index, int count) const {
    if (index >= 0 && index < count) return index;
    if (!wrap_) return index < 0 ? 0 : count - 1;
    const int rest = index % count;
    return rest < 0 ? rest + count : rest;
  }

  std::vector<Level> levels_;  ///< each about half of the one before, by area means
  bool wrap_ = false;
};

// Here, so that the loops over samples can take it in.
inline Bgr Texture::sample(int level, float column, float row) const {
  // Pixels are areas: the outlines of all levels coincide, so that no level shifts the picture.
  const Level& at = levels_[static_cast<std::size_t>(level)];
  const float u = (column + 0.5F) * at.columns_per_full - 0.5F;
  const float v = (row + 0.5F) * at.rows_per_full - 0.5F;
  const float u0 = std::floor(u);
  const float v0 = std::floor(v);
  const int left = place(static_cast<int>(u0), at.image.cols) * 3;
  const int right = place(static_cast<int>(u0) + 1, at.image.cols) * 3;
  const auto* upper = at.image.ptr<std::uint8_t>(place(static_cast<int>(v0), at.image.rows));
  const auto* lower = at.image.ptr<std::uint8_t>(place(static_cast<int>(v0) + 1, at.image.rows));
  const float a = u - u0;
  const float b = v - v0;
  Bgr result;
  for (int c = 0; c < 3; ++c) {
    const float top =
        static_cast<float>(upper[left + c]) * (1.0F - a) + static_cast<float>(upper[right + c]) * a;
    const float bottom =
        static_cast<float>(lower[left + c]) * (1.0F - a) + static_cast<float>(lower[right + c]) * a;
    result[c] = top * (1.0F - b) + bottom * b;
  }
  return result;
}

/// A square sheet of paper on the floor.
struct FloorPrint {
  Texture texture;
  Eigen::Vector2d at{0.0, 0.0};     ///< its middle, m
  Eigen::Vector2d right{1.0, 0.0};  ///< of the upright print, in `map`
  double edge_m = 1.0;

  bool covers(const Eigen::Vector2d& place) const {
    const Eigen::Vector2d from = place - at;
    return std::max(std::abs(along(from)), std::abs(up(from))) <= 0.5 * edge_m;
  }
  /// Of a place that it covers; `apart_m` as far apart as the places are that are looked at.
  Bgr sample(const Eigen::Vector2d& place, double apart_m) const {
    const double texels_per_m = texture.width_px() / edge_m;
    const double middle = 0.5 * (texture.width_px() - 1);
    const Eigen::Vector2d from = place - at;
    return texture.sample(texture.level_for(apart_m * texels_per_m),
                          static_cast<float>(middle + along(from) * texels_per_m),
                          static_cast<float>(middle - up(from) * texels_per_m));
  }

 private:
  double along(const Eigen::Vector2d& from) const { return right.dot(from); }
  double up(const Eigen::Vector2d& from) const { return right.x() * from.y() - right.y() * from.x(); }
};

/// A floor from above (floors.cpp): +x of `map` to the right, +y up, the room's middle in the picture's
/// middle (or, for pictures from a file, repeated from there).
struct FloorTexture {
  Texture texture;
  double metres_per_px = 0.002;
  std::vector<FloorPrint> prints = {};  ///< the later lie over the earlier
};
/// Floors are drawn at 2 mm a pixel, coarser in rooms beyond 8 m. Throws as load_picture() for
/// room.floor.picture, and as tag_pattern() for
/// room.floor.tags.
FloorTexture make_floor(const RoomSpec& room, std::uint64_t seed, const std::filesystem::path& folder);

/// A square picture (CV_8UC3) with many corners and no symmetry, different for each seed.
cv::Mat draw_robot_picture(std::uint64_t seed, int size_px);

/// Reads a picture as CV_8UC3 or CV_8UC4. Throws std::invalid_argument naming `key` where there is none, or
/// it is no picture, or larger than 8192 x 8192.
cv::Mat load_picture(const std::filesystem::path& folder, const std::string& file, const std::string& key);

}  // namespace skylight::sim
