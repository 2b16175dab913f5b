#include "sim/world/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

namespace skylight::sim {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

/// Andrew's monotone chain (1979).
Outline hull(const std::vector<Outline>& parts) {
  Outline corners;
  for (const Outline& part : parts) corners.insert(corners.end(), part.begin(), part.end());
  const auto before = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  };
  std::sort(corners.begin(), corners.end(), before);
  Outline result;
  const auto add = [&](const Eigen::Vector2d& corner, std::size_t keep) {
    while (result.size() >= keep + 2 &&
           cross(result.back() - result[result.size() - 2], corner - result.back()) <= 0.0) {
      result.pop_back();
    }
    result.push_back(corner);
  };
  for (const Eigen::Vector2d& corner : corners) add(corner, 0);
  const std::size_t lower = result.size() - 1;
  for (auto corner = corners.rbegin() + 1; corner != corners.rend(); ++corner) add(*corner, lower);
  result.pop_back();  // the first corner again
  return result;
}

Outline circle_outline(const Eigen::Vector2d& middle, double radius_m) {
  constexpr int kCorners = 24;
  const double reach = radius_m / std::cos(std::numbers::pi / kCorners);
  Outline corners;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCorners;
    corners.emplace_back(middle + reach * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return corners;
}

Outline robot_outline(const RobotModel& model) {
  if (model.round_radius_m > 0.0) return circle_outline({0.0, 0.0}, model.round_radius_m);
  return hull(outlines(model, {}));
}

Outline placed(const Outline& outline, const Pose2& at) {
  const Eigen::Rotation2Dd turn(at.yaw);
  Outline result;
  result.reserve(outline.size());
  for (const Eigen::Vector2d& corner : outline) result.emplace_back(at.position() + turn * corner);
  return result;
}

double distance(const Outline& outline, const Eigen::Vector2d& place) {
  double deepest = -std::numeric_limits<double>::infinity();
  double nearest = std::numeric_limits<double>::infinity();  // squared
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& from = outline[i];
    const Eigen::Vector2d side = outline[i + 1 == outline.size() ? 0 : i + 1] - from;
    const Eigen::Vector2d to = place - from;
    const double length2 = side.squaredNorm();
    deepest = std::max(deepest, -cross(side, to) / std::sqrt(length2));
    const double along = std::clamp(side.dot(to) / length2, 0.0, 1.0);
    nearest = std::min(nearest, (to - along * side).squaredNorm());
  }
  return deepest <= 0.0 ? deepest : std::sqrt(nearest);
}

Obstacle make_obstacle(std::size_t actor, Outline outline, const Eigen::Vector2d& velocity) {
  Obstacle obstacle{.actor = actor, .outline = std::move(outline), .velocity = velocity};
  for (const Eigen::Vector2d& corner : obstacle.outline) obstacle.middle += corner;
  obstacle.middle /= static_cast<double>(obstacle.outline.size());
  for (const Eigen::Vector2d& corner : obstacle.outline)
    obstacle.radius_m = std::max(obstacle.radius_m, (corner - obstacle.middle).norm());
  return obstacle;
}

}  // namespace skylight::sim
