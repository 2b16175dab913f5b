#include <string>

#include <gtest/gtest.h>

#include "settings/fields.hpp"
#include "tests/settings/room.hpp"

namespace skylight::test {
namespace {

using settings::Document;
using settings::Error;
using settings::parse;

constexpr const char* kText = "{\"width\": 5, \"robots\": [{\"id\": \"a\"}]}";

Room with(const std::string& assignment, const std::string& origin = "--set") {
  Document document = parse(kText, "room.json");
  settings::set(document, assignment, origin);
  return settings::read<Room>(document);
}

std::string refusal(const std::string& assignment, const std::string& origin = "--set") {
  try {
    with(assignment, origin);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Set, ReplacesAndAddsValues) {
  EXPECT_EQ(with("width=7.5").width_m, 7.5);
  EXPECT_EQ(with("lit=false").lit, false);
  EXPECT_EQ(with("first.length=3").first.length_m, 3.0);
  EXPECT_EQ(with("robots[0].speed=0.1").robots.at(0).speed, 0.1);
  EXPECT_EQ(with("robots[1].id=b").robots.at(1).id, "b");
  EXPECT_EQ(with("robots=[]").robots.size(), 0u);
  EXPECT_EQ(with("robots[0].start=[1, 2]").robots.at(0).start.value()[1], 2.0);
  EXPECT_EQ(with("marks[\"ab\"]=2").marks.at("ab"), 2.0);
}

TEST(Set, TakesTextWithoutQuotesAsAString) {
  EXPECT_EQ(with("name=a b").name, "a b");
  EXPECT_EQ(with("name=\"a b\"").name, "a b");
  EXPECT_EQ(with("name=7").name, "7");
  EXPECT_EQ(with("name=true").name, "true");
  EXPECT_EQ(with("name=a=b").name, "a=b");
}

TEST(Set, ErrorsSayWhereTheValueCameFrom) {
  EXPECT_EQ(refusal("robots[0].speed=7"), "--set robots[0].speed: 7 is out of range, allowed 0 to 0.26 m/s");
  EXPECT_EQ(refusal("width=wide", "SKYLIGHT_WIDTH"),
            "SKYLIGHT_WIDTH: width: expected a number (m), found the string \"wide\"");
  EXPECT_EQ(refusal("frist.length=7"), "--set frist: unknown key, did you mean \"first\"?");
  EXPECT_EQ(refusal("robots[0]={\"id\": \"a\", \"speed\": 7}"),
            "--set robots[0].speed: 7 is out of range, allowed 0 to 0.26 m/s");
  EXPECT_EQ(refusal("name="), "--set name: 0 characters, allowed 1 to 5");
}

TEST(Set, RefusesPathsAndValuesThatAreNone) {
  EXPECT_EQ(refusal("width"), "--set: \"width\" is not of the form key.path=value");
  EXPECT_EQ(refusal("=5"), "--set: \"\" is no key path such as server.port or robots[0].id");
  EXPECT_EQ(refusal("a..b=5"), "--set: \"a..b\" is no key path such as server.port or robots[0].id");
  EXPECT_EQ(refusal("robots[x].id=5"),
            "--set: \"robots[x].id\" is no key path such as server.port or robots[0].id");
  EXPECT_EQ(refusal("robots[0.id=5"),
            "--set: \"robots[0.id\" is no key path such as server.port or robots[0].id");
  EXPECT_EQ(refusal("robots[2].id=c"), "--set robots[2].id: cannot be set: the list has 1 entries");
  EXPECT_EQ(refusal("robots.id=c"),
            "--set robots.id: cannot be set: the list has entries [0], [1] ... and no key id");
  EXPECT_EQ(refusal("width.x=1"), "--set width.x: cannot be set: what x is asked of holds no keys");
  EXPECT_EQ(refusal("robots=[{]").substr(0, 15), "--set robots[0]");
  EXPECT_EQ(refusal("first={\"length\": 1e999}"), "--set first.length: the number 1e999 is too big");
  EXPECT_EQ(refusal("name=\xff"), "--set name: the value is no UTF-8");
}

TEST(Set, DepthOfThePathIsBounded) {
  std::string path = "a";
  for (int i = 0; i < settings::kMaxDepth; ++i) path += ".a";
  Document document = parse("{}", "room.json");
  EXPECT_THROW(settings::set(document, path + "=1", "--set"), Error);
}

TEST(Set, ALaterValueStandsOverAnEarlierOne) {
  Document document = parse(kText, "room.json");
  settings::set(document, "width", "8", "SKYLIGHT_WIDTH");
  settings::set(document, "width=9", "--set");
  EXPECT_EQ(settings::read<Room>(document).width_m, 9.0);
}

}  // namespace
}  // namespace skylight::test
