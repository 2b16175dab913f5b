// How much light falls where, and how much of it reaches which pixel. Nominal light: its level and flicker
// are the sensor's business.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

/// A round lamp that shines downwards, in `map`.
struct Lamp {
  Eigen::Vector3d position;
  double radius_m = 0.3;
  double share = 0.35;  ///< of the light on the floor right below it
};

class Light {
 public:
  Light(const LightSpec& light, const RoomSpec& room, const CameraSpec& camera);

  const std::vector<Lamp>& lamps() const { return lamps_; }

  /// Factor on a colour that faces up, at a place in `map`: light from everywhere (its level changes linearly
  /// across the room) and from all lamps.
  double at(const Eigen::Vector3d& place) const;
  /// The part of it that comes from one lamp. Irradiance by a disc that is small against its distance:
  /// share cos^3 of the angle from the vertical, times (H / h)^2 for a place at h instead of H below it.
  double from_lamp(std::size_t lamp, const Eigen::Vector3d& place) const;
  /// What a smooth upward face adds by mirroring a lamp, in grey levels, towards an eye in this (unit)
  /// direction from it: the lamp's light spread over a Gaussian lobe of the surface's roughness and the
  /// lamp's own width around the mirrored ray.
  double mirrored(std::size_t lamp, const Eigen::Vector3d& place, const Eigen::Vector3d& to_eye,
                  double gloss) const;
  /// The same of all lamps.
  double mirrored(const Eigen::Vector3d& place, const Eigen::Vector3d& to_eye, double gloss) const;

  /// An upright face, relative to one that faces up at the same place: middle + slope . normal, less on all
  /// sides, and different to each.
  static constexpr double kSide = 0.6;
  /// Horizontal; towards the lamps as they are seen from this place.
  Eigen::Vector2d side_slope(const Eigen::Vector3d& place) const;

  /// Share of the light that reaches a pixel: falls with the square of the distance from the picture's
  /// middle.
  float vignette(int x, int y) const {
    const float u = static_cast<float>(x) - middle_x_;
    const float v = static_cast<float>(y) - middle_y_;
    return 1.0F - falloff_ * (u * u + v * v);
  }

 private:
  double ambient_;
  double half_gradient_;
  Eigen::Vector2d change_;  ///< per metre
  std::vector<Lamp> lamps_;
  float middle_x_, middle_y_, falloff_;
};

}  // namespace skylight::sim
