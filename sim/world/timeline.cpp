#include "sim/world/timeline.hpp"

#include <algorithm>
#include <utility>

namespace skylight::sim {

Timeline::Timeline(std::vector<BodyState> at_start) {
  steps_.push_back(std::move(at_start));
}

void Timeline::append(std::vector<BodyState> states) {
  steps_.push_back(std::move(states));
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

BodyState Timeline::at(std::size_t robot, Duration time) const {
  const double place = to_seconds(time) / to_seconds(World::kStep) - static_cast<double>(first_);
  const double last = static_cast<double>(steps_.size()) - 2.0;
  const double index = std::clamp(std::floor(place), 0.0, std::max(0.0, last));
  const auto i = static_cast<std::size_t>(index);
  const BodyState& a = steps_[i].at(robot);
  if (i + 1 >= steps_.size()) return a;
  const BodyState& b = steps_[i + 1].at(robot);
  const double part = std::clamp(place - index, 0.0, 1.0);
  BodyState state;
  state.pose.x = a.pose.x + part * (b.pose.x - a.pose.x);
  state.pose.y = a.pose.y + part * (b.pose.y - a.pose.y);
  state.pose.yaw = wrap_angle(a.pose.yaw + part * wrap_angle(b.pose.yaw - a.pose.yaw));
  state.velocity.x = a.velocity.x + part * (b.velocity.x - a.velocity.x);
  state.velocity.y = a.velocity.y + part * (b.velocity.y - a.velocity.y);
  state.velocity.yaw_rate = a.velocity.yaw_rate + part * (b.velocity.yaw_rate - a.velocity.yaw_rate);
  return state;
}

}  // namespace skylight::sim
