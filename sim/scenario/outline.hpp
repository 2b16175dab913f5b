// Outlines on the floor: whether things stand in each other's way at the start.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/scenario/robot_model.hpp"
#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

/// A convex polygon in `map`, counter-clockwise.
using Outline = std::vector<Eigen::Vector2d>;

/// What a robot of this kind covers when it stands there: one outline for each part of its footprint.
std::vector<Outline> outlines(const RobotModel& model, const StartSpec& at);
/// What a thing covers; a cylinder's is a polygon around it, wider by less than a hundredth.
Outline outline(const ObjectSpec& object);

/// Whether the two have more than their edges in common.
bool overlap(const Outline& a, const Outline& b);
bool overlap(const std::vector<Outline>& a, const std::vector<Outline>& b);

/// Whether all of it lies within the room's walls.
bool within(const RoomSpec& room, const Outline& outline);

}  // namespace skylight::sim
