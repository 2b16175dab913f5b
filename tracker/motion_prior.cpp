#include "tracker/motion_prior.hpp"

#include <algorithm>
#include <cmath>

namespace skylight {

void MotionPrior::observe(const Observation& observation) {
  constexpr double kNew = 0.5;  // share of the newest difference: noise against quick turns
  Seen now{.camera = observation.camera, .pose = observation.pose, .at = observation.captured};
  const auto before =
      std::find_if(seen_.begin(), seen_.end(), [&](const Seen& each) { return each.camera == now.camera; });
  if (before != seen_.end()) {
    const double dt = to_seconds(now.at - before->at);
    if (dt > 0.0 && now.at - before->at <= config_.keep) {
      const Velocity2 moved{(now.pose.x - before->pose.x) / dt, (now.pose.y - before->pose.y) / dt,
                            wrap_angle(now.pose.yaw - before->pose.yaw) / dt};
      const Velocity2 was = before->velocity.value_or(Velocity2{});
      now.velocity = Velocity2{};
      if (std::hypot(moved.x, moved.y) <= config_.max_speed &&
          std::abs(moved.yaw_rate) <= config_.max_yaw_rate) {
        now.velocity = Velocity2{was.x + kNew * (moved.x - was.x), was.y + kNew * (moved.y - was.y),
                                 was.yaw_rate + kNew * (moved.yaw_rate - was.yaw_rate)};
      }
    }
    seen_.erase(before);
  }
  const auto later =
      std::find_if(seen_.begin(), seen_.end(), [&](const Seen& each) { return each.at > now.at; });
  seen_.insert(later, now);
}

void MotionPrior::place(const Pose2& pose, Time at) {
  seen_.assign(1, {.camera = 0, .pose = pose, .at = at});
}

std::optional<Prior> MotionPrior::at(Time time, std::size_t camera) const {
  constexpr double kRadius = 0.02;                              // m, at no gap at all
  constexpr Duration kAsGood = std::chrono::milliseconds(300);  // one's own that is so much older
  if (seen_.empty() || std::chrono::abs(time - seen_.back().at) > config_.keep) return std::nullopt;
  const Seen* from = &seen_.back();
  std::optional<Velocity2> velocity;
  for (const Seen& each : seen_) {
    if (each.camera == camera && each.at <= time && seen_.back().at - each.at <= kAsGood) from = &each;
    if (each.velocity) velocity = each.velocity;
  }
  if (from->velocity) velocity = from->velocity;
  const Velocity2 moves = velocity.value_or(Velocity2{});
  const double gap = to_seconds(time - from->at);
  const double most = to_seconds(config_.carry_on);
  const double carried = std::clamp(gap, -most, most);
  return Prior{.pose = {from->pose.x + moves.x * carried, from->pose.y + moves.y * carried,
                        wrap_angle(from->pose.yaw + moves.yaw_rate * carried)},
               .radius_m = kRadius + config_.max_speed * std::abs(gap)};
}

}  // namespace skylight
