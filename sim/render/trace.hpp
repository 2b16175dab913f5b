// Eight rays at a time against the solids of a body; the same formulas as solids.hpp has for one ray.
#pragma once

#include <limits>

#include "sim/render/lanes.hpp"
#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {

/// In the body frame.
struct alignas(32) RayLanes {
  F8 eye_x, eye_y, eye_z;
  F8 x, y, z;                          ///< direction, of any length
  F8 inverse_x, inverse_y, inverse_z;  ///< one over it
};

[[gnu::always_inline]] inline void invert(RayLanes& ray) {
  constexpr float kSmallest = 1e-12F;
  ray.inverse_x = 1.0F / divisible(ray.x, kSmallest);
  ray.inverse_y = 1.0F / divisible(ray.y, kSmallest);
  ray.inverse_z = 1.0F / divisible(ray.z, kSmallest);
}

/// What each ray meets first.
struct alignas(32) HitLanes {
  F8 distance = all(std::numeric_limits<float>::max());  ///< in units of the ray's direction
  I8 solid = I8{} - 1;                                   ///< the number it was given; -1: nothing
  I8 top = I8{};                                         ///< mask: an upper (or lower) side
  F8 a{}, b{};  ///< top: x and y of the place, body frame; else x and y of the normal
};

inline constexpr float kNearest = 1e-6F;

[[gnu::always_inline]] inline void meet_box(const Solid& box, const RayLanes& ray, int number,
                                            HitLanes& hit) {
  const F8 x1 = (static_cast<float>(box.min.x()) - ray.eye_x) * ray.inverse_x;
  const F8 x2 = (static_cast<float>(box.max.x()) - ray.eye_x) * ray.inverse_x;
  const F8 y1 = (static_cast<float>(box.min.y()) - ray.eye_y) * ray.inverse_y;
  const F8 y2 = (static_cast<float>(box.max.y()) - ray.eye_y) * ray.inverse_y;
  const F8 z1 = (static_cast<float>(box.min.z()) - ray.eye_z) * ray.inverse_z;
  const F8 z2 = (static_cast<float>(box.max.z()) - ray.eye_z) * ray.inverse_z;
  const F8 near_x = least(x1, x2);
  const F8 near_y = least(y1, y2);
  const F8 near_z = least(z1, z2);
  const F8 near_side = most(near_x, near_y);
  const F8 enter = most(near_side, near_z);
  const F8 leave = least(least(most(x1, x2), most(y1, y2)), most(z1, z2));
  const I8 met = (enter <= leave) & (enter < hit.distance) & (enter > kNearest);
  const I8 top = near_z >= near_side;
  const I8 is_x = near_x > near_y;
  const F8 one = all(1.0F);
  const F8 normal_x = only(is_x, ray.x > 0.0F ? -one : one);
  const F8 normal_y = only(~is_x, ray.y > 0.0F ? -one : one);
  hit.a = met ? (top ? ray.eye_x + enter * ray.x : normal_x) : hit.a;
  hit.b = met ? (top ? ray.eye_y + enter * ray.y : normal_y) : hit.b;
  hit.distance = met ? enter : hit.distance;
  hit.solid = met ? I8{} + number : hit.solid;
  hit.top = met ? top : hit.top;
}

