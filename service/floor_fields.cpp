// Every key of the configuration that says what lies on the floor: its range, its unit, and what it is for.
#include "service/config.hpp"
#include "settings/fields.hpp"

namespace skylight::service {

using settings::Fields;

namespace {

constexpr settings::Rules kMiddle{
    .min = -1e4, .max = 1e4, .unit = "m", .required = true, .help = "Its middle in map."};

}  // namespace

void describe(Fields& fields, FloorTag& tag) {
  fields.about("A tag that lies on the floor at a known place.");
  fields.field("family", tag.family,
               {.pattern = "^(36h11|25h9|16h5|36h10)$",
                .pattern_words = "36h11, 25h9, 16h5 or 36h10",
                .help = "Family of the tag."});
  fields.field("id", tag.id, {.min = 0, .max = 2319, .required = true, .help = "Number within the family."});
  fields.field("size_m", tag.size_m,
               {.min = 0.02, .max = 10, .unit = "m", .required = true, .help = "Outer edge of its border."});
  fields.field("x_m", tag.x_m, kMiddle);
  fields.field("y_m", tag.y_m, kMiddle);
  fields.field("yaw_deg", tag.yaw_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "0: upright where map y is up."});
  fields.field("place_sigma_m", tag.place_sigma_m,
               {.min = 0, .max = 1, .unit = "m", .help = "How well its place is known, one sigma per axis."});
}

void describe(Fields& fields, MaskConfig& mask) {
  fields.about(
      "A part of the floor where robots are not searched for; one that is tracked may drive through.");
  fields.field("name", mask.name,
               {.min_length = 1, .max_length = 200, .required = true, .help = "For people."});
  fields.field(
      "corners_m", mask.corners_m,
      {.min = -1e4,
       .max = 1e4,
       .unit = "m",
       .min_items = 3,
       .max_items = FloorMask::kMostCorners,
       .required = true,
       .help = "x, y in map of a polygon's corners, one after the other, either way round; its sides "
               "do not cross."});
  if (const std::string wrong = check(floor_mask(mask)); !wrong.empty()) {
    const std::size_t colon = wrong.find(": ");
    std::string path = wrong.substr(0, colon);
    path.insert(std::string_view("corners").size(), "_m");
    fields.check(false, path, wrong.substr(colon + 2));
  }
}

void describe(Fields& fields, FloorConfig& floor) {
  fields.about("The floor that the cameras look down on.");
  fields.field("masks", floor.masks, {.max_items = 1000});
}

}  // namespace skylight::service
