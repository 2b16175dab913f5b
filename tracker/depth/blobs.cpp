#include "tracker/depth/blobs.hpp"

#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace skylight {
namespace {

constexpr double kLeastArea = 0.4;  // of the surface's
constexpr double kLongest = 1.5;    // side of the box around it, in sides of a square of the largest area

// Mean over k x k cells of those that have a height; NaN where fewer than half have.
cv::Mat smoothed(const cv::Mat& heights, int k) {
  const cv::Mat known = heights == heights;  // NaN differs from itself
  cv::Mat filled = heights.clone();
  filled.setTo(0.0F, ~known);
  cv::Mat share;
  known.convertTo(share, CV_32F, 1.0 / 255.0);
  cv::blur(filled, filled, {k, k});
  cv::blur(share, share, {k, k});
  cv::Mat out;
  cv::divide(filled, share, out);
  out.setTo(std::numeric_limits<float>::quiet_NaN(), share < 0.5F);
  return out;
}

}  // namespace

cv::Mat height_map(const FloorDepth& floor, const cv::Mat& depth) {
  cv::Mat out(floor.cells(), CV_32FC1);
  for (int row = 0; row < out.rows; ++row) {
    auto* heights = out.ptr<float>(row);
    for (int column = 0; column < out.cols; ++column) heights[column] = floor.height(depth, column, row);
  }
  return out;
}

std::vector<Blob> find_blobs(const FloorDepth& floor, const cv::Mat& heights, const BlobQuery& query) {
  std::vector<Blob> out;
  const CameraModel& camera = floor.camera();
  const Intrinsics& in = camera.intrinsics();
  const int side = floor.config().cell_px;
  Eigen::Matrix2d metres_by_px;
  if (!camera.plane_from_pixel({in.cx_px, in.cy_px}, query.height_m, &metres_by_px)) return out;
  const double cell_m = side * std::sqrt(std::abs(metres_by_px.determinant()));
  // Over a quarter of the surface's side noise is averaged away.
  const int k = std::clamp(static_cast<int>(query.size_m.minCoeff() / cell_m / 4.0), 1, 15);
  const double within =
      std::max(floor.config().tolerance_m, floor.config().sigmas * floor.sigma_m(query.height_m) / k);
  if (query.height_m < 1.5 * within) return out;

  const cv::Mat smooth = smoothed(heights, k);
  const cv::Mat level = (smooth >= query.height_m - within) & (smooth <= query.height_m + within);
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int count = cv::connectedComponentsWithStats(level, labels, stats, centres, 8, CV_32S);
  const double largest = query.largest * query.size_m.prod();
  for (int i = 1; i < count; ++i) {
    const Pixel at((centres.at<double>(i, 0) + 0.5) * side - 0.5,
                   (centres.at<double>(i, 1) + 0.5) * side - 0.5);
    const auto place = camera.plane_from_pixel(at, query.height_m, &metres_by_px);
    if (!place) continue;
    const double m2_by_px = std::abs(metres_by_px.determinant());
    const double area = stats.at<int>(i, cv::CC_STAT_AREA) * side * side * m2_by_px;
    const cv::Rect box(side * stats.at<int>(i, cv::CC_STAT_LEFT), side * stats.at<int>(i, cv::CC_STAT_TOP),
                       side * stats.at<int>(i, cv::CC_STAT_WIDTH),
                       side * stats.at<int>(i, cv::CC_STAT_HEIGHT));
    const double longest = std::max(box.width, box.height) * std::sqrt(m2_by_px);
    if (area < kLeastArea * query.size_m.prod() || area > largest || longest > kLongest * std::sqrt(largest))
      continue;
    const int margin = static_cast<int>(std::ceil(0.5 * query.size_m.norm() / std::sqrt(m2_by_px)));
    const cv::Rect grown(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin);
    out.push_back(
        {.part_px = grown & cv::Rect(0, 0, in.width_px, in.height_px), .place_m = *place, .area_m2 = area});
  }
  return out;
}

}  // namespace skylight