/// Upright: its upper (or lower) side by its plane, its mantle by where the ray comes nearest to the axis.
[[gnu::always_inline]] inline void meet_cylinder(const Solid& solid, const RayLanes& ray, int number,
                                                 HitLanes& hit) {
  const auto radius = static_cast<float>(0.5 * (solid.max.x() - solid.min.x()));
  const F8 x = ray.eye_x - static_cast<float>(0.5 * (solid.min.x() + solid.max.x()));
  const F8 y = ray.eye_y - static_cast<float>(0.5 * (solid.min.y() + solid.max.y()));
  const auto low = static_cast<float>(solid.min.z());
  const auto high = static_cast<float>(solid.max.z());
  const F8 cap = ((ray.z < 0.0F ? all(high) : all(low)) - ray.eye_z) * ray.inverse_z;
  const F8 cap_x = x + cap * ray.x;
  const F8 cap_y = y + cap * ray.y;
  const I8 met_cap =
      (cap_x * cap_x + cap_y * cap_y <= radius * radius) & (cap < hit.distance) & (cap > kNearest);
  hit.a = met_cap ? ray.eye_x + cap * ray.x : hit.a;
  hit.b = met_cap ? ray.eye_y + cap * ray.y : hit.b;
  hit.distance = met_cap ? cap : hit.distance;
  hit.solid = met_cap ? I8{} + number : hit.solid;
  hit.top = met_cap ? I8{} - 1 : hit.top;

  const F8 across2 = ray.x * ray.x + ray.y * ray.y;
  const F8 inverse = 1.0F / most(across2, all(1e-20F));
  const F8 nearest = -(x * ray.x + y * ray.y) * inverse;
  const F8 near_x = x + nearest * ray.x;
  const F8 near_y = y + nearest * ray.y;
  const F8 chord2 = (radius * radius - (near_x * near_x + near_y * near_y)) * inverse;
  const F8 enter = nearest - root(most(chord2, all(0.0F)));
  const F8 height = ray.eye_z + enter * ray.z;
  const I8 met =
      (chord2 >= 0.0F) & (enter < hit.distance) & (enter > kNearest) & (height >= low) & (height <= high);
  hit.a = met ? (x + enter * ray.x) / radius : hit.a;
  hit.b = met ? (y + enter * ray.y) / radius : hit.b;
  hit.distance = met ? enter : hit.distance;
  hit.solid = met ? I8{} + number : hit.solid;
  hit.top = met ? I8{} : hit.top;
}

/// A wheel's axis is the body's y: its sides by their planes, its tread as the mantle above.
[[gnu::always_inline]] inline void meet_wheel(const Solid& solid, const RayLanes& ray, int number,
                                              HitLanes& hit) {
  const auto radius = static_cast<float>(0.5 * (solid.max.x() - solid.min.x()));
  const F8 x = ray.eye_x - static_cast<float>(0.5 * (solid.min.x() + solid.max.x()));
  const F8 z = ray.eye_z - static_cast<float>(0.5 * (solid.min.z() + solid.max.z()));
  const auto low = static_cast<float>(solid.min.y());
  const auto high = static_cast<float>(solid.max.y());
  const F8 cap = ((ray.y < 0.0F ? all(high) : all(low)) - ray.eye_y) * ray.inverse_y;
  const F8 cap_x = x + cap * ray.x;
  const F8 cap_z = z + cap * ray.z;
  const I8 met_cap =
      (cap_x * cap_x + cap_z * cap_z <= radius * radius) & (cap < hit.distance) & (cap > kNearest);
  const F8 one = all(1.0F);
  hit.a = met_cap ? all(0.0F) : hit.a;
  hit.b = met_cap ? (ray.y < 0.0F ? one : -one) : hit.b;
  hit.distance = met_cap ? cap : hit.distance;
  hit.solid = met_cap ? I8{} + number : hit.solid;
  hit.top = met_cap ? I8{} : hit.top;

  const F8 across2 = ray.x * ray.x + ray.z * ray.z;
  const F8 inverse = 1.0F / most(across2, all(1e-20F));
  const F8 nearest = -(x * ray.x + z * ray.z) * inverse;
  const F8 near_x = x + nearest * ray.x;
  const F8 near_z = z + nearest * ray.z;
  const F8 chord2 = (radius * radius - (near_x * near_x + near_z * near_z)) * inverse;
  const F8 enter = nearest - root(most(chord2, all(0.0F)));
  const F8 along = ray.eye_y + enter * ray.y;
  const I8 met =
      (chord2 >= 0.0F) & (enter < hit.distance) & (enter > kNearest) & (along >= low) & (along <= high);
  hit.a = met ? (x + enter * ray.x) / radius : hit.a;
  hit.b = met ? all(0.0F) : hit.b;
  hit.distance = met ? enter : hit.distance;
  hit.solid = met ? I8{} + number : hit.solid;
  hit.top = met ? I8{} : hit.top;
}

[[gnu::always_inline]] inline void meet(const Solid& solid, const RayLanes& ray, int number, HitLanes& hit) {
  switch (solid.kind) {
    case SolidKind::box:
      meet_box(solid, ray, number, hit);
      break;
    case SolidKind::cylinder:
      meet_cylinder(solid, ray, number, hit);
      break;
    case SolidKind::wheel:
      meet_wheel(solid, ray, number, hit);
      break;
  }
}

}  // namespace skylight::sim
