#include "settings/document.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace skylight::settings {
namespace {

using namespace std::string_literals;
using ::testing::HasSubstr;
using ::testing::Not;

struct Malformed {
  std::string text;
  int line;
  std::string key_path;
  std::string says;
};

const Malformed malformed_texts[] = {
    {"", 1, "", "unexpected end of input"},
    {"\n\n{\n", 3, "", "unexpected end of input"},
    {"{\n  \"a\": 1,\n  \"b\" 2\n}", 3, "b", "unexpected number literal"},
    {"{\n  \"a\": 1,\n}", 3, "", "expected string literal"},
    {"{\"a\": NaN}", 1, "a", "invalid literal"},
    {"{\"a\":\n [1, Infinity]}", 2, "a[1]", "invalid literal"},
    {"{\"a\":\n\n 1e999}", 3, "a", "1e999 is too big"},
    {"{\"a\": {\"b\": [0, -1e999]}}", 1, "a.b[1]", "-1e999 is too big"},
    {"{\n\"a\": 1,\n\"a\": 2}", 3, "a", "is given twice, first on line 2"},
    {"{\"c d\": [{},\n{\"x\": 1,\n \"x\": 2}]}", 3, "[\"c d\"][1].x", "is given twice, first on line 2"},
    {"{\"a\": 01}", 1, "", "unexpected number"},
    {"{\"a\": \"\xff\"}", 1, "a", "ill-formed UTF-8"},
    {"{\n\"\xc3(\": 1}", 2, "", "ill-formed UTF-8"},
    {"{\"a\": \"one\ntwo\"}", 1, "a", "control character"},
    {"{\"a\": 1} {}", 1, "", "expected end of input"},
    {"{\"a\": 1 /* open", 1, "", "missing closing"},
    {"[1,\n2,\n,3]", 3, "[2]", "unexpected ','"},
    {"{\"a\": 1\0}"s, 1, "", "NUL"},
    {"\n{\"a\": \"\\ud800\"}", 2, "a", "surrogate"},
    {"'a'", 1, "", "invalid literal"},
};

TEST(Document, SaysWhereATextIsMalformed) {
  for (const Malformed& each : malformed_texts) {
    try {
      parse(each.text, "room.json");
      ADD_FAILURE() << "accepted: " << each.text;
    } catch (const Error& error) {
      EXPECT_EQ(error.line, each.line) << each.text << '\n' << error.what();
      EXPECT_EQ(error.key_path, each.key_path) << each.text << '\n' << error.what();
      EXPECT_THAT(error.message, HasSubstr(each.says)) << each.text;
      EXPECT_EQ(error.file, "room.json");
      EXPECT_THAT(error.what(), Not(HasSubstr("\n")));
      EXPECT_THAT(error.what(), Not(HasSubstr("\xff")));
    }
  }
}

TEST(Document, KnowsTheLineOfEveryValue) {
  const Document document = parse(
      "// a room\n"
      "{ /* two\n"
      "lines */ \"a\": 12\n"
      ", \"b\": [\n"
      "    1, 2,\n"
      "    {\"c\": null}\n"
      "  ],\n"
      "  \"d\": \"text\" }\n",
      "room.json");
  const Node& root = document.root;
  EXPECT_EQ(root.line, 2);
  EXPECT_EQ(root.find("a")->line, 3);
  const Node& list = *root.find("b");
  EXPECT_EQ(list.line, 4);
  EXPECT_EQ(list.children[0].line, 5);
  EXPECT_EQ(list.children[1].line, 5);
  EXPECT_EQ(list.children[2].line, 6);
  EXPECT_EQ(list.children[2].find("c")->line, 6);
  EXPECT_EQ(root.find("d")->line, 8);
  EXPECT_EQ(root.find("e"), nullptr);
}

TEST(Document, KeepsNumbersAsTheyAreWritten) {
  const Document document = parse("[-9223372036854775808, 18446744073709551615, 0.1, -0]", "numbers");
  EXPECT_EQ(std::get<std::int64_t>(document.root.children[0].scalar), INT64_MIN);
  EXPECT_EQ(std::get<std::uint64_t>(document.root.children[1].scalar), UINT64_MAX);
  EXPECT_EQ(std::get<double>(document.root.children[2].scalar), 0.1);
  EXPECT_EQ(std::get<std::int64_t>(document.root.children[3].scalar), 0);
}

TEST(Document, BoundsNesting) {
  const auto nested = [](int depth) {
    const auto count = static_cast<std::size_t>(depth);
    return std::string(count, '[') + std::string(count, ']');
  };
  EXPECT_NO_THROW(parse(nested(kMaxDepth), "deep"));
  EXPECT_THROW(parse(nested(kMaxDepth + 1), "deep"), Error);
  EXPECT_THROW(parse(std::string(1'000'000, '['), "deep"), Error);
}

TEST(Document, BoundsSizeAndCount) {
  EXPECT_NO_THROW(parse("1" + std::string(kMaxBytes - 1, ' '), "long"));
  try {
    parse("1" + std::string(kMaxBytes, ' '), "long");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "long: is longer than 16 MiB");
  }
  std::string many = "[0";
  for (std::size_t i = 1; i < kMaxValues; ++i)
    many += ",0";  // kMaxValues numbers and their list: one too many
  EXPECT_THROW(parse(many + "]", "many"), Error);
}

TEST(Document, SaysWhyAFileCannotBeRead) {
  const auto what = [](const std::filesystem::path& file) -> std::string {
    try {
      load(file);
    } catch (const Error& error) {
      return error.what();
    }
    return "read";
  };
  EXPECT_EQ(what("/nowhere/room.json"), "/nowhere/room.json: cannot be read: No such file or directory");
  EXPECT_EQ(what("/tmp"), "/tmp: cannot be read: it is a folder");
}

TEST(Document, LoadsAFile) {
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / "settings_document_test.json";
  std::ofstream(file) << "\xEF\xBB\xBF// with a byte order mark\n{\"a\": true}";
  const Document document = load(file);
  EXPECT_TRUE(std::get<bool>(document.root.find("a")->scalar));
  EXPECT_EQ(document.root.find("a")->line, 2);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace skylight::settings
