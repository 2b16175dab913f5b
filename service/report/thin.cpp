#include "service/report/thin.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>
#include <utility>

namespace skylight::service::report {
namespace {

constexpr double kTolerancePx = 0.15;

bool rises(const std::vector<Point>& points) {
  return std::is_sorted(points.begin(), points.end(), [](Point a, Point b) { return a.x < b.x; });
}

std::vector<Point> four_of_each_column(const std::vector<Point>& points) {
  std::vector<Point> out;
  for (std::size_t begin = 0; begin < points.size();) {
    const double column = std::floor(points[begin].x);
    std::size_t end = begin;
    std::size_t lowest = begin;
    std::size_t highest = begin;
    for (; end < points.size() && std::floor(points[end].x) == column; ++end) {
      if (points[end].y < points[lowest].y) lowest = end;
      if (points[end].y > points[highest].y) highest = end;
    }
    std::size_t last = begin;
    out.push_back(points[begin]);
    for (const std::size_t i : {std::min(lowest, highest), std::max(lowest, highest), end - 1}) {
      if (i != last) out.push_back(points[i]);
      last = i;
    }
    begin = end;
  }
  return out;
}

// Bounds what Douglas-Peucker has to look at on a path that fills the plot.
std::vector<Point> without_near_ones(const std::vector<Point>& points) {
  std::vector<Point> out{points.front()};
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    if (std::hypot(points[i].x - out.back().x, points[i].y - out.back().y) >= kTolerancePx)
      out.push_back(points[i]);
  }
  out.push_back(points.back());
  return out;
}

double distance_to_segment(Point p, Point a, Point b) {
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const double length2 = dx * dx + dy * dy;
  const double along =
      length2 > 0.0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / length2, 0.0, 1.0) : 0.0;
  return std::hypot(p.x - a.x - along * dx, p.y - a.y - along * dy);
}

std::vector<Point> without_straight_ones(const std::vector<Point>& points) {
  std::vector<bool> keep(points.size(), false);
  keep.front() = keep.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, points.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    std::size_t farthest = first;
    double most = kTolerancePx;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double distance = distance_to_segment(points[i], points[first], points[last]);
      if (distance > most) {
        most = distance;
        farthest = i;
      }
    }
    if (farthest == first) continue;
    keep[farthest] = true;
    open.emplace_back(first, farthest);
    open.emplace_back(farthest, last);
  }
  std::vector<Point> out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (keep[i]) out.push_back(points[i]);
  }
  return out;
}

// Of several the first, so that many dots at one place stay one.
std::set<std::size_t> outermost(const std::vector<Point>& points) {
  const auto index = [&](auto iterator) { return static_cast<std::size_t>(iterator - points.begin()); };
  const auto by_x = [](Point a, Point b) { return a.x < b.x; };
  const auto by_y = [](Point a, Point b) { return a.y < b.y; };
  return {index(std::min_element(points.begin(), points.end(), by_x)),
          index(std::max_element(points.begin(), points.end(), by_x)),
          index(std::min_element(points.begin(), points.end(), by_y)),
          index(std::max_element(points.begin(), points.end(), by_y))};
}

}  // namespace

std::vector<Point> thin_line(const std::vector<Point>& points) {
  if (points.size() < 3) return points;
  return without_straight_ones(rises(points) ? four_of_each_column(points) : without_near_ones(points));
}

std::vector<std::size_t> thin_dots(const std::vector<Point>& points, std::size_t most) {
  if (points.empty()) return {};
  const std::set<std::size_t> outer = outermost(points);
  std::vector<std::size_t> kept(points.size());
  std::iota(kept.begin(), kept.end(), 0);
  double cell_px = 0.5;
  do {
    std::set<std::pair<std::int64_t, std::int64_t>> taken;
    std::erase_if(kept, [&](std::size_t i) {
      const std::pair cell{std::llround(points[i].x / cell_px), std::llround(points[i].y / cell_px)};
      return !taken.insert(cell).second && !outer.contains(i);
    });
    cell_px *= 1.3;
  } while (kept.size() > most + outer.size());
  return kept;
}

}  // namespace skylight::service::report
