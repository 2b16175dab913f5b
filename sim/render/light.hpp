// How much light falls where, and how much of it reaches which pixel.
#pragma once

#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

class Light {
 public:
  Light(const LightSpec& light, const RoomSpec& room, const CameraSpec& camera);

  /// Factor on a colour that faces up, at a place in `map`: a level that changes linearly across the room.
  float at(double x, double y) const;
  /// The same for an upright face with this normal: less, and different to each side.
  float on_side(double x, double y, const Eigen::Vector3d& normal) const;
  /// Share of the light that reaches a pixel: falls with the square of the distance from the picture's
  /// middle.
  float vignette(int x, int y) const;

 private:
  float level_;
  float half_gradient_;
  Eigen::Vector2f change_;  ///< per metre
  double middle_x_, middle_y_, falloff_;
};

}  // namespace skylight::sim
