#include "sim/render/print.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace skylight::sim {
namespace {

Print::Level pack(const cv::Mat& image, const cv::Size& full) {
  Print::Level level;
  level.columns = image.cols;
  level.rows = image.rows;
  level.stride = image.cols + 1;
  level.columns_per_full = static_cast<float>(image.cols) / static_cast<float>(full.width);
  level.rows_per_full = static_cast<float>(image.rows) / static_cast<float>(full.height);
  level.texels.reserve(static_cast<std::size_t>(level.stride) * static_cast<std::size_t>(image.rows + 1));
  for (int r = 0; r <= image.rows; ++r) {
    for (int c = 0; c <= image.cols; ++c) {
      const auto& bgr = image.at<cv::Vec3b>(std::min(r, image.rows - 1), std::min(c, image.cols - 1));
      level.texels.push_back(bgr[0] | static_cast<std::uint32_t>(bgr[1]) << 8U |
                             static_cast<std::uint32_t>(bgr[2]) << 16U);
    }
  }
  return level;
}

}  // namespace

Print::Print(const cv::Mat& image) {
  CV_Assert(image.type() == CV_8UC3);
  cv::Mat level = image;
  levels_.push_back(pack(level, image.size()));
  while (std::min(level.cols, level.rows) > 2) {
    cv::Mat half;
    cv::resize(level, half, {(level.cols + 1) / 2, (level.rows + 1) / 2}, 0, 0, cv::INTER_AREA);
    level = half;
    levels_.push_back(pack(level, image.size()));
  }
}

int Print::level_for(double footprint_px) const {
  const int level = footprint_px > 1.0 ? static_cast<int>(std::floor(std::log2(footprint_px))) : 0;
  return std::min(level, static_cast<int>(levels_.size()) - 1);
}

}  // namespace skylight::sim
