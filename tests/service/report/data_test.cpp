// Texts, numbers, CSV, JSON and distributions.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "sample.hpp"
#include "service/report/report.hpp"
#include "service/report/shares.hpp"
#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(Clean, KeepsUtf8AndReplacesWhatXmlForbids) {
  EXPECT_EQ(clean("caf\xC3\xA9 \xE2\x88\x92 \xF0\x9F\xA4\x96\t\n"),
            "caf\xC3\xA9 \xE2\x88\x92 \xF0\x9F\xA4\x96\t\n");
  const std::string bad = "\xEF\xBF\xBD";
  EXPECT_EQ(clean(std::string("a\0b", 3)), "a" + bad + "b");
  EXPECT_EQ(clean("\x1B"), bad);
  EXPECT_EQ(clean("\xC0\x80"), bad + bad) << "an overlong zero";
  EXPECT_EQ(clean("\xE0\x80\xAF"), bad + bad + bad) << "an overlong slash";
  EXPECT_EQ(clean("\xF0\x80\x80\xAF"), bad + bad + bad + bad) << "a longer one";
  EXPECT_EQ(clean("\xED\xA0\x80"), bad + bad + bad) << "a surrogate";
  EXPECT_EQ(clean("\xE2\x88"), bad + bad) << "cut off";
  EXPECT_EQ(clean("\xF5\x80\x80\x80"), bad + bad + bad + bad) << "beyond Unicode";
  EXPECT_EQ(clean("\xEF\xBF\xBF"), bad) << "U+FFFF";
}

TEST(Escape, LeavesNoMarkup) {
  EXPECT_EQ(escape("<a b=\"c\" d='e'>&"), "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp;");
}

TEST(Rounded, HasTheDigitsAskedForAndNoMinusZero) {
  EXPECT_EQ(rounded(0.0584, 3), "0.058");
  EXPECT_EQ(rounded(-2.5, 1), "−2.5");
  EXPECT_EQ(rounded(-0.0004, 3), "0.000");
  EXPECT_EQ(rounded(1234567.0, 0), "1234567");
  EXPECT_EQ(rounded(kNan, 3), "–");
  EXPECT_EQ(rounded(-kInf, 3), "−∞");
  EXPECT_EQ(rounded(1.25e12, 2), "1.25×10¹²");
}

TEST(Exact, ReadsBackAsTheSameNumber) {
  for (std::uint64_t n = 0; n < 1000; ++n) {
    const double value = (noise(2 * n) - 0.5) * std::pow(10.0, 600.0 * noise(2 * n + 1) - 300.0);
    ASSERT_EQ(std::strtod(exact(value).c_str(), nullptr), value);
  }
  EXPECT_EQ(exact(kNan), "");
}

TEST(Csv, OfATableQuotesWhatNeedsIt) {
  const Table table{.id = "t",
                    .columns = {{"route"}, {"mean", "m", "before, after"}, {"said"}},
                    .rows = {{{text("line"), number(0.1 + 0.2, 1), text("\"yes\"")}},
                             {{text(" a,b"), number(kNan, 1), text("two\nlines")}}}};
  EXPECT_EQ(csv(table),
            "route,\"before, after: mean (m)\",said\n"
            "line,0.30000000000000004,\"\"\"yes\"\"\"\n"
            "\" a,b\",,\"two\nlines\"\n");
}

TEST(Csv, OfAPlotHasALineForEachPoint) {
  const Plot plot{.id = "p",
                  .series = {{.name = "a, b", .x = {1, 2}, .y = {3, kNan}},
                             {.name = "c", .x = {0.5}, .low = {1}, .high = {2}, .style = Style::band}}};
  EXPECT_EQ(csv(plot), "series,x,y,low,high\n\"a, b\",1,3,,\n\"a, b\",2,,,\nc,0.5,,1,2\n");
}

TEST(Csv, OfAPlotWithNamesWritesThem) {
  const Plot plot{
      .id = "p", .series = {{.name = "a", .x = {0, 1, 0.5}, .y = {3, 4, 5}}}, .x_names = {"line", "circle"}};
  EXPECT_EQ(csv(plot), "series,x,y,low,high\na,line,3,,\na,circle,4,,\na,0.5,5,,\n");
}

TEST(Json, HasNumbersAsNumbersAndNullForNone) {
  Document document{.title = "t", .facts = {{"seeds", "1 to 10"}}};
  const Table table{.id = "t",
                    .columns = {{"a"}, {"b", "m"}, {"c"}},
                    .rows = {{{text("x"), number(0.1, 0), number(kNan, 3)}}}};
  const Plot plot{.id = "p", .series = {{.name = "s", .x = {1, 2}, .y = {kInf, 3}}}};
  document.sections = {{"s", "Section", 2, {Paragraph{"words"}, table, plot}}};
  const nlohmann::json json = nlohmann::json::parse(to_json(document).dump());
  const nlohmann::json& blocks = json["sections"][0]["blocks"];
  EXPECT_EQ(json["facts"][0]["value"], "1 to 10");
  EXPECT_EQ(blocks[0]["text"], "words");
  EXPECT_EQ(blocks[1]["rows"][0], nlohmann::json({"x", 0.1, nullptr}));
  EXPECT_EQ(blocks[1]["columns"][1]["unit"], "m");
  EXPECT_EQ(blocks[2]["series"][0]["y"], nlohmann::json({nullptr, 3.0}));
}

TEST(Cumulative, IsTheShareOfValuesUpToEach) {
  const Series series = cumulative("s", {0.3, 0.1, 0.2, 0.2});
  EXPECT_THAT(series.x, ElementsAre(0.1, 0.2, 0.3));
  EXPECT_THAT(series.y, ElementsAre(0.25, 0.75, 1.0));
}

TEST(Cumulative, EndsBelowOneWhereValuesAreMissing) {
  const Series series = cumulative("s", {kInf, 1.0, kNan, 2.0});
  EXPECT_THAT(series.y, ElementsAre(0.25, 0.5));
  EXPECT_TRUE(cumulative("s", {}).x.empty());
}

TEST(Histogram, CountsWhatLiesInEachBin) {
  const Series series =
      histogram("s", {0.0, 0.5, 1.0, 1.5, 2.0, 7.0, kNan, -1.0}, {.edges = {0.0, 1.0, 2.0}});
  EXPECT_THAT(series.x, ElementsAre(0.5, 1.5));
  EXPECT_THAT(series.y, ElementsAre(2.0 / 8.0, 3.0 / 8.0));
}

TEST(Histogram, OnALogAxisHasItsBarsInTheMiddleOfTheirBins) {
  const Series series = histogram("s", {0.02}, {.edges = {0.01, 0.1, 1.0}, .log_x = true});
  EXPECT_THAT(series.x, Pointwise(DoubleNear(1e-12), {std::sqrt(0.001), std::sqrt(0.1)}));
}

TEST(Histogram, RefusesEdgesThatDoNotRise) {
  EXPECT_THROW(histogram("s", {}, {.edges = {1.0}}), std::invalid_argument);
  EXPECT_THROW(histogram("s", {}, {.edges = {1.0, 1.0}}), std::invalid_argument);
  EXPECT_THROW(histogram("s", {}, {.edges = {0.0, 1.0}, .log_x = true}), std::invalid_argument);
  EXPECT_THROW(histogram("s", {}, {.edges = {0.0, kNan}}), std::invalid_argument);
}

}  // namespace
}  // namespace skylight::service::report
