#include "sim/lighting.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace skylight::sim {

Lighting::Lighting(const LightSpec& light, const RoomSpec& room) : room_(room) {
  changes_.push_back({Duration::zero(), Duration::zero(), light.level, light.level});
}

void Lighting::change(const LightAction& action, Duration at) {
  changes_.push_back({at, from_seconds(action.over_s), level(at), action.level});
}

void Lighting::pass(const ShadowAction& action, Duration at) {
  const double direction = action.direction_deg * std::numbers::pi / 180.0;
  const double reach = 0.5 * (std::abs(std::cos(direction)) * room_.size_m[0] +
                              std::abs(std::sin(direction)) * room_.size_m[1]);
  passing_.push_back({at, action, reach});
}

double Lighting::level(Duration time) const {
  const auto after = std::find_if(changes_.begin() + 1, changes_.end(),
                                  [&](const Change& change) { return change.at > time; });
  const Change& change = *(after - 1);
  if (time >= change.at + change.over) return change.to;
  const double part = std::max(0.0, to_seconds(time - change.at)) / to_seconds(change.over);
  return change.from + part * (change.to - change.from);
}

std::vector<PassingShadow> Lighting::shadows(Duration time) const {
  std::vector<PassingShadow> now;
  for (const Passing& passing : passing_) {
    const ShadowAction& shadow = passing.shadow;
    const double half = 0.5 * shadow.width_m;
    const double middle = -passing.reach_m - half + shadow.speed_mps * to_seconds(time - passing.at);
    if (time < passing.at || middle > passing.reach_m + half) continue;
    now.push_back({.darkness = shadow.darkness,
                   .width_m = shadow.width_m,
                   .direction_rad = shadow.direction_deg * std::numbers::pi / 180.0,
                   .centre_m = middle});
  }
  return now;
}

}  // namespace skylight::sim
