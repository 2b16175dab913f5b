// The room as a mechanical system seen from above: walls, robots with motors, tyres that grip only so much,
// and collisions. Box2D works behind it; nothing of it shows here.
//
// Model per robot: the motors bring the wheels' speeds to what is commanded, within an acceleration limit;
// each tyre then pushes the body towards rolling without slip, along and across, with at most friction * load
// (a friction circle per wheel, Coulomb). What is asked beyond that slips.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sim/scenario/robot_model.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/world/program.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Where a robot is and how it moves, at base_link in `map`.
struct BodyState {
  Pose2 pose;
  Velocity2 velocity;
};

class World {
 public:
  /// One step of the world. Short, so that a straight line between two steps is as good as the path itself.
  static constexpr Duration kStep = std::chrono::milliseconds(2);

  World(const RoomSpec& room, const std::vector<RobotSpec>& robots);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Advances by one step under these commands, one per robot; beyond a robot's limits they are cut.
  void step(const std::vector<Command>& commands);

  std::size_t robot_count() const;
  BodyState state(std::size_t robot) const;
  /// Speed of the wheels' treads over the body, left and right, m/s: what an encoder would count.
  Eigen::Vector2d wheel_speeds(std::size_t robot) const;
  /// Whether the robot touches a wall or another robot.
  bool in_contact(std::size_t robot) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::sim
