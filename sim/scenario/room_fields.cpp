// The keys of the room: floor, walls, light, things in it.
#include "settings/fields.hpp"
#include "sim/scenario/fields.hpp"

namespace skylight::sim {

using settings::Fields;

void describe(Fields& fields, FrictionZone& zone) {
  fields.about("A rectangle of the floor with another grip.");
  fields.field("min_m", zone.min_m,
               {.min = -200, .max = 200, .unit = "m", .help = "Its corner with the smallest x and y."});
  fields.field("max_m", zone.max_m,
               {.min = -200, .max = 200, .unit = "m", .help = "Its corner with the largest x and y."});
  fields.field("friction", zone.friction,
               {.min = 0, .max = 2, .help = "In place of the floor's factor; 0.1 is ice."});
  fields.check(zone.min_m[0] < zone.max_m[0] && zone.min_m[1] < zone.max_m[1], "max_m",
               "must be greater than min_m, in x and in y");
}

void describe(Fields& fields, FloorTagSpec& tag) {
  fields.about("An AprilTag that lies on the floor, flat: nothing bumps into it.");
  fields.field("family", tag.family,
               {.pattern = "^(36h11|25h9|16h5|Standard41h12)$",
                .pattern_words = "36h11, 25h9, 16h5 or Standard41h12",
                .help = "Family of the tag."});
  fields.field("id", tag.id, {.min = 0, .max = 2114, .help = "Number within the family."});
  fields.field("size_m", tag.size_m,
               {.min = 0.01, .max = 10, .unit = "m", .help = "Outer edge of its border."});
  fields.field("x_m", tag.x_m, {.min = -200, .max = 200, .unit = "m", .help = "Its middle in map."});
  fields.field("y_m", tag.y_m, {.min = -200, .max = 200, .unit = "m", .help = "Its middle in map."});
  fields.field("yaw_deg", tag.yaw_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "0: upright where map y is up."});
}

void describe(Fields& fields, FloorSpec& floor) {
  fields.about("The floor within the walls.");
  fields.choice("material", floor.material,
                {{"plain", FloorMaterial::plain},
                 {"tiles", FloorMaterial::tiles},
                 {"speckle", FloorMaterial::speckle},
                 {"concrete", FloorMaterial::concrete},
                 {"wood", FloorMaterial::wood},
                 {"picture", FloorMaterial::picture}},
                {.help = "What it is made of; picture repeats an image file."});
  fields.field("color_rgb", floor.color_rgb,
               {.min = 0, .max = 255, .help = "Red, green, blue as the sensor sees them."});
  fields.field("contrast", floor.contrast,
               {.min = 0, .max = 1, .help = "Strength of the material's pattern."});
  fields.field("tile_m", floor.tile_m,
               {.min = 0.02, .max = 10, .unit = "m", .help = "Edge of a tile, length of a plank."});
  fields.field("cables", floor.cables,
               {.min = 0, .max = 100, .help = "Cables that lie about (flat: nothing bumps into them)."});
  fields.field("picture", floor.picture,
               {.help = "Image file (material picture), relative to the scenario file."});
  fields.field(
      "picture_width_m", floor.picture_width_m,
      {.min = 0.01, .max = 200, .unit = "m", .help = "Width of one copy of the picture on the floor."});
  fields.field("gloss", floor.gloss,
               {.min = 0, .max = 1, .help = "Share of the lamps' light that it mirrors; 0 is matt."});
  fields.field("friction", floor.friction,
               {.min = 0, .max = 2, .help = "Factor on the tyres' friction; 1 is dry and clean."});
  fields.field(
      "friction_zones", floor.friction_zones,
      {.max_items = 1000, .help = "Where the grip is another; the last one that covers a place counts."});
  fields.field("tags", floor.tags,
               {.max_items = 1000, .help = "Tags that lie about, as those that a camera is calibrated by."});
  fields.check((floor.material == FloorMaterial::picture) == !floor.picture.empty(), "picture",
               "an image file goes with the material picture, and only with it");
}

void describe(Fields& fields, RoomSpec& room) {
  fields.about("The room. The origin of `map` is on the floor in its middle, x along size_m[0].");
  fields.field("size_m", room.size_m,
               {.min = 0.5, .max = 200, .unit = "m", .help = "Extent of the floor along x and y."});
  fields.field("wall_height_m", room.wall_height_m,
               {.min = 0, .max = 10, .unit = "m", .help = "0: walls that stop robots but are not seen."});
  fields.field("wall_rgb", room.wall_rgb, {.min = 0, .max = 255, .help = "Red, green, blue of the walls."});
  fields.field("floor", room.floor);
}

