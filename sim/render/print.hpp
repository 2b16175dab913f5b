// A picture prepared for being looked at in every frame: texels of four bytes, a pyramid, no edges to mind.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace skylight::sim {

class Print {
 public:
  struct Level {
    int columns = 0;  ///< that can be asked for: 0 to columns - 1, and likewise rows; one more is stored
    int rows = 0;
    int stride = 0;                       ///< texels
    std::vector<std::uint32_t> texels{};  ///< blue in the lowest byte, green, red, nothing
    float columns_per_full = 1.0F;        ///< size over that of the full picture
    float rows_per_full = 1.0F;
  };

  Print() = default;
  /// CV_8UC3. Beyond its edges it goes on as its last texels.
  explicit Print(const cv::Mat& image);

  bool empty() const { return levels_.empty(); }
  const Level& level(int index) const { return levels_[static_cast<std::size_t>(index)]; }
  /// The level whose texels are just not larger than `footprint_px` texels of the full picture.
  int level_for(double footprint_px) const;

 private:
  std::vector<Level> levels_;
};

/// Bits of a place between two texels, and of a texel's weight: places are whole numbers of 1/128 texel.
inline constexpr int kPlaceBits = 7;
inline constexpr int kWeightOne = 1 << (2 * kPlaceBits);

}  // namespace skylight::sim
