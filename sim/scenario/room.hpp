// The room and what stands in it: floor, walls, light, fixed and movable things.
//
// Keys carry their unit (_m, _mps, _deg, _s). Angles are degrees here, as people write them, and radians
// everywhere else in sim. `map` has its origin on the floor in the middle of the room, x along size_m[0].
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace skylight::sim {

/// Red, green, blue as a linear sensor sees them under the room's light, 0 to 255.
using Color = std::array<double, 3>;

enum class FloorMaterial : std::uint8_t { plain, tiles, speckle, concrete, wood, picture };

/// A part of the floor with another grip: a wet patch, a mat.
struct FrictionZone {
  std::array<double, 2> min_m{0.0, 0.0};
  std::array<double, 2> max_m{1.0, 1.0};
  double friction = 0.3;  ///< replaces the floor's factor there
};

/// An AprilTag that lies on the floor, flat: nothing bumps into it.
struct FloorTagSpec {
  std::string family = "36h11";
  int id = 0;
  double size_m = 0.2;  ///< between the corners that a detector reports: the border's outer edge
  double x_m = 0.0;     ///< of its middle
  double y_m = 0.0;
  double yaw_deg = 0.0;  ///< of its x axis (to the right in the upright tag) from map x, counter-clockwise
};

struct FloorSpec {
  FloorMaterial material = FloorMaterial::tiles;
  Color color_rgb{128.0, 126.0, 120.0};
  double contrast = 0.35;                    ///< strength of the pattern, 0 (flat) to 1
  double tile_m = 0.5;                       ///< edge of a tile (tiles), length of a plank (wood)
  int cables = 0;                            ///< lying about at random
  std::string picture;                       ///< image file (material picture), repeated over the floor
  double picture_width_m = 1;                ///< width of one copy of the picture on the floor
  double gloss = 0.05;                       ///< share of the lamps' light that it mirrors, 0 (matt) to 1
  double friction = 1.0;                     ///< factor on the tyres' friction, 0 to 2 (1: dry, clean)
  std::vector<FrictionZone> friction_zones;  ///< the last that covers a place counts
  std::vector<FloorTagSpec> tags;            ///< the later lie over the earlier
};

struct RoomSpec {
  std::array<double, 2> size_m{6.0, 6.0};
  double wall_height_m = 0.3;
  Color wall_rgb{168.0, 164.0, 156.0};
  FloorSpec floor;
};

/// A round lamp. What stands between it and the floor throws a soft shadow: the share of the lamp's disc
/// that a place cannot see.
struct LampSpec {
  std::array<double, 3> position_m{1.5, 1.0, 2.8};
  double diameter_m = 0.6;
  double share = 0.35;  ///< of the light on the floor right below it; the rest comes from everywhere
};

/// Mains light goes bright and dark at twice the mains frequency.
struct FlickerSpec {
  double depth = 0.02;  ///< (brightest - darkest) / (brightest + darkest), 0 to 1
  double frequency_hz = 100.0;
};

struct LightSpec {
  double level = 1.0;            ///< factor on every colour, 0 (dark) to 4
  double gradient = 0.08;        ///< change of the light across the room, as a share, half of it to each side
  double gradient_deg = 35.0;    ///< direction in `map` towards which it grows
  double contact_shadow = 0.55;  ///< share of the light missing right under a robot's edge, 0 to 1
  std::vector<LampSpec> lamps{LampSpec{}};
  FlickerSpec flicker;
};

enum class BodyShape : std::uint8_t { box, cylinder };

/// A thing in the room: an obstacle on the floor, a beam or lamp above it.
struct ObjectSpec {
  std::string id;
  BodyShape shape = BodyShape::box;
  std::array<double, 3> size_m{0.3, 0.3, 0.2};  ///< along its own x and y, and upwards
  double x_m = 0.0;                             ///< of its middle
  double y_m = 0.0;
  double yaw_deg = 0.0;
  double bottom_m = 0.0;  ///< of its lower side above the floor; above 0 it hangs and nothing bumps into it
  Color color_rgb{120.0, 96.0, 70.0};
  bool pushable = false;  ///< robots can push it; else it stands like a wall
  double mass_kg = 1.0;   ///< of a pushable one
  double friction = 0.5;  ///< of a pushable one on the floor
};

/// Somebody who walks through, from place to place; robots bump into his feet.
struct PersonSpec {
  std::string id;
  std::vector<std::array<double, 2>> path_m;
  double speed_mps = 1.2;
  double start_s = 0.0;  ///< enters then; before it and after the path's end he is not there
  bool loop = false;     ///< from the last point back to the first, for ever
  double height_m = 1.75;
  Color color_rgb{60.0, 70.0, 110.0};
};

}  // namespace skylight::sim