void describe(Fields& fields, LampSpec& lamp) {
  fields.about("A round lamp. What stands under it throws a soft shadow; glossy tops and floors mirror it.");
  fields.field(
      "position_m", lamp.position_m,
      {.min = -200, .max = 200, .unit = "m", .help = "Its middle in map: x, y, height above the floor."});
  fields.field("diameter_m", lamp.diameter_m,
               {.min = 0.01, .max = 10, .unit = "m", .help = "The wider, the softer its shadows."});
  fields.field("share", lamp.share,
               {.min = 0,
                .max = 1,
                .help = "Of the light on the floor right below it; the rest comes from everywhere."});
  fields.check(lamp.position_m[2] >= 0.5, "position_m[2]", "a lamp must hang at least 0.5 m above the floor");
}

void describe(Fields& fields, FlickerSpec& flicker) {
  fields.about("Light that follows the mains: bright and dark at twice its frequency.");
  fields.field("depth", flicker.depth,
               {.min = 0, .max = 1, .help = "(Brightest - darkest) / (brightest + darkest); 0: steady."});
  fields.field("frequency_hz", flicker.frequency_hz,
               {.above = 0, .max = 10000, .unit = "Hz", .help = "100 where the mains have 50 Hz."});
}

void describe(Fields& fields, LightSpec& light) {
  fields.about("The light: evenly from above, and from lamps.");
  fields.field("level", light.level, {.min = 0, .max = 4, .help = "Factor on every colour; 0 is dark."});
  fields.field("gradient", light.gradient,
               {.min = 0, .max = 1, .help = "Change of the light across the room, as a share."});
  fields.field("gradient_deg", light.gradient_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "Direction in map towards which it grows."});
  fields.field("contact_shadow", light.contact_shadow,
               {.min = 0, .max = 1, .help = "Share of the light missing at a robot's foot."});
  fields.field("lamps", light.lamps,
               {.max_items = 8, .help = "Lamps; their shares must not add up to more than 1."});
  fields.field("flicker", light.flicker);
  double shares = 0.0;
  for (const LampSpec& lamp : light.lamps) shares += lamp.share;
  fields.check(shares <= 1.0 + 1e-9, "lamps", "their shares add up to more than 1");
}

void describe(Fields& fields, ObjectSpec& object) {
  fields.about(
      "A thing in the room: an obstacle on the floor, or something that hangs above it (a beam, a lamp).");
  fields.field("id", object.id, id_rules("Name, unlike any other thing's."));
  fields.choice("shape", object.shape, {{"box", BodyShape::box}, {"cylinder", BodyShape::cylinder}},
                {.help = "A cylinder stands upright; its width is size_m[0]."});
  fields.field("size_m", object.size_m,
               {.min = 0.005, .max = 200, .unit = "m", .help = "Along its own x and y, and upwards."});
  fields.field("x_m", object.x_m, {.min = -200, .max = 200, .unit = "m", .help = "Of its middle, in map."});
  fields.field("y_m", object.y_m, {.min = -200, .max = 200, .unit = "m", .help = "Of its middle, in map."});
  fields.field("yaw_deg", object.yaw_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "Of its x axis in map."});
  fields.field("bottom_m", object.bottom_m,
               {.min = 0,
                .max = 50,
                .unit = "m",
                .help = "Of its lower side above the floor; above 0 nothing bumps into it."});
  fields.field("color_rgb", object.color_rgb, {.min = 0, .max = 255, .help = "Red, green, blue."});
  fields.field("pushable", object.pushable, {.help = "Robots can push it; else it stands like a wall."});
  fields.field("mass_kg", object.mass_kg,
               {.min = 0.01, .max = 1000, .unit = "kg", .help = "Of a pushable one."});
  fields.field("friction", object.friction, {.min = 0, .max = 2, .help = "Of a pushable one on the floor."});
  fields.check(!object.pushable || object.bottom_m == 0.0, "bottom_m",
               "a thing that can be pushed stands on the floor: this must be 0");
  fields.check(object.shape != BodyShape::cylinder || object.size_m[0] == object.size_m[1], "size_m[1]",
               "a cylinder is as wide along y as along x");
}

void describe(Fields& fields, PersonSpec& person) {
  fields.about("Somebody who walks through the room, along straight lines from place to place.");
  fields.field("id", person.id, id_rules("Name, unlike any other person's."));
  fields.field("path_m", person.path_m,
               {.min = -200,
                .max = 200,
                .unit = "m",
                .min_items = 2,
                .max_items = 1000,
                .required = true,
                .help = "Places in map, [x, y] each."});
  fields.field("speed_mps", person.speed_mps, {.min = 0.05, .max = 5, .unit = "m/s"});
  fields.field("start_s", person.start_s,
               {.min = 0,
                .max = 604800,
                .unit = "s",
                .help = "Enters then; not there before it and after the path's end."});
  fields.field("loop", person.loop, {.help = "From the last place back to the first, for ever."});
  fields.field("height_m", person.height_m, {.min = 0.3, .max = 2.5, .unit = "m"});
  fields.field("color_rgb", person.color_rgb, {.min = 0, .max = 255, .help = "Of the clothes."});
}

}  // namespace skylight::sim
