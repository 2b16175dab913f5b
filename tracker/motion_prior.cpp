#include "tracker/motion_prior.hpp"

#include <algorithm>
#include <cmath>

namespace skylight {

void MotionPrior::observe(const Observation& observation) {
  constexpr double kNew = 0.5;  // share of the newest difference: noise against quick turns
  const double dt = last_ ? to_seconds(observation.captured - last_time_) : 0.0;
  if (last_ && dt > 0.0 && observation.captured - last_time_ <= config_.keep) {
    const Velocity2 now{(observation.pose.x - last_->x) / dt, (observation.pose.y - last_->y) / dt,
                        wrap_angle(observation.pose.yaw - last_->yaw) / dt};
    if (std::hypot(now.x, now.y) <= config_.max_speed && std::abs(now.yaw_rate) <= config_.max_yaw_rate) {
      velocity_.x += kNew * (now.x - velocity_.x);
      velocity_.y += kNew * (now.y - velocity_.y);
      velocity_.yaw_rate += kNew * (now.yaw_rate - velocity_.yaw_rate);
    } else {
      velocity_ = {};
    }
  } else {
    velocity_ = {};
  }
  last_ = observation.pose;
  last_time_ = observation.captured;
}

void MotionPrior::place(const Pose2& pose, Time at) {
  last_ = pose;
  last_time_ = at;
  velocity_ = {};
}

std::optional<Prior> MotionPrior::at(Time time) const {
  if (!last_ || time < last_time_ || time - last_time_ > config_.keep) return std::nullopt;
  constexpr double kRadius = 0.02;  // m, at no gap at all
  const double gap = to_seconds(time - last_time_);
  const double carried = std::min(gap, to_seconds(config_.carry_on));
  return Prior{.pose = {last_->x + velocity_.x * carried, last_->y + velocity_.y * carried,
                        wrap_angle(last_->yaw + velocity_.yaw_rate * carried)},
               .radius_m = kRadius + config_.max_speed * gap};
}

}  // namespace skylight
