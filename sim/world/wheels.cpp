#include "sim/world/wheels.hpp"

#include <cmath>
#include <numbers>

namespace skylight::sim {

Wheels::Wheels(const RobotModel& model) : model_(&model), count_(model.holonomic ? 4 : 2) {
  const double arm = 0.5 * model.wheel_separation_m;
  places_.fill(Eigen::Vector2d::Zero());
  rolls_.fill(Eigen::Vector2d::Zero());
  for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) {
    if (model.holonomic) {
      const double angle = (0.25 + 0.5 * static_cast<double>(i)) * std::numbers::pi;
      places_[i] = arm * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      rolls_[i] = {-std::sin(angle), std::cos(angle)};
    } else {
      places_[i] = {0.0, i == 0 ? arm : -arm};  // left, right
      rolls_[i] = {1.0, 0.0};
    }
  }
}

Eigen::Vector4d Wheels::speeds(const BodyMotion& motion) const {
  Eigen::Vector4d speeds = Eigen::Vector4d::Zero();
  for (int i = 0; i < count_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector2d& at = places_[k];
    speeds[i] = rolls_[k].dot(motion.head<2>() + motion.z() * Eigen::Vector2d(-at.y(), at.x()));
  }
  return speeds;
}

BodyMotion Wheels::motion(const Eigen::Vector4d& speeds) const {
  if (!model_->holonomic)
    return {0.5 * (speeds[0] + speeds[1]), 0.0, (speeds[1] - speeds[0]) / model_->wheel_separation_m};
  // Directions along the ring sum to two in each axis and to nothing crosswise: half the sum is the inverse.
  BodyMotion motion = BodyMotion::Zero();
  for (int i = 0; i < 4; ++i) {
    motion.head<2>() += 0.5 * speeds[i] * rolls_[static_cast<std::size_t>(i)];
    motion.z() += speeds[i] / (2.0 * model_->wheel_separation_m);
  }
  return motion;
}

std::array<Eigen::Vector2d, 4> Wheels::impulses(const BodyMotion& change) const {
  // An impulse (jx, jy) at base_link and a turning impulse l about it change its motion by
  //   jx / m,   jy / m + r (l + jy r) / I,   (l + jy r) / I     with r from the centre of mass to base_link.
  const double r = -model_->centre_of_mass_x_m;
  const double spin = model_->yaw_inertia_kgm2 * change.z();  // l + jy r
  const Eigen::Vector2d j(model_->mass_kg * change.x(), model_->mass_kg * (change.y() - r * change.z()));
  const double l = spin - j.y() * r;
  const double arm = 0.5 * model_->wheel_separation_m;
  std::array<Eigen::Vector2d, 4> result;
  result.fill(Eigen::Vector2d::Zero());
  if (!model_->holonomic) {
    result[0] = {0.5 * (j.x() - l / arm), 0.5 * j.y()};
    result[1] = {0.5 * (j.x() + l / arm), 0.5 * j.y()};
    return result;
  }
  for (std::size_t i = 0; i < 4; ++i) result[i] = (0.5 * rolls_[i].dot(j) + 0.25 * l / arm) * rolls_[i];
  return result;
}

Eigen::Vector2d Wheels::within_grip(const Eigen::Vector2d& impulse, double load_ns) const {
  const double used = model_->holonomic ? impulse.norm() / model_->rolling_friction
                                        : std::hypot(impulse.x() / model_->rolling_friction,
                                                     impulse.y() / model_->lateral_friction);
  return used > load_ns ? Eigen::Vector2d(impulse * (load_ns / used)) : impulse;
}

}  // namespace skylight::sim
