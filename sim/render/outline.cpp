#include "sim/render/outline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace skylight::sim {
namespace {

using Eigen::Vector2d;

double cross(const Vector2d& o, const Vector2d& a, const Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

/// To a whole number within a picture, however far out it lies.
int pixel(double value, int most) {
  return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
}

/// Where a horizontal line crosses a convex polygon; low > high where it does not.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

/// Adds what an edge covers between two heights.
void add_edge(Range& range, const Vector2d& a, const Vector2d& b, double top, double bottom) {
  const double low = std::max(std::min(a.y(), b.y()), top);
  const double high = std::min(std::max(a.y(), b.y()), bottom);
  if (low > high) return;
  const double rise = b.y() - a.y();
  if (rise == 0.0) {
    range.add(a.x());
    range.add(b.x());
    return;
  }
  range.add(a.x() + (b.x() - a.x()) * std::clamp((low - a.y()) / rise, 0.0, 1.0));
  range.add(a.x() + (b.x() - a.x()) * std::clamp((high - a.y()) / rise, 0.0, 1.0));
}

}  // namespace

Span Outline::columns() const {
  Span all{std::numeric_limits<int>::max(), 0};
  for (const Span& span : spans_) {
    if (span.empty()) continue;
    all.begin = std::min(all.begin, span.begin);
    all.end = std::max(all.end, span.end);
  }
  return all.empty() ? Span{} : all;
}

void Outline::join(const Outline& other) {
  if (other.empty()) return;
  if (empty()) {
    *this = other;
    return;
  }
  const int first = std::min(first_row_, other.first_row_);
  const int end = std::max(end_row(), other.end_row());
  spans_.insert(spans_.begin(), static_cast<std::size_t>(first_row_ - first), Span{});
  spans_.resize(static_cast<std::size_t>(end - first));
  first_row_ = first;
  for (int y = other.first_row(); y < other.end_row(); ++y) {
    const Span more = other.at(y);
    Span& span = spans_[static_cast<std::size_t>(y - first)];
    if (more.empty()) continue;
    span = span.empty() ? more : Span{std::min(span.begin, more.begin), std::max(span.end, more.end)};
  }
}

bool Outline::touches(const Outline& other) const {
  const int end = std::min(end_row(), other.end_row());
  for (int y = std::max(first_row_, other.first_row_); y < end; ++y) {
    const Span a = at(y);
    const Span b = other.at(y);
    if (!a.empty() && !b.empty() && a.begin <= b.end && b.begin <= a.end) return true;
  }
  return false;
}

void Outline::fill(int width, int height) {
  first_row_ = 0;
  spans_.assign(static_cast<std::size_t>(height), {0, width});
}

bool Outline::begin_rows(const std::vector<Vector2d>& polygon, double margin, int height) {
  spans_.clear();
  if (polygon.size() < 3) return false;
  Range rows;
  for (const Vector2d& p : polygon) rows.add(p.y());
  if (rows.high + margin < 0.0 || rows.low - margin > height - 1.0) return false;
  first_row_ = pixel(std::ceil(rows.low - margin), height);
  const int end = pixel(std::floor(rows.high + margin) + 1.0, height);
  if (end <= first_row_) return false;
  spans_.assign(static_cast<std::size_t>(end - first_row_), Span{});
  return true;
}

void Outline::around(const std::vector<Vector2d>& polygon, double margin, int width, int height) {
  if (!begin_rows(polygon, margin, height)) return;
  std::vector<Range> ranges(spans_.size());
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    const int begin = pixel(std::ceil(std::min(a.y(), b.y()) - margin), height);
    const int end = pixel(std::floor(std::max(a.y(), b.y()) + margin) + 1.0, height);
    for (int y = std::max(begin, first_row_); y < std::min(end, end_row()); ++y)
      add_edge(ranges[static_cast<std::size_t>(y - first_row_)], a, b, y - margin, y + margin);
  }
  for (std::size_t i = 0; i < spans_.size(); ++i) {
    if (ranges[i].low > ranges[i].high) continue;
    spans_[i] = {pixel(std::ceil(ranges[i].low - margin), width),
                 pixel(std::floor(ranges[i].high + margin) + 1.0, width)};
  }
}

void Outline::inside(const std::vector<Vector2d>& polygon, double margin, int width, int height) {
  if (!begin_rows(polygon, -margin, height)) return;
  for (std::size_t i = 0; i < spans_.size(); ++i) {
    const double y = first_row_ + static_cast<double>(i);
    Range upper;
    Range lower;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vector2d& a = polygon[k];
      const Vector2d& b = polygon[(k + 1) % polygon.size()];
      add_edge(upper, a, b, y - margin, y - margin);
      add_edge(lower, a, b, y + margin, y + margin);
    }
    const double low = std::max(upper.low, lower.low) + margin;
    const double high = std::min(upper.high, lower.high) - margin;
    if (low > high) continue;
    spans_[i] = {pixel(std::ceil(low), width), pixel(std::floor(high) + 1.0, width)};
  }
}

std::vector<Vector2d> hull(std::vector<Vector2d>& points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Vector2d> polygon;
  const auto add = [&](const Vector2d& p, std::size_t from) {
    while (polygon.size() >= from + 2 && cross(polygon[polygon.size() - 2], polygon.back(), p) <= 0.0)
      polygon.pop_back();
    polygon.push_back(p);
  };
  for (const Vector2d& p : points) add(p, 0);
  const std::size_t lower = polygon.size() - 1;
  for (std::size_t i = points.size(); i-- > 0;) add(points[i], lower);
  polygon.pop_back();
  return polygon;
}

std::vector<Vector2d> clipped(std::vector<Vector2d> polygon, const Vector2d& half) {
  // Sutherland and Hodgman: one side of the rectangle after the other.
  for (const int axis : {0, 1}) {
    for (const double side : {-1.0, 1.0}) {
      std::vector<Vector2d> left;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vector2d& a = polygon[i];
        const Vector2d& b = polygon[(i + 1) % polygon.size()];
        const double outside_a = side * a[axis] - half[axis];
        const double outside_b = side * b[axis] - half[axis];
        if (outside_a <= 0.0) left.push_back(a);
        if ((outside_a < 0.0 && outside_b > 0.0) || (outside_a > 0.0 && outside_b < 0.0))
          left.push_back(a + (b - a) * (outside_a / (outside_a - outside_b)));
      }
      polygon = std::move(left);
    }
  }
  return polygon;
}

bool project_all(const CameraModel& camera, const std::vector<Eigen::Vector3d>& points,
                 std::vector<Vector2d>& pixels) {
  pixels.clear();
  for (const Eigen::Vector3d& point : points) {
    const auto at = camera.project_map(point);
    if (!at) return false;
    pixels.push_back(*at);
  }
  return true;
}

}  // namespace skylight::sim
