#include "tracker/depth/surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracker/detect/local_projection.hpp"

namespace skylight {
namespace {

constexpr int kAcross = 12;       // places along a side
constexpr double kInside = 0.92;  // of a side: at the very edge two heights mix
constexpr int kFewestCells = 4;
constexpr double kNearlyAll = 0.8;
constexpr double kNear = 2.5;  // sigmas from the median: what stands on the surface is left out of its mean

// From -1 to 1 over a side, in the middle of equal parts.
double spread(int i) {
  return kInside * ((2.0 * i + 1.0) / kAcross - 1.0);
}

}  // namespace

Surface surface_of(const Eigen::Vector2d& size_m, const Eigen::Vector2d& centre_m, double height_m) {
  Surface out{.places_m = {}, .height_m = height_m};
  for (int i = 0; i < kAcross; ++i) {
    for (int k = 0; k < kAcross; ++k) {
      out.places_m.emplace_back(centre_m + 0.5 * size_m.cwiseProduct(Eigen::Vector2d(spread(i), spread(k))));
    }
  }
  return out;
}

Surface surface_of(const Appearance& appearance, double height_m) {
  Surface out = surface_of(appearance.size_m(), appearance.centre_m(), height_m);
  const cv::Mat& mask = appearance.mask();
  const auto belongs = [&](const Eigen::Vector2d& place) {
    const Eigen::Vector2d from = (place - appearance.centre_m()) / appearance.picture().metres_per_pixel;
    const int row =
        std::clamp(static_cast<int>(std::lround((mask.rows - 1) / 2.0 - from.x())), 0, mask.rows - 1);
    const int column =
        std::clamp(static_cast<int>(std::lround((mask.cols - 1) / 2.0 - from.y())), 0, mask.cols - 1);
    return mask.at<float>(row, column) > 0.5F;
  };
  std::erase_if(out.places_m, [&](const Eigen::Vector2d& place) { return !belongs(place); });
  return out;
}

SurfaceLook look_at(const FloorDepth& floor, const cv::Mat& depth, const Surface& surface,
                    const Pose2& pose) {
  SurfaceLook out;
  double reach = 0.0;
  for (const Eigen::Vector2d& place : surface.places_m) reach = std::max(reach, place.norm());
  const auto local =
      LocalProjection::at(floor.camera(), pose.position(), surface.height_m, std::max(reach, 0.01));
  if (!local) return out;
  const Eigen::Rotation2Dd turn(pose.yaw);
  const int side = floor.config().cell_px;
  std::vector<int> cells;
  cells.reserve(surface.places_m.size());
  for (const Eigen::Vector2d& place : surface.places_m) {
    const Pixel pixel = local->pixel(turn * place);
    const int column = static_cast<int>(std::floor((pixel.x() + 0.5) / side));
    const int row = static_cast<int>(std::floor((pixel.y() + 0.5) / side));
    if (column < 0 || row < 0 || column >= floor.cells().width || row >= floor.cells().height) continue;
    cells.push_back(row * floor.cells().width + column);
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  std::vector<float> heights;
  heights.reserve(cells.size());
  for (const int cell : cells) {
    const float height = floor.height(depth, cell % floor.cells().width, cell / floor.cells().width);
    if (!std::isnan(height)) heights.push_back(height);
  }
  out.cells = static_cast<int>(cells.size());
  out.readings = static_cast<int>(heights.size());
  const double sigma = floor.sigma_m(surface.height_m);
  out.within_m = std::max(floor.config().tolerance_m, floor.config().sigmas * sigma);
  if (heights.empty()) return out;
  const auto n = static_cast<double>(heights.size());
  const auto share_above = [&](double limit) {
    return static_cast<double>(std::count_if(heights.begin(), heights.end(),
                                             [&](float h) { return static_cast<double>(h) > limit; })) /
           n;
  };
  out.higher = share_above(surface.height_m + out.within_m);
  out.lower = 1.0 - share_above(surface.height_m - out.within_m);
  out.level = 1.0 - out.higher - out.lower;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  out.height_m = static_cast<double>(*middle);
  double used = 1.0;
  for (int round = 0; round < 2; ++round) {
    double sum = 0.0;
    used = 0.0;
    for (const float height : heights) {
      if (std::abs(static_cast<double>(height) - out.height_m) > kNear * std::max(sigma, 1e-4)) continue;
      sum += static_cast<double>(height);
      used += 1.0;
    }
    if (used > 0.0) out.height_m = sum / used;
  }
  out.sigma_m = std::hypot(sigma / std::sqrt(std::max(used, 1.0)), floor.fit().uneven_m);
  return out;
}

bool tells(const SurfaceLook& look) {
  return look.cells >= kFewestCells && 3 * look.readings >= look.cells;
}

bool covered(const SurfaceLook& look, const DepthConfig& config) {
  return tells(look) && look.higher >= config.covered_share;
}

bool empty(const SurfaceLook& look) {
  return tells(look) && look.lower >= kNearlyAll;
}

bool at_wrong_height(const SurfaceLook& look, double surface_height_m, const DepthConfig& config) {
  const double within = std::max(config.tolerance_m, config.sigmas * look.sigma_m);
  return tells(look) && std::abs(look.height_m - surface_height_m) > within;
}

void SurfaceHeight::add(const SurfaceLook& look, double uneven_m) {
  const double variance = std::max(look.sigma_m * look.sigma_m - uneven_m * uneven_m, 1e-10);
  information_ += 1.0 / variance;
  mean_ += (look.height_m - mean_) / variance / information_;
  uneven_m_ = uneven_m;
  ++looks_;
}

double SurfaceHeight::sigma_m() const {
  if (looks_ == 0) return std::numeric_limits<double>::infinity();
  return std::sqrt(1.0 / information_ + uneven_m_ * uneven_m_);
}

}  // namespace skylight
