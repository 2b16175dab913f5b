#include "service/http/message.hpp"

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "service/http/text.hpp"

namespace skylight::http {
namespace {

TEST(Problem, IsAJsonObjectWithTheMembersOfRfc9457) {
  const Reply reply = problem({.status = 422,
                               .title = "Out of range",
                               .detail = "at is \"5\"\n\\ here",
                               .instance = "/api/v1/poses",
                               .members = {{"oldest", "12.5"}}});
  const auto json = nlohmann::json::parse(reply.body);
  EXPECT_EQ(reply.status, 422);
  EXPECT_EQ(reply.content_type, "application/problem+json");
  EXPECT_EQ(json, (nlohmann::json{{"type", "about:blank"},
                                  {"title", "Out of range"},
                                  {"status", 422},
                                  {"detail", "at is \"5\"\n\\ here"},
                                  {"instance", "/api/v1/poses"},
                                  {"oldest", 12.5}}));
}

TEST(Problem, TakesTheStandardWordsWhereItHasNoTitle) {
  EXPECT_EQ(nlohmann::json::parse(problem(404, "", "x").body)["title"], "Not Found");
}

TEST(JsonQuote, GivesBackEveryAsciiCharacterThroughAnIndependentParser) {
  std::string text;
  for (char c = 0; c < 127; ++c) text += c;
  text += '\x7F';
  EXPECT_EQ(nlohmann::json::parse(json_quote(text)), text);
}

TEST(JsonQuote, ReplacesBytesThatAreNoUtf8AndKeepsThoseThatAre) {
  const std::string good = "gr\u00fc\u00df \u6a5f \U0001F916";
  EXPECT_EQ(nlohmann::json::parse(json_quote(good)), good);
  const std::string mark = "\uFFFD";
  EXPECT_EQ(nlohmann::json::parse(json_quote("a\xFFz")), "a" + mark + "z");
  EXPECT_EQ(nlohmann::json::parse(json_quote("\xC0\xAF")), mark + mark);             // overlong slash
  EXPECT_EQ(nlohmann::json::parse(json_quote("\xED\xA0\x80")), mark + mark + mark);  // surrogate
  EXPECT_EQ(nlohmann::json::parse(json_quote("\xF4\x90\x80\x80")), mark + mark + mark + mark);
  EXPECT_EQ(nlohmann::json::parse(json_quote("\xE6\xA9")), mark + mark);  // cut off
}

TEST(Utf8, AgreesWithAnIndependentParserOnEveryTwoByteText) {
  for (int first = 0; first < 256; ++first) {
    for (int second = 0x20; second < 256; ++second) {
      const std::string text{static_cast<char>(first), static_cast<char>(second)};
      if (first < 0x20 || first == '"' || first == '\\' || second == '"' || second == '\\') continue;
      const bool accepted = nlohmann::json::accept('"' + text + '"');
      ASSERT_EQ(is_utf8(text), accepted) << first << ' ' << second;
    }
  }
}

TEST(Request, GivesTheFirstValueOfAQueryKeyAndNullWhereThereIsNone) {
  Request request;
  request.query = {{"robot", "a"}, {"robot", "b"}};
  ASSERT_NE(request.query_value("robot"), nullptr);
  EXPECT_EQ(*request.query_value("robot"), "a");
  EXPECT_EQ(request.query_value("kind"), nullptr);
  EXPECT_EQ(request.header("accept"), nullptr);
}

}  // namespace
}  // namespace skylight::http
