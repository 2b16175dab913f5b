// Outlines on the floor: hulls, and how far places are from them.
#pragma once

#include <vector>

#include "sim/scenario/outline.hpp"
#include "sim/world/command.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// The convex outline around all corners, counter-clockwise.
Outline hull(const std::vector<Outline>& parts);

/// The outline of a robot of this kind at the origin: hull of its footprint, of a round one a polygon around
/// its circle.
Outline robot_outline(const RobotModel& model);

/// A regular polygon around a circle, wider by less than a hundredth.
Outline circle_outline(const Eigen::Vector2d& middle, double radius_m);

Outline placed(const Outline& outline, const Pose2& at);

/// Distance from a place to an outline, m; within it negative (to the nearest side).
double distance(const Outline& outline, const Eigen::Vector2d& place);

Obstacle make_obstacle(std::size_t actor, Outline outline, const Eigen::Vector2d& velocity);

}  // namespace skylight::sim
