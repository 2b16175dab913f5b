#include "service/http/target.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "service/http/message.hpp"

namespace skylight::http {
namespace {

using testing::ElementsAre;
using testing::Pair;

TEST(Target, IsTakenApartAndDecodedOnce) {
  const Target target = parse_target("/robots/r%20%C3%BC%2541?at=1.5&kind=a%26b+c&flag&&x=a=b?c");
  EXPECT_EQ(target.path, "/robots/r \u00fc%41");
  EXPECT_THAT(target.segments, ElementsAre("robots", "r \u00fc%41"));
  EXPECT_THAT(target.query,
              ElementsAre(Pair("at", "1.5"), Pair("kind", "a&b c"), Pair("flag", ""), Pair("x", "a=b?c")));
}

TEST(Target, KeepsThePlusOfThePathAndTheEncodedPlusOfTheQuery) {
  const Target target = parse_target("/a+b?c=1%2B2");
  EXPECT_EQ(target.path, "/a+b");
  EXPECT_THAT(target.query, ElementsAre(Pair("c", "1+2")));
}

TEST(Target, HasOneEmptySegmentAtTheRoot) {
  EXPECT_THAT(parse_target("/").segments, ElementsAre(""));
  EXPECT_THAT(parse_target("/a/").segments, ElementsAre("a", ""));
  EXPECT_EQ(parse_target("/a//b?").path, "/a//b");
}

TEST(Target, RefusesWhatCouldBeReadInTwoWays) {
  for (const char* bad :
       {"",      "robots",    "*",         "/a%2Fb",   "/a%2fb",   "/a%00",    "/a%0D%0A",
        "/a%7F", "/%",        "/%4",       "/%4g",     "/%u0041",  "/a#b",     "/a?b#c",
        "/a b",  "/a\x01",    "/\xC3\xBC", "/%FF",     "/%C0%AF",  "/..",      "/a/../b",
        "/./a",  "/%2e%2E/a", "/a?b=%",    "/a?%00=1", "/a?b=%0a", "/a?b=%FF", "/a?b=%zz"}) {
    EXPECT_THROW(parse_target(bad), Problem) << bad;
  }
}

TEST(Target, ReadsBackWhateverPercentEncodeWrites) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> byte(0x20, 0x7E);
  for (int round = 0; round < 200; ++round) {
    std::string text;
    for (int i = 0; i < 12; ++i) text += static_cast<char>(byte(random));
    text += "\u6a5f";
    const Target target = parse_target("/?" + percent_encode(text) + '=' + percent_encode(text));
    EXPECT_THAT(target.query, ElementsAre(Pair(text, text)));
  }
}

}  // namespace
}  // namespace skylight::http
