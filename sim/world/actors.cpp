#include "sim/world/actors.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "sim/world/surroundings.hpp"
#include "sim/world/walk.hpp"

namespace skylight::sim {
namespace {

constexpr double kDegree = 180.0 / std::numbers::pi;

}  // namespace

Actors::Actors(const Scenario& scenario)
    : world(scenario.room, all_robots(scenario)),
      robots_(all_robots(scenario)),
      people_(scenario.people),
      room_m_(scenario.room.size_m) {
  for (const RobotSpec& robot : robots_) {
    outlines_.push_back(robot_outline(robot_model(robot.model)));
    for (const Solid& solid : robot_model(robot.model).solids)
      tallest_m_ = std::max(tallest_m_, solid.max.z());
  }
  for (std::size_t i = 0; i < people_.size(); ++i) world.add_person();
  walk({});
  for (const ObjectSpec& thing : scenario.objects) put(thing);
}

const std::string& Actors::id(std::size_t actor) const {
  if (actor < robots_.size()) return robots_[actor].id;
  if (actor < thing(0)) return people_[actor - robots_.size()].id;
  return things_.at(actor - thing(0)).id;
}

std::size_t Actors::robot(const std::string& id) const {
  const auto at =
      std::find_if(robots_.begin(), robots_.end(), [&](const RobotSpec& robot) { return robot.id == id; });
  return static_cast<std::size_t>(at - robots_.begin());
}

std::optional<std::size_t> Actors::present_thing(const std::string& id) const {
  for (std::size_t i = 0; i < things_.size(); ++i) {
    if (things_[i].id == id && world.state(thing(i)).present) return thing(i);
  }
  return std::nullopt;
}

void Actors::walk(Duration time) {
  for (std::size_t i = 0; i < people_.size(); ++i) world.walk(person(i), person_at(people_[i], time));
}

void Actors::put(const ObjectSpec& thing) {
  world.add_thing(thing);
  things_.push_back(thing);
}

std::vector<BodyState> Actors::states() const {
  std::vector<BodyState> result;
  result.reserve(count());
  for (std::size_t i = 0; i < count(); ++i) result.push_back(world.state(i));
  return result;
}

std::vector<Outline> Actors::standing(std::size_t actor) const {
  const BodyState state = world.state(actor);
  if (!state.present) return {};
  const StartSpec at{state.pose.x, state.pose.y, state.pose.yaw * kDegree};
  if (actor < robots_.size()) {
    const RobotModel& model = robot_model(robots_[actor].model);
    if (model.round_radius_m > 0.0) return {circle_outline(state.pose.position(), model.round_radius_m)};
    return outlines(model, at);
  }
  if (actor < thing(0)) return {circle_outline(state.pose.position(), kPersonRadius)};
  ObjectSpec spec = things_[actor - thing(0)];
  if (hangs(spec)) return {};
  spec.x_m = at.x_m;
  spec.y_m = at.y_m;
  spec.yaw_deg = at.yaw_deg;
  return {outline(spec)};
}

std::optional<std::size_t> Actors::occupant(const std::vector<Outline>& place, std::size_t but) const {
  for (std::size_t i = 0; i < count(); ++i) {
    if (i != but && overlap(place, standing(i))) return i;
  }
  return std::nullopt;
}

Surroundings Actors::look_around() const {
  Surroundings result{room_m_, {}};
  for (std::size_t i = 0; i < count(); ++i) {
    const BodyState state = world.state(i);
    if (!state.present) continue;
    auto parts = i < robots_.size() ? std::vector<Outline>{placed(outlines_[i], state.pose)} : standing(i);
    if (parts.empty()) continue;
    result.obstacles.push_back(
        make_obstacle(i, std::move(parts.front()), {state.velocity.x, state.velocity.y}));
  }
  return result;
}

}  // namespace skylight::sim
