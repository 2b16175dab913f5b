#include "settings/fields.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/settings/room.hpp"

namespace skylight::test {
namespace {

using settings::Error;
using settings::parse;
using ::testing::ElementsAre;
using ::testing::Pair;

template <class T = Room>
std::string refusal(const std::string& text) {
  try {
    settings::read<T>(parse(text, "room.json"));
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Fields, AnEmptyObjectLeavesTheDefaults) {
  const Room room = settings::read<Room>(parse("{}", "room.json"));
  EXPECT_EQ(room.width_m, 6.0);
  EXPECT_EQ(room.floor, Floor::carpet);
  EXPECT_EQ(room.first.length_m, 2.5);
  EXPECT_TRUE(room.robots.empty());
}

TEST(Fields, ReadsEveryKindOfField) {
  const Room room = settings::read<Room>(parse(
      R"({"width": 7, "lit": false, "lamps": 3.0, "offset": -9223372036854775808, "seed": 18446744073709551615,
          "walls": 12, "floor": "tiles", "name": "größe", "first": {"length": 0.5}, "marks": {"a": 1, "b": -2.5},
          "robots": [{"id": "wall", "speed": 0.26, "start": [1, -3],
            "program": [{"type": "turn", "angle": -7}, {"type": "repeat", "times": 5, "pause": 2,
              "program": [{"type": "drive"}, {"type": "repeat", "program": [{"type": "drive", "length": 9}]}]}]}]})",
      "room.json"));
  EXPECT_EQ(room.width_m, 7.0);
  EXPECT_FALSE(room.lit);
  EXPECT_EQ(room.lamps, 3);
  EXPECT_EQ(room.offset, INT64_MIN);
  EXPECT_EQ(room.seed, UINT64_MAX);
  EXPECT_EQ(room.walls, 12u);
  EXPECT_EQ(room.floor, Floor::tiles);
  EXPECT_EQ(room.name, "größe");
  EXPECT_EQ(room.first.length_m, 0.5);
  EXPECT_THAT(room.marks, ElementsAre(Pair("a", 1.0), Pair("b", -2.5)));
  const Robot& robot = room.robots.at(0);
  EXPECT_THAT(robot.start.value(), ElementsAre(1.0, -3.0));
  EXPECT_EQ(std::get<Turn>(robot.program.at(0).what).angle_rad, -7.0);
  EXPECT_EQ(robot.program.at(1).pause_s, 2.0);
  const Repeat& repeat = std::get<Repeat>(robot.program.at(1).what);
  EXPECT_EQ(repeat.times, 5);
  const Repeat& inner = std::get<Repeat>(repeat.program.at(1).what);
  EXPECT_EQ(std::get<Drive>(inner.program.at(0).what).length_m, 9.0);
}

struct Refused {
  const char* text;
  const char* what;
};

constexpr Refused kRefused[] = {
    {"[]", "room.json:1: expected an object, found a list"},
    {"{\n\"robots\": [{\"id\": \"a\",\n \"speed\": 7}]}",
     "room.json:3: robots[0].speed: 7 is out of range, allowed 0 to 0.26 m/s"},
    {"{\"robots\": [{\"id\": \"a\", \"speed\": \"fast\"}]}",
     "room.json:1: robots[0].speed: expected a number (m/s), found the string \"fast\""},
    {"{\n\n\"robots\": [{\"id\": \"a\", \"sped\": 0.1}]}",
     "room.json:3: robots[0].sped: unknown key, did you mean \"speed\"?"},
    {"{\"robots\": [\n{\"sped\": 0.1}]}",
     "room.json:2: robots[0].sped: unknown key, did you mean \"speed\"?"},
    {"{\"robots\": [\n{\"colour\": 1, \"id\": \"a\"}]}",
     "room.json:2: robots[0].colour: unknown key, known are id, speed, start and program"},
    {"{\"robots\": [\n{}]}", "room.json:2: robots[0].id: is missing: Its name."},
    {"{\"robots\": [{\"id\": \"A 1\"}]}", "room.json:1: robots[0].id: \"A 1\" is not 1 to 8 small letters"},
    {"{\"robots\": [{\"id\": \"a\\n\"}]}",
     "room.json:1: robots[0].id: \"a\\x0a\" is not 1 to 8 small letters"},
    {"{\"robots\": {}}", "room.json:1: robots: expected a list, found an object"},
    {"{\"robots\": [{\"id\":\"a\"},{\"id\":\"b\"},{\"id\":\"c\"},{\"id\":\"d\"}]}",
     "room.json:1: robots: 4 entries, allowed 0 to 3"},
    {"{\"robots\": [{\"id\":\"a\"},\n{\"id\":\"b\"},\n{\"id\":\"a\"}]}",
     "room.json:3: robots[2].id: is the id of robots[0] too"},
    {"{\"robots\": [{\"id\":\"a\", \"start\": [1]}]}",
     "room.json:1: robots[0].start: 1 entries, needed are 2"},
    {"{\"robots\": [{\"id\":\"a\", \"start\": [1,\n 4]}]}",
     "room.json:2: robots[0].start[1]: 4 is out of range, allowed -3 to 3 m"},
    {"{\"robots\": [{\"id\":\"a\", \"start\": 5}]}",
     "room.json:1: robots[0].start: expected a list of 2, found the number 5"},
    {"{\"robots\": [{\"id\":\"a\", \"start\": null}]}",
     "room.json:1: robots[0].start: expected a list of 2, found null"},
    {"{\"robots\": [{\"id\":\"a\", \"program\": [{}]}]}",
     "room.json:1: robots[0].program[0].type: is missing: one of drive, turn or repeat"},
    {"{\"robots\": [{\"id\":\"a\", \"program\": [{\"type\": \"drve\"}]}]}",
     "room.json:1: robots[0].program[0].type: \"drve\" is not one of drive, turn or repeat, did you mean "
     "\"drive\"?"},
    {"{\"robots\": [{\"id\":\"a\", \"program\": [{\"type\": 4}]}]}",
     "room.json:1: robots[0].program[0].type: expected one of drive, turn or repeat, found the number 4"},
    {"{\"robots\": [{\"id\":\"a\", \"program\": [{\"type\": \"turn\", \"length\": 1, \"angle\": 1}]}]}",
     "room.json:1: robots[0].program[0].length: unknown key, known are pause, type and angle"},
    {"{\"robots\": [{\"id\":\"a\", \"program\": [{\"type\": \"turn\"}]}]}",
     "room.json:1: robots[0].program[0].angle: is missing: How much."},
    {"{\"robots\": [{\"id\":\"a\", \"program\": [{\"type\": \"repeat\", \"program\": [{\"type\": \"turn\",\n"
     "\"angle\": 7}]}]}]}",
     "room.json:2: robots[0].program[0].program[0].angle: 7 is out of range, allowed -7 and below 7 rad"},
    {"{\"robots\": [{\"id\":\"a\", \"program\": [{\"type\": \"repeat\", \"program\": []}]}]}",
     "room.json:1: robots[0].program[0].program: 0 entries, allowed 1 to 3"},
    {"{\"width\": 0}", "room.json:1: width: 0 is out of range, allowed above 0 m"},
    {"{\"first\": {\"length\": 100.5}}",
     "room.json:1: first.length: 100.5 is out of range, allowed above 0 to 100 m"},
    {"{\"lit\": 1}", "room.json:1: lit: expected true or false, found the number 1"},
    {"{\"lamps\": 3.5}", "room.json:1: lamps: 3.5 is no whole number"},
    {"{\"lamps\": 3000000000}",
     "room.json:1: lamps: 3000000000 is out of range, allowed -2147483648 to 2147483647"},
    {"{\"lamps\": \"3\"}", "room.json:1: lamps: expected a whole number, found the string \"3\""},
    {"{\"offset\": 9223372036854775808}",
     "room.json:1: offset: 9223372036854775808 is out of range, allowed -9223372036854775808 to "
     "9223372036854775807"},
    {"{\"seed\": -1}", "room.json:1: seed: -1 is out of range, allowed 0 to 18446744073709551615"},
    {"{\"seed\": 18446744073709551616}",
     "room.json:1: seed: 18446744073709551616 is out of range, allowed 0 to 18446744073709551615"},
    {"{\"walls\": 2}", "room.json:1: walls: 2 is out of range, allowed 3 to 12"},
    {"{\"floor\": \"Tile\"}",
     "room.json:1: floor: \"Tile\" is not one of plain, carpet or tiles, did you mean \"tiles\"?"},
    {"{\"name\": \"\"}", "room.json:1: name: 0 characters, allowed 1 to 5"},
    {"{\"name\": \"abcdef\"}", "room.json:1: name: 6 characters, allowed 1 to 5"},
    {"{\"name\": true}", "room.json:1: name: expected a string, found true"},
    {"{\"marks\": {\"A\": 1}}", "room.json:1: marks: the key \"A\" is not small letters"},
    {"{\"marks\": {\"a\": 1,\n\"b\": 11}}", "room.json:2: marks.b: 11 is out of range, allowed at most 10"},
};

TEST(Fields, RefuseWithFileLineKeyPathValueAndBound) {
  for (const Refused& each : kRefused) EXPECT_EQ(refusal(each.text), each.what) << each.text;
}

TEST(Fields, ExactlyOneOfTwoKeysIsHeld) {
  EXPECT_EQ(refusal<Look>("{\"box\": 1}"), "accepted");
  EXPECT_EQ(refusal<Look>("\n{}"), "room.json:2: needs one of picture or box");
  EXPECT_EQ(refusal<Look>("{\"box\": 1,\n\"picture\": \"a.png\"}"),
            "room.json:1: box: contradicts picture: give only one of picture or box");
  EXPECT_EQ(refusal<Look>("{\"bx\": 1}"), "room.json:1: bx: unknown key, did you mean \"box\"?");
}

TEST(Fields, WhatIsWrittenIsReadBack) {
  const std::string text =
      R"({"width": 0.1, "seed": 18446744073709551615, "floor": "plain", "marks": {"a": 1e-300},
          "robots": [{"id": "a", "start": [0.5, 1], "program": [{"type": "repeat", "program":
            [{"type": "turn", "angle": 0.3, "pause": 1}, {"type": "drive"}]}]}]})";
  const std::string once = settings::write(settings::read<Room>(parse(text, "room.json")));
  const Room back = settings::read<Room>(parse(once, "written"));
  EXPECT_EQ(back.width_m, 0.1);
  EXPECT_EQ(back.seed, UINT64_MAX);
  EXPECT_EQ(back.floor, Floor::plain);
  EXPECT_EQ(back.marks.at("a"), 1e-300);
  const Repeat& repeat = std::get<Repeat>(back.robots.at(0).program.at(0).what);
  EXPECT_EQ(std::get<Turn>(repeat.program.at(0).what).angle_rad, 0.3);
  EXPECT_EQ(repeat.program.at(0).pause_s, 1.0);
  EXPECT_EQ(settings::write(back), once);
}

TEST(Fields, NumbersThatAreNotFiniteAreNotWritten) {
  Room room;
  room.width_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(settings::write(room), std::invalid_argument);
}

}  // namespace
}  // namespace skylight::test
