#include "sim/render/light.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace skylight::sim {
namespace {

constexpr double kWhite = 255.0;     ///< grey levels of a matt white face in full light
constexpr double kRoughness = 0.17;  ///< rad, standard deviation of the mirrored directions
constexpr double kBelowLamp = 0.02;  ///< m, a place nearer to a lamp's plane gets none of its light

}  // namespace

Light::Light(const LightSpec& light, const RoomSpec& room, const CameraSpec& camera)
    : ambient_(1.0), half_gradient_(0.5 * light.gradient) {
  const double angle = light.gradient_deg * std::numbers::pi / 180.0;
  const double reach = 0.5 * std::hypot(room.size_m[0], room.size_m[1]);
  change_ = Eigen::Vector2d(std::cos(angle), std::sin(angle)) * (half_gradient_ / reach);
  for (const LampSpec& lamp : light.lamps) {
    lamps_.push_back(
        {{lamp.position_m[0], lamp.position_m[1], lamp.position_m[2]}, 0.5 * lamp.diameter_m, lamp.share});
    ambient_ -= lamp.share;
  }
  ambient_ = std::max(0.0, ambient_);
  middle_x_ = 0.5F * static_cast<float>(camera.width_px - 1);
  middle_y_ = 0.5F * static_cast<float>(camera.height_px - 1);
  falloff_ = static_cast<float>(camera.vignetting) / (middle_x_ * middle_x_ + middle_y_ * middle_y_ + 1e-6F);
}

double Light::at(const Eigen::Vector3d& place) const {
  const double change = change_.dot(place.head<2>());
  double sum = ambient_ * (1.0 + std::clamp(change, -half_gradient_, half_gradient_));
  for (std::size_t i = 0; i < lamps_.size(); ++i) sum += from_lamp(i, place);
  return sum;
}

double Light::from_lamp(std::size_t lamp, const Eigen::Vector3d& place) const {
  const Lamp& from = lamps_[lamp];
  const Eigen::Vector3d towards = from.position - place;
  if (towards.z() < kBelowLamp) return 0.0;
  const double below = from.position.z();
  // So near that the lamp is no small disc any more it gets no brighter.
  const double distance2 = std::max(towards.squaredNorm(), 0.04 * below * below);
  return from.share * below * below * towards.z() / (distance2 * std::sqrt(distance2));
}

double Light::mirrored(std::size_t lamp, const Eigen::Vector3d& place, const Eigen::Vector3d& to_eye,
                       double gloss) const {
  if (gloss <= 0.0 || to_eye.z() <= 0.0) return 0.0;
  const Lamp& from = lamps_[lamp];
  const Eigen::Vector3d towards = from.position - place;
  if (towards.z() < kBelowLamp) return 0.0;
  const double distance = towards.norm();
  const Eigen::Vector3d mirrored_ray(-to_eye.x(), -to_eye.y(), to_eye.z());
  const double wide = 0.5 * from.radius_m / distance;  // standard deviation of a disc along one axis
  const double variance = kRoughness * kRoughness + wide * wide;
  const double angle2 = 2.0 * std::max(0.0, 1.0 - mirrored_ray.dot(towards) / distance);
  if (angle2 > 25.0 * variance) return 0.0;
  const double cosine = towards.z() / distance;
  return gloss * kWhite * from_lamp(lamp, place) / std::max(0.1, cosine) / (2.0 * variance) *
         std::exp(-0.5 * angle2 / variance);
}

double Light::mirrored(const Eigen::Vector3d& place, const Eigen::Vector3d& to_eye, double gloss) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < lamps_.size(); ++i) sum += mirrored(i, place, to_eye, gloss);
  return sum;
}

Eigen::Vector2d Light::side_slope(const Eigen::Vector3d& place) const {
  Eigen::Vector2d slope(0.10, 0.06);  // of the light from everywhere: one side of a room is always brighter
  for (const Lamp& lamp : lamps_) {
    const Eigen::Vector3d towards = lamp.position - place;
    if (towards.z() > kBelowLamp) slope += 0.6 * lamp.share * towards.head<2>() / towards.norm();
  }
  return slope;
}

}  // namespace skylight::sim
