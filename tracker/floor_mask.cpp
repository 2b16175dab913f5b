#include "tracker/floor_mask.hpp"

#include <algorithm>
#include <cmath>

namespace skylight {
namespace {

constexpr double kFarthest = 1e4;  // m
constexpr int kEdgeStep = 8;       // px

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// On which side of the line from a to b: above 0 left, 0 on it.
double side(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  return cross(b - a, p - a);
}

bool within_box(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  return (p.array() >= a.cwiseMin(b).array()).all() && (p.array() <= a.cwiseMax(b).array()).all();
}

/// Whether the segments a b and c d have a point in common.
bool meet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
          const Eigen::Vector2d& d) {
  const double c_side = side(a, b, c);
  const double d_side = side(a, b, d);
  const double a_side = side(c, d, a);
  const double b_side = side(c, d, b);
  if (((c_side > 0 && d_side < 0) || (c_side < 0 && d_side > 0)) &&
      ((a_side > 0 && b_side < 0) || (a_side < 0 && b_side > 0)))
    return true;
  return (c_side == 0 && within_box(a, b, c)) || (d_side == 0 && within_box(a, b, d)) ||
         (a_side == 0 && within_box(c, d, a)) || (b_side == 0 && within_box(c, d, b));
}

std::string corner(std::size_t i) {
  return "corners[" + std::to_string(i) + "]";
}

/// A corner where the polygon turns back onto itself, or sides that meet elsewhere; empty where there is
/// none.
std::string check_sides(const std::vector<Eigen::Vector2d>& corners) {
  const std::size_t count = corners.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& before = corners[(i + count - 1) % count];
    const Eigen::Vector2d& after = corners[(i + 1) % count];
    if (side(before, corners[i], after) == 0 && (before - corners[i]).dot(after - corners[i]) > 0)
      return corner(i) + ": the sides before and after it lie on each other";
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& after = corners[(i + 1) % count];
    for (std::size_t k = i + 2; k < count; ++k) {
      if (i == 0 && k == count - 1) continue;  // neighbours
      if (meet(corners[i], after, corners[k], corners[(k + 1) % count]))
        return corner(k) + ": the side from there meets the one from " + corner(i) +
               ", allowed: sides that do not cross";
    }
  }
  return {};
}

/// Calls `good` for places along the rim of a part of a picture until it says no.
template <class Good>
bool all_along_rim(const cv::Rect& part, const Good& good) {
  const int right = part.x + part.width - 1;
  const int bottom = part.y + part.height - 1;
  for (int x = part.x;; x = std::min(x + kEdgeStep, right)) {
    if (!good(Pixel(x, part.y)) || !good(Pixel(x, bottom))) return false;
    if (x == right) break;
  }
  for (int y = part.y;; y = std::min(y + kEdgeStep, bottom)) {
    if (!good(Pixel(part.x, y)) || !good(Pixel(right, y))) return false;
    if (y == bottom) break;
  }
  return true;
}

}  // namespace

std::string check(const FloorMask& mask) {
  const std::size_t count = mask.corners.size();
  if (count < 3 || count > FloorMask::kMostCorners)
    return "corners: there are " + std::to_string(count) + ", allowed 3 to " +
           std::to_string(FloorMask::kMostCorners);
  for (std::size_t i = 0; i < count; ++i) {
    if (!(mask.corners[i].array().abs() <= kFarthest).all())
      return corner(i) + ": is not within 10 km of the origin";
    if (mask.corners[i] == mask.corners[(i + 1) % count])
      return corner(i) + ": is the same place as the next one";
  }
  return check_sides(mask.corners);
}

bool covers(const FloorMask& mask, const Eigen::Vector2d& place) {
  bool inside = false;
  for (std::size_t i = 0; i < mask.corners.size(); ++i) {
    const Eigen::Vector2d& a = mask.corners[i];
    const Eigen::Vector2d& b = mask.corners[(i + 1) % mask.corners.size()];
    if ((a.y() > place.y()) == (b.y() > place.y())) continue;
    const double x = a.x() + (b.x() - a.x()) * (place.y() - a.y()) / (b.y() - a.y());
    if (x > place.x()) inside = !inside;
  }
  return inside;
}

bool any_covers(const std::vector<FloorMask>& masks, const Eigen::Vector2d& place) {
  return std::any_of(masks.begin(), masks.end(), [&](const FloorMask& mask) { return covers(mask, place); });
}

bool any_covers(const std::vector<FloorMask>& masks, const CameraModel& camera, const cv::Rect& part,
                double height_m) {
  return std::any_of(masks.begin(), masks.end(), [&](const FloorMask& mask) {
    return all_along_rim(part, [&](const Pixel& pixel) {
      const auto at = camera.plane_from_pixel(pixel, height_m);
      return at && covers(mask, *at);
    });
  });
}

}  // namespace skylight
