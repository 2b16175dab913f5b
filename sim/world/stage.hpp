// Everything that moves, advancing together: the world, the robots' programs and odometry, the people, the
// events and what they do. Pictures are taken of its timeline.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/scenario/event.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/world/director.hpp"
#include "sim/world/odometry.hpp"
#include "sim/world/timeline.hpp"
#include "sim/world/world.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Who or what moves on the stage. Actors are counted in one row: the robots, the people, the things of the
/// scenario, then the things that are put into the room, as they come. Indices never change during a run:
/// what is taken away stays in the row, absent.
struct Actor {
  ActorKind kind = ActorKind::robot;
  std::size_t index = 0;  ///< into robots(), people() or things()
};

/// An action that is not the world's but the pictures': light, shadow, bump, cover, freeze, blackout; and put
/// and remove, for whoever draws things.
struct Effect {
  Duration at{};  ///< from the scenario's start
  Action action;
};

class Stage {
 public:
  /// The scenario must be a valid one (validate()).
  explicit Stage(const Scenario& scenario);
  ~Stage();
  Stage(Stage&&) noexcept;
  Stage& operator=(Stage&&) noexcept;

  /// One World::kStep: first what happens now, then the motion up to time() + kStep.
  void advance();
  /// Since the scenario's start; that of the timeline's last states.
  Duration time() const;

  std::size_t actor_count() const;
  Actor actor(std::size_t index) const;
  const std::string& id(std::size_t actor) const;
  /// With their copies.
  const std::vector<RobotSpec>& robots() const;
  const std::vector<PersonSpec>& people() const;
  /// As they were put: where they are now says the timeline.
  const std::vector<ObjectSpec>& things() const;

  /// States by actor. An actor that came later is absent before.
  const Timeline& timeline() const;
  /// Frees what lies more than a step before `time`.
  void forget_before(Duration time);
  /// Ids of what an actor touched at this time (of the timeline), "wall" last.
  std::vector<std::string> touches(std::size_t actor, Duration time) const;
  /// Whether a robot's program is over (of an empty one: from the start).
  bool program_done(std::size_t robot) const;
  /// Whether its motors and odometry are on.
  bool powered(std::size_t robot) const;

  /// Does something at time(), as an event would: from the next step on it shows. Throws
  /// std::invalid_argument naming what is wrong: no such robot, camera or thing, an id that is taken, a place
  /// outside the room or occupied. (A kidnapped robot waits for its place to be free. An event of the
  /// scenario that finds its place occupied or its id taken tries again every 0.1 s; one whose thing is not
  /// there does nothing.)
  void act(const Action& action);

  // What came since the last call, in the order of time.
  std::vector<Effect> take_effects();
  std::vector<Happening> take_happenings();
  std::vector<OdometryReport> take_odometry();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::sim
