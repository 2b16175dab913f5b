#include "sim/world/timeline.hpp"

#include <algorithm>
#include <utility>

namespace skylight::sim {

Timeline::Timeline(std::vector<BodyState> at_start) {
  append(std::move(at_start));
}

void Timeline::append(std::vector<BodyState> states, std::vector<Touch> touches) {
  steps_.push_back({std::move(states), std::move(touches)});
}

void Timeline::forget_before(Duration time) {
  const std::int64_t keep = time / World::kStep - 1;
  while (first_ < keep && steps_.size() > 2) {
    steps_.pop_front();
    ++first_;
  }
}

Duration Timeline::end() const {
  return (first_ + static_cast<std::int64_t>(steps_.size()) - 1) * World::kStep;
}

BodyState Timeline::at(std::size_t actor, Duration time) const {
  // In whole nanoseconds: at a step's own time it is that step's state.
  const auto last = static_cast<std::int64_t>(steps_.size()) - 1;
  const std::int64_t step = std::clamp<std::int64_t>(time / World::kStep - first_, 0, last);
  const auto i = static_cast<std::size_t>(step);
  const double part =
      step < last
          ? std::clamp(to_seconds(time - (first_ + step) * World::kStep) / to_seconds(World::kStep), 0.0, 1.0)
          : 0.0;
  const auto state_at = [&](std::size_t k) {
    const auto& states = steps_[k].states;
    return actor < states.size() ? states[actor] : BodyState{.present = false};
  };
  if (part >= 1.0) return state_at(i + 1);
  const BodyState a = state_at(i);
  if (part <= 0.0) return a;
  const BodyState b = state_at(i + 1);
  if (a.present != b.present || b.placed) return a;
  BodyState state;
  state.pose.x = a.pose.x + part * (b.pose.x - a.pose.x);
  state.pose.y = a.pose.y + part * (b.pose.y - a.pose.y);
  state.pose.yaw = wrap_angle(a.pose.yaw + part * wrap_angle(b.pose.yaw - a.pose.yaw));
  state.velocity.x = a.velocity.x + part * (b.velocity.x - a.velocity.x);
  state.velocity.y = a.velocity.y + part * (b.velocity.y - a.velocity.y);
  state.velocity.yaw_rate = a.velocity.yaw_rate + part * (b.velocity.yaw_rate - a.velocity.yaw_rate);
  state.present = a.present;
  return state;
}

std::vector<std::size_t> Timeline::touches(std::size_t actor, Duration time) const {
  const std::int64_t last = first_ + static_cast<std::int64_t>(steps_.size()) - 1;
  const std::int64_t step = std::clamp<std::int64_t>(time / World::kStep, first_, last);
  std::vector<std::size_t> others;
  for (const Touch& touch : steps_[static_cast<std::size_t>(step - first_)].touches) {
    if (touch.a == actor) others.push_back(touch.b);
    if (touch.b == actor) others.push_back(touch.a);
  }
  std::sort(others.begin(), others.end());
  return others;
}

}  // namespace skylight::sim
