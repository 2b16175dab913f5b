#include "sim/scenario/outline.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace skylight::sim {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

/// Whether a side of `a` has all of `b` on its far side.
bool separates(const Outline& a, const Outline& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::Vector2d side = a[(i + 1) % a.size()] - a[i];
    const Eigen::Vector2d outward(side.y(), -side.x());
    const bool all = std::all_of(
        b.begin(), b.end(), [&](const Eigen::Vector2d& corner) { return outward.dot(corner - a[i]) >= 0.0; });
    if (all) return true;
  }
  return false;
}

Outline placed(Outline corners, const Eigen::Vector2d& at, double yaw_deg) {
  const Eigen::Rotation2Dd turn(yaw_deg * kRadians);
  for (Eigen::Vector2d& corner : corners) corner = at + turn * corner;
  return corners;
}

Outline rectangle(const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
  return {min, {max.x(), min.y()}, max, {min.x(), max.y()}};
}

}  // namespace

std::vector<Outline> outlines(const RobotModel& model, const StartSpec& at) {
  std::vector<Outline> parts;
  for (const Rectangle& part : model.footprint)
    parts.push_back(placed(rectangle(part.min, part.max), {at.x_m, at.y_m}, at.yaw_deg));
  return parts;
}

Outline outline(const ObjectSpec& object) {
  const Eigen::Vector2d half(0.5 * object.size_m[0], 0.5 * object.size_m[1]);
  if (object.shape == BodyShape::box)
    return placed(rectangle(-half, half), {object.x_m, object.y_m}, object.yaw_deg);
  constexpr int kCorners = 24;
  const double radius = half.x() / std::cos(std::numbers::pi / kCorners);
  Outline corners;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCorners;
    corners.emplace_back(object.x_m + radius * std::cos(angle), object.y_m + radius * std::sin(angle));
  }
  return corners;
}

bool overlap(const Outline& a, const Outline& b) {
  return !separates(a, b) && !separates(b, a);
}

bool overlap(const std::vector<Outline>& a, const std::vector<Outline>& b) {
  return std::any_of(a.begin(), a.end(), [&](const Outline& part) {
    return std::any_of(b.begin(), b.end(), [&](const Outline& other) { return overlap(part, other); });
  });
}

bool within(const RoomSpec& room, const Outline& outline) {
  return std::all_of(outline.begin(), outline.end(), [&](const Eigen::Vector2d& corner) {
    return std::abs(corner.x()) <= 0.5 * room.size_m[0] && std::abs(corner.y()) <= 0.5 * room.size_m[1];
  });
}

}  // namespace skylight::sim
