// The room as a mechanical system seen from above: walls, robots with motors, tyres that grip only so much,
// things that stand or can be pushed, people who walk, and collisions. Box2D works behind it; nothing of it
// shows here.
//
// Model per robot: the motors bring the wheels' speeds to what is commanded, within an acceleration limit;
// each tyre then pushes the body towards rolling without slip, with at most friction * load * the floor's
// factor where it stands (Coulomb, see wheels.hpp). What is asked beyond that slips. A thing that can be
// pushed slides on the floor with Coulomb friction, against motion and turning. People go their way whatever
// stands in it.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "sim/scenario/robot_model.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/world/command.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Where an actor is and how it moves, in `map`: a robot's base_link, a thing's or person's middle.
struct BodyState {
  Pose2 pose;  ///< while it is absent, the last one
  Velocity2 velocity;
  bool present = true;
  bool placed = false;  ///< put there in this step: it did not come from where it was before
};

enum class ActorKind : std::uint8_t { robot, person, thing };

/// Two that touch, by actor, a < b; World::kWall is the last of all.
struct Touch {
  std::size_t a = 0;
  std::size_t b = 0;
  friend auto operator<=>(const Touch&, const Touch&) = default;
};

/// Radius of the circle on the floor that a person takes.
inline constexpr double kPersonRadius = 0.16;

class World {
 public:
  /// One step of the world. Short, so that a straight line between two steps is as good as the path itself.
  static constexpr Duration kStep = std::chrono::milliseconds(2);
  static constexpr std::size_t kWall = std::numeric_limits<std::size_t>::max();

  /// The robots are the first actors.
  World(const RoomSpec& room, const std::vector<RobotSpec>& robots);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Further actors, counted on. A thing that hangs higher than the tallest robot bumps into nothing; a
  /// person is not there until he walks.
  std::size_t add_thing(const ObjectSpec& thing);
  std::size_t add_person();

  /// Advances by one step under these commands, one per robot; beyond a robot's limits they are cut. The
  /// motors of robots that are carried away stand still.
  void step(const std::vector<Command>& commands);

  /// Where a person is to be at the end of the next step; none: not there.
  void walk(std::size_t person, const std::optional<Pose2>& to);
  /// Lifts an actor off the floor: nothing touches it until it is put down again (at rest).
  void take_away(std::size_t actor);
  void put_down(std::size_t actor, const Pose2& pose);
  /// Factor on the friction of a robot's tyres, from now on.
  void set_grip(std::size_t robot, double factor);
  /// A knock on an actor's centre of mass, N s in `map`. What stands fast does not feel it.
  void push(std::size_t actor, const Eigen::Vector2d& impulse_ns);

  std::size_t robot_count() const;
  std::size_t actor_count() const;
  BodyState state(std::size_t actor) const;
  /// Speed of the wheels' treads over the body, m/s: left, right, 0, 0; of a holonomic robot its four wheels
  /// as in wheels.hpp. What an encoder would count.
  Eigen::Vector4d wheel_speeds(std::size_t robot) const;
  /// Whether the actor touches anything.
  bool in_contact(std::size_t actor) const;
  /// Everyone who touches someone after the last step, sorted.
  const std::vector<Touch>& touches() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::sim
