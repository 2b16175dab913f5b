// Which pixels of each row a shape may cover, and which it covers wholly.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/camera/camera_model.hpp"

namespace skylight::sim {

/// Pixels begin to end - 1 of a row.
struct Span {
  int begin = 0;
  int end = 0;
  bool empty() const { return begin >= end; }
  bool holds(const Span& other) const { return begin <= other.begin && end >= other.end; }
  bool meets(const Span& other) const { return begin < other.end && other.begin < end; }
};

/// One span in each of some rows.
class Outline {
 public:
  Span at(int y) const {
    const auto row = static_cast<std::size_t>(y - first_row_);
    return y >= first_row_ && row < spans_.size() ? spans_[row] : Span{};
  }
  int first_row() const { return first_row_; }
  int end_row() const { return first_row_ + static_cast<int>(spans_.size()); }
  bool empty() const { return spans_.empty(); }
  /// All columns that any row has.
  Span columns() const;

  void clear() { spans_.clear(); }
  /// Grows to hold another's pixels, and those of a row that lie in between.
  void join(const Outline& other);
  /// A pixel of one lies in or right beside the other.
  bool touches(const Outline& other) const;
  /// All pixels of a picture of this size.
  void fill(int width, int height);
  /// Every pixel that comes within `margin` px of the polygon (counter-clockwise, convex; half a pixel of the
  /// margin is the pixel's own size).
  void around(const std::vector<Eigen::Vector2d>& polygon, double margin, int width, int height);
  /// Every pixel that keeps `margin` px from the polygon's edge.
  void inside(const std::vector<Eigen::Vector2d>& polygon, double margin, int width, int height);

 private:
  bool begin_rows(const std::vector<Eigen::Vector2d>& polygon, double margin, int height);

  int first_row_ = 0;
  std::vector<Span> spans_;
};

/// The smallest convex polygon around points, counter-clockwise; changes the points' order.
std::vector<Eigen::Vector2d> hull(std::vector<Eigen::Vector2d>& points);

/// The part of a convex polygon that lies within a rectangle around the origin with these half sizes.
std::vector<Eigen::Vector2d> clipped(std::vector<Eigen::Vector2d> polygon, const Eigen::Vector2d& half);

/// Pixels of points in `map`; a lens bends straight edges, so points must be near enough to each other.
/// False where a point is not in front of the camera or out of its lens's range.
bool project_all(const CameraModel& camera, const std::vector<Eigen::Vector3d>& points,
                 std::vector<Eigen::Vector2d>& pixels);

}  // namespace skylight::sim
