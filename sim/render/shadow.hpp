// How much of a lamp's disc a body hides from places on a level plane.
//
// Seen from a place, a solid hides that part of the cone between the place and the lamp's disc which it
// fills. At height z above the place the cone is a disc of radius R z / H around the line to the lamp's
// middle; the share of it over the solid's outline is approximated per axis (the outline's ends cut it like
// straight edges), at the heights where the line is deepest in the outline. On the floor the penumbra of an
// edge at height h is so 2 R h / (H - h) wide, as similar triangles have it.
#pragma once

#include "sim/render/lanes.hpp"
#include "sim/render/light.hpp"
#include "sim/render/look.hpp"

namespace skylight::sim {

/// A caster where it stands: the body's axes in `map`.
struct ShadowCaster {
  Caster shape;
  float cosine = 1.0F;
  float sine = 0.0F;
  float x = 0.0F;
  float y = 0.0F;
  bool operator==(const ShadowCaster&) const = default;
};

/// A lamp seen from the plane at a height.
struct LampAbove {
  float x, y;
  float height;  ///< above the plane, > 0
  float radius;
};

/// How far up (as a share of the lamp's height) a solid still keeps light off: higher ones hang beside the
/// lamp.
inline constexpr float kHighest = 0.9F;

inline LampAbove lamp_above(const Lamp& lamp, double plane_m) {
  return {static_cast<float>(lamp.position.x()), static_cast<float>(lamp.position.y()),
          static_cast<float>(lamp.position.z() - plane_m), static_cast<float>(lamp.radius_m)};
}

/// Share of a disc of radius 1 that lies below x of its middle (within 0.01 of the circle's segment).
[[gnu::always_inline]] inline F8 disc_below(const F8& x) {
  const F8 u = within(x, all(-1.0F), all(1.0F));
  const F8 u2 = u * u;
  return 0.5F + u * (0.63662F - u2 * (0.06F + u2 * 0.07662F));
}

/// Share of the disc around (x, y), of radius 1 / inverse, over the outline around the origin.
[[gnu::always_inline]] inline F8 over_outline(const F8& x, const F8& y, float half_x, float half_y,
                                              const F8& inverse) {
  const F8 along_x = disc_below((half_x - x) * inverse) - disc_below((-half_x - x) * inverse);
  const F8 along_y = disc_below((half_y - y) * inverse) - disc_below((-half_y - y) * inverse);
  return along_x * along_y;
}

/// Share of the lamp's disc that the caster hides from eight places (in `map`) on a plane.
[[gnu::always_inline]] inline F8 hidden(const ShadowCaster& caster, const LampAbove& lamp, float plane,
                                        const F8& map_x, const F8& map_y) {
  const Caster& shape = caster.shape;
  const float low = std::max(shape.low - plane, 0.0F);
  const float high = std::min(shape.high - plane, kHighest * lamp.height);
  if (low >= high) return all(0.0F);
  // In the body's axes around the caster's middle; the line to the lamp moves so far per metre of height.
  const F8 dx = map_x - caster.x;
  const F8 dy = map_y - caster.y;
  const F8 x = caster.cosine * dx + caster.sine * dy - shape.x;
  const F8 y = caster.cosine * dy - caster.sine * dx - shape.y;
  const F8 to_x = (lamp.x - map_x) / lamp.height;
  const F8 to_y = (lamp.y - map_y) / lamp.height;
  const F8 move_x = divisible(caster.cosine * to_x + caster.sine * to_y, 1e-6F);
  const F8 move_y = divisible(caster.cosine * to_y - caster.sine * to_x, 1e-6F);
  const F8 lows = all(low);
  const F8 highs = all(high);
  const float wider = lamp.radius / lamp.height;
  if (shape.round) {
    const F8 z = within(-(x * move_x + y * move_y) / (move_x * move_x + move_y * move_y), lows, highs);
    const F8 nx = x + z * move_x;
    const F8 ny = y + z * move_y;
    const F8 distance = root(nx * nx + ny * ny);
    const F8 inverse = 1.0F / most(z * wider, all(1e-4F));
    return disc_below((shape.half_x - distance) * inverse) - disc_below((-shape.half_x - distance) * inverse);
  }
  const F8 x1 = (-shape.half_x - x) / move_x;
  const F8 x2 = (shape.half_x - x) / move_x;
  const F8 y1 = (-shape.half_y - y) / move_y;
  const F8 y2 = (shape.half_y - y) / move_y;
  const F8 enter = most(most(least(x1, x2), least(y1, y2)), lows);
  const F8 leave = least(least(most(x1, x2), most(y1, y2)), highs);
  F8 share = all(0.0F);
  for (int i = 0; i < 3; ++i) {
    const F8 z = within(i == 0 ? enter : (i == 1 ? leave : 0.5F * (enter + leave)), lows, highs);
    const F8 inverse = 1.0F / most(z * wider, all(1e-4F));
    share = most(share, over_outline(x + z * move_x, y + z * move_y, shape.half_x, shape.half_y, inverse));
  }
  return share;
}

/// What is left of the floor's light beside a body that stands on it: nothing of the light from everywhere
/// comes through it, so it is darkest at its foot.
inline constexpr float kContactReach = 0.06F;  ///< m

inline bool touches_floor(const Caster& shape) {
  return shape.low < 0.05F;
}

[[gnu::always_inline]] inline F8 contact_left(const ShadowCaster& caster, float darkness, const F8& map_x,
                                              const F8& map_y) {
  const Caster& shape = caster.shape;
  const F8 dx = map_x - caster.x;
  const F8 dy = map_y - caster.y;
  const F8 x = caster.cosine * dx + caster.sine * dy - shape.x;
  const F8 y = caster.cosine * dy - caster.sine * dx - shape.y;
  F8 distance;
  if (shape.round) {
    distance = most(root(x * x + y * y) - shape.half_x, all(0.0F));
  } else {
    const F8 beside = most(most(x, -x) - shape.half_x, all(0.0F));
    const F8 before = most(most(y, -y) - shape.half_y, all(0.0F));
    distance = root(beside * beside + before * before);
  }
  const F8 closeness = most(1.0F - distance / kContactReach, all(0.0F));
  return 1.0F - darkness * closeness * closeness;
}

}  // namespace skylight::sim
