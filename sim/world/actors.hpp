// Robots, people and things as one row of actors, with what each is, in the world that moves them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "sim/scenario/outline.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/world/command.hpp"
#include "sim/world/world.hpp"

namespace skylight::sim {

/// The row: robots, people, the scenario's things, things that are put into the room later. Who is taken away
/// keeps his place in it.
class Actors {
 public:
  explicit Actors(const Scenario& scenario);

  World world;

  const std::vector<RobotSpec>& robots() const { return robots_; }
  const std::vector<PersonSpec>& people() const { return people_; }
  const std::vector<ObjectSpec>& things() const { return things_; }
  std::size_t count() const { return world.actor_count(); }
  std::size_t person(std::size_t index) const { return robots_.size() + index; }
  std::size_t thing(std::size_t index) const { return robots_.size() + people_.size() + index; }

  const std::string& id(std::size_t actor) const;
  /// The id must be a robot's.
  std::size_t robot(const std::string& id) const;
  /// The thing of this id that is in the room, by actor.
  std::optional<std::size_t> present_thing(const std::string& id) const;

  /// Where people are to be at the end of the next step.
  void walk(Duration time);
  void put(const ObjectSpec& thing);

  std::vector<BodyState> states() const;
  /// What an actor covers on the floor; nothing of what is absent or hangs.
  std::vector<Outline> standing(std::size_t actor) const;
  bool hangs(const ObjectSpec& thing) const { return thing.bottom_m > tallest_m_; }
  /// Who stands in a place; `but` does not count.
  std::optional<std::size_t> occupant(const std::vector<Outline>& place, std::size_t but) const;
  /// Everything that stands on the floor, as wandering robots see it.
  Surroundings look_around() const;

 private:
  std::vector<RobotSpec> robots_;
  std::vector<Outline> outlines_;  ///< of the robots, about base_link
  std::vector<PersonSpec> people_;
  std::vector<ObjectSpec> things_;
  std::array<double, 2> room_m_;
  double tallest_m_ = 0.0;  ///< robot
};

}  // namespace skylight::sim
