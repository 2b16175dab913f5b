#include "sim/render/light.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace skylight::sim {

Light::Light(const LightSpec& light, const RoomSpec& room, const CameraSpec& camera)
    : level_(static_cast<float>(light.level)), half_gradient_(static_cast<float>(0.5 * light.gradient)) {
  const double angle = light.gradient_deg * std::numbers::pi / 180.0;
  const double reach = 0.5 * std::hypot(room.size_m[0], room.size_m[1]);
  change_ =
      (Eigen::Vector2d(std::cos(angle), std::sin(angle)) * (0.5 * light.gradient / reach)).cast<float>();
  middle_x_ = 0.5 * (camera.width_px - 1);
  middle_y_ = 0.5 * (camera.height_px - 1);
  falloff_ = camera.vignetting / (middle_x_ * middle_x_ + middle_y_ * middle_y_);
}

float Light::at(double x, double y) const {
  const float change = change_.x() * static_cast<float>(x) + change_.y() * static_cast<float>(y);
  return level_ * (1.0F + std::clamp(change, -half_gradient_, half_gradient_));
}

float Light::on_side(double x, double y, const Eigen::Vector3d& normal) const {
  return at(x, y) * static_cast<float>(0.6 + 0.10 * normal.x() + 0.06 * normal.y());
}

float Light::vignette(int x, int y) const {
  const double u = x - middle_x_;
  const double v = y - middle_y_;
  return static_cast<float>(1.0 - falloff_ * (u * u + v * v));
}

}  // namespace skylight::sim
