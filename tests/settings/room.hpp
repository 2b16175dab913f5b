// A described struct with every kind of field, for the tests.
#pragma once

#include "settings/fields.hpp"

namespace skylight::test {

enum class Floor { plain, carpet, tiles };

struct Step;

struct Drive {
  double length_m = 1.0;
};

struct Turn {
  double angle_rad = 0.0;
};

struct Repeat {
  int times = 2;
  std::vector<Step> program;
};

struct Step {
  std::variant<Drive, Turn, Repeat> what;
  double pause_s = 0.0;
};

struct Robot {
  std::string id;
  double speed = 0.2;
  std::optional<std::array<double, 2>> start;
  std::vector<Step> program;
};

struct Room {
  double width_m = 6.0;
  bool lit = true;
  int lamps = 4;
  std::int64_t offset = -5;
  std::uint64_t seed = 1;
  std::size_t walls = 4;
  Floor floor = Floor::carpet;
  std::string name = "room";
  Drive first{.length_m = 2.5};
  std::vector<Robot> robots;
  std::map<std::string, double> marks;
};

inline void describe(settings::Fields& fields, Step& step);

inline void describe(settings::Fields& fields, Drive& drive) {
  fields.field("length", drive.length_m, {.above = 0, .max = 100, .unit = "m", .help = "How far."});
}

inline void describe(settings::Fields& fields, Turn& turn) {
  fields.field("angle", turn.angle_rad,
               {.min = -7, .below = 7, .unit = "rad", .required = true, .help = "How much."});
}

inline void describe(settings::Fields& fields, Repeat& repeat) {
  fields.field("times", repeat.times, {.min = 1, .max = 1000});
  fields.field("program", repeat.program, {.min_items = 1, .max_items = 3, .required = true});
}

inline void describe(settings::Fields& fields, Step& step) {
  fields.field("pause", step.pause_s, {.min = 0, .unit = "s"});
  fields.variant("type", step.what, {{"drive", "Goes straight."}, {"turn"}, {"repeat"}}, {.required = true});
}

inline void describe(settings::Fields& fields, Robot& robot) {
  fields.about("One robot.");
  fields.field("id", robot.id,
               {.pattern = "^[a-z]{1,8}$",
                .pattern_words = "1 to 8 small letters",
                .required = true,
                .help = "Its name."});
  fields.field("speed", robot.speed, {.min = 0, .max = 0.26, .unit = "m/s", .help = "Along x."});
  fields.field("start", robot.start, {.min = -3, .max = 3, .unit = "m"});
  fields.field("program", robot.program);
}

inline void describe(settings::Fields& fields, Room& room) {
  fields.field("width", room.width_m, {.above = 0, .unit = "m"});
  fields.field("lit", room.lit);
  fields.field("lamps", room.lamps);
  fields.field("offset", room.offset);
  fields.field("seed", room.seed);
  fields.field("walls", room.walls, {.min = 3, .max = 12});
  fields.choice("floor", room.floor,
                {{"plain", Floor::plain}, {"carpet", Floor::carpet}, {"tiles", Floor::tiles}});
  fields.field("name", room.name, {.min_length = 1, .max_length = 5});
  fields.field("first", room.first);
  fields.field("robots", room.robots, {.max_items = 3});
  fields.field("marks", room.marks,
               {.max = 10, .key_pattern = "^[a-z]+$", .key_pattern_words = "small letters"});
  for (std::size_t i = 1; i < room.robots.size(); ++i) {
    fields.check(room.robots[i].id != room.robots[0].id, "robots[" + std::to_string(i) + "].id",
                 "is the id of robots[0] too");
  }
}

/// Either a picture or a box, for exactly_one_of().
struct Look {
  std::optional<std::string> picture;
  std::optional<int> box;
};

inline void describe(settings::Fields& fields, Look& look) {
  fields.field("picture", look.picture);
  fields.field("box", look.box);
  fields.exactly_one_of({"picture", "box"});
}

}  // namespace skylight::test
