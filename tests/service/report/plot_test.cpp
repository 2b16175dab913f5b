// Plots judged by what stands in the SVG: its own tick labels say where a value has to be.
#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>
#include <string>

#include <gmock/gmock.h>

#include "sample.hpp"
#include "service/report/draw.hpp"
#include "service/report/marks.hpp"
#include "service/report/report.hpp"

namespace skylight::service::report {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kRoundingPx = 0.11;  // coordinates are written to a tenth

struct Word {
  double x = 0.0, y = 0.0;
  std::string text;
};

std::vector<Word> words(const std::string& picture, const std::string& kind) {
  std::vector<Word> out;
  const std::regex text("<text x=\"([^\"]+)\" y=\"([^\"]+)\"[^>]*class=\"" + kind + "\"[^>]*>([^<]*)<");
  for (std::sregex_iterator i(picture.begin(), picture.end(), text), end; i != end; ++i) {
    out.push_back({std::stod((*i)[1]), std::stod((*i)[2]), (*i)[3]});
  }
  return out;
}

// The d of the first path of a class.
std::string path_of(const std::string& picture, const std::string& kind) {
  const std::size_t start = picture.find("<path class=\"" + kind + "\"");
  if (start == std::string::npos) return "";
  const std::size_t d = picture.find(" d=\"", start) + 4;
  return picture.substr(d, picture.find('"', d) - d);
}

// All pairs of coordinates in a path of absolute points.
std::vector<Point> points_of(const std::string& path) {
  std::vector<Point> out;
  const std::regex pair("(-?[0-9.]+),(-?[0-9.]+)");
  for (std::sregex_iterator i(path.begin(), path.end(), pair), end; i != end; ++i) {
    out.push_back({std::stod((*i)[1]), std::stod((*i)[2])});
  }
  return out;
}

// From values to pixels by the first and the last tick alone.
struct Ruler {
  double from_value, from_px, to_value, to_px;
  double linear(double v) const {
    return from_px + (to_px - from_px) * (v - from_value) / (to_value - from_value);
  }
  double log(double v) const {
    return from_px + (to_px - from_px) * std::log10(v / from_value) / std::log10(to_value / from_value);
  }
};

double value_of(const std::string& label) {
  const std::string minus = "−";
  return label.starts_with(minus) ? -std::stod(label.substr(minus.size())) : std::stod(label);
}

Ruler x_ruler(const std::string& picture) {
  const std::vector<Word> labels = words(picture, "tick x");
  return {value_of(labels.front().text), labels.front().x, value_of(labels.back().text), labels.back().x};
}
Ruler y_ruler(const std::string& picture) {
  const std::vector<Word> labels = words(picture, "tick y");
  const std::vector<Point> lines = points_of(path_of(picture, "grid y"));
  return {value_of(labels.front().text), lines.front().y, value_of(labels.back().text), lines.back().y};
}

Plot one_series(Series series) {
  return {
      .id = "p", .title = "t", .x_label = "time (s)", .y_label = "error (m)", .series = {std::move(series)}};
}

TEST(Plot, PutsAPointWhereTheTicksSay) {
  const std::string picture = svg(one_series({.x = {1.7, 22.2}, .y = {0.013, -0.4}, .style = Style::dots}));
  const std::vector<Point> dots = points_of(path_of(picture, "dots"));
  ASSERT_EQ(dots.size(), 2u);
  EXPECT_NEAR(dots[0].x, x_ruler(picture).linear(1.7), kRoundingPx);
  EXPECT_NEAR(dots[0].y, y_ruler(picture).linear(0.013), kRoundingPx);
  EXPECT_NEAR(dots[1].x, x_ruler(picture).linear(22.2), kRoundingPx);
  EXPECT_NEAR(dots[1].y, y_ruler(picture).linear(-0.4), kRoundingPx);
  EXPECT_GT(dots[1].y, dots[0].y) << "up is up";
}

TEST(Plot, PutsAPointWhereTheTicksOfLogAxesSay) {
  Plot plot = one_series({.x = {0.02, 30.0, 1.1}, .y = {500.0, 0.3, 7.0}, .style = Style::dots});
  plot.log_x = plot.log_y = true;
  const std::string picture = svg(plot);
  const Point dot = points_of(path_of(picture, "dots")).at(2);
  EXPECT_NEAR(dot.x, x_ruler(picture).log(1.1), kRoundingPx);
  EXPECT_NEAR(dot.y, y_ruler(picture).log(7.0), kRoundingPx);
}

TEST(Plot, WithEqualAxesGivesAUnitTheSameLengthBothWays) {
  for (const double width : {280.0, 360.0, 820.0}) {
    Plot plot = one_series({.x = {-1.0, 2.0, 3.0}, .y = {0.0, 1.0, 0.5}});
    plot.equal_axes = true;
    const std::string picture = draw(plot, {.width_px = width});
    const Ruler x = x_ruler(picture);
    const Ruler y = y_ruler(picture);
    EXPECT_NEAR((x.to_px - x.from_px) / (x.to_value - x.from_value),
                -(y.to_px - y.from_px) / (y.to_value - y.from_value), 0.2);
  }
}

TEST(Plot, NeverLetsTickLabelsOverlap) {
  for (std::uint64_t n = 0; n < 300; ++n) {
    const double size = std::pow(10.0, 20.0 * noise(3 * n) - 10.0);
    const double start = n % 3 == 0 ? 1e5 * size : size * noise(3 * n + 1);
    Plot plot = one_series({.x = {start, start + size}, .y = {start, start + 0.7 * size}});
    plot.log_x = n % 4 == 1;
    plot.log_y = n % 4 == 2;
    const std::string picture = draw(plot, {.width_px = n % 2 == 0 ? 280.0 : 820.0});
    double end = -1e9;
    for (const Word& label : words(picture, "tick x")) {
      // Digits of DejaVu Sans are 0.636 of its size wide; no sign of a label is wider than 0.84.
      const auto letters =
          std::count_if(label.text.begin(), label.text.end(), [](char c) { return (c & 0xC0) != 0x80; });
      const double half = 12.0 * 0.64 * static_cast<double>(letters) / 2.0;
      ASSERT_GE(label.x - half, end) << label.text << ", " << n;
      end = label.x + half;
    }
    double below = 1e9;
    for (const Word& label : words(picture, "tick y")) {
      ASSERT_LE(label.y, below - 12.0) << label.text << ", " << n;
      below = label.y;
    }
  }
}

TEST(Plot, LeavesAGapWhereAValueIsMissing) {
  const std::string path =
      path_of(svg(one_series({.x = {1, 2, 3, 4, 5, 6}, .y = {1, 2, kNan, 1, 3, 2}})), "line");
  EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
  EXPECT_EQ(points_of(path).size(), 5u);
}

TEST(Plot, ShowsAPointBetweenTwoGaps) {
  const std::string picture = svg(one_series({.x = {1, 2, 3, 4, 5}, .y = {1, kNan, 2, kNan, 1}}));
  EXPECT_EQ(points_of(path_of(picture, "dots")).size(), 3u);
}

TEST(Plot, ShowsASinglePeakAmongManyPointsInASmallFile) {
  Series series;
  for (std::uint64_t i = 0; i < 50000; ++i) {
    series.x.push_back(static_cast<double>(i));
    series.y.push_back(i == 31234 ? 0.9 : 0.1 * noise(i));
  }
  const std::string picture = svg(one_series(series));
  EXPECT_LT(picture.size(), 100000u);
  const std::vector<Point> line = points_of(path_of(picture, "line"));
  const auto peak = std::min_element(line.begin(), line.end(), [](Point a, Point b) { return a.y < b.y; });
  EXPECT_NEAR(peak->y, y_ruler(picture).linear(0.9), 0.3);
  EXPECT_NEAR(peak->x, x_ruler(picture).linear(31234), 1.0);
}

TEST(Plot, CutsLinesAtItsEdgesWhereTheyCrossThem) {
  Plot plot = one_series({.x = {0, 10}, .y = {0, 100}});
  plot.y_range = {.low = 0.0, .high = 50.0};
  const std::string picture = svg(plot);
  const std::vector<Point> line = points_of(path_of(picture, "line"));
  ASSERT_EQ(line.size(), 2u);
  EXPECT_NEAR(line[1].x, x_ruler(picture).linear(5.0), kRoundingPx);
  EXPECT_NEAR(line[1].y, y_ruler(picture).linear(50.0), kRoundingPx);
  EXPECT_THAT(picture, HasSubstr(">1 point outside of the axes.<"));
}

TEST(Plot, SaysHowManyPointsCannotBeShown) {
  Plot plot = one_series({.x = {1, 2, 3, 4, 5}, .y = {1, 0, -3, kInf, 10}});
  plot.log_y = true;
  EXPECT_THAT(svg(plot), HasSubstr(">Not shown: 3 points infinite or not above zero.<"));
  plot.log_y = false;
  EXPECT_THAT(svg(plot), HasSubstr(">Not shown: 1 point infinite.<"));
}

TEST(Plot, SaysNothingOfValuesThatAreMissing) {
  EXPECT_THAT(svg(one_series({.x = {1, 2, 3}, .y = {1, kNan, 3}})), Not(HasSubstr("Not shown")));
}

TEST(Plot, SaysThatThereAreNoData) {
  const std::string picture = svg(one_series({.name = "nothing", .x = {1.0}, .y = {kNan}}));
  EXPECT_THAT(picture, HasSubstr(">no data<"));
  EXPECT_TRUE(words(picture, "tick x").empty()) << "an axis without data has no numbers";
  EXPECT_THAT(svg({.id = "p"}), HasSubstr(">no data<"));
}

TEST(Plot, StandsBarsOnZero) {
  const std::string picture = svg(one_series({.x = {1, 2, 3}, .y = {4, -2, 1}, .style = Style::bars}));
  const std::vector<Point> corners = points_of(path_of(picture, "bars"));
  ASSERT_EQ(corners.size(), 3u);
  for (const Point& corner : corners) EXPECT_NEAR(corner.y, y_ruler(picture).linear(0.0), kRoundingPx);
  EXPECT_THAT(path_of(picture, "bars"), HasSubstr("V"));
}

TEST(Plot, DrawsABandFromLowToHigh) {
  const std::string picture =
      svg(one_series({.x = {0, 1, 2}, .low = {1, 2, 1}, .high = {3, 5, 4}, .style = Style::band}));
  const std::vector<Point> edge = points_of(path_of(picture, "band"));
  ASSERT_EQ(edge.size(), 6u);
  EXPECT_NEAR(edge[1].y, y_ruler(picture).linear(5.0), kRoundingPx);
  EXPECT_NEAR(edge[4].y, y_ruler(picture).linear(2.0), kRoundingPx);
}

TEST(Plot, TellsItsSeriesApartWithoutColours) {
  for (const Style style : {Style::line, Style::dots, Style::line_and_dots}) {
    Plot plot{.id = "p"};
    for (int i = 0; i < 6; ++i)
      plot.series.push_back({.name = std::to_string(i), .x = {1}, .y = {1}, .style = style});
    const std::vector<Look> looks = looks_of(plot);
    for (std::size_t i = 0; i < looks.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        EXPECT_NE(looks[i].ink.name, looks[k].ink.name);
        EXPECT_TRUE(looks[i].dash != looks[k].dash || looks[i].shape != looks[k].shape) << i << " and " << k;
      }
    }
  }
}

TEST(Plot, DoesNotGiveAnAskedForColourTwice) {
  const std::vector<Look> looks =
      looks_of({.id = "p", .series = {{.name = "a"}, {.name = "b", .colour = Colour::blue}}});
  EXPECT_NE(looks[0].ink.name, "blue");
  EXPECT_EQ(looks[1].ink.name, "blue");
}

TEST(Plot, KeepsLabelsOfMarkersApart) {
  Plot plot = one_series({.x = {0, 10}, .y = {0, 10}});
  for (int i = 0; i < 5; ++i) plot.vertical.push_back({5.0 + 0.05 * i, "marker " + std::to_string(i)});
  plot.horizontal = {{5.0, "across"}};
  const std::vector<Word> labels = words(svg(plot), "halo");
  ASSERT_EQ(labels.size(), 6u);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const bool beside = std::abs(labels[i].x - labels[k].x) > 40.0;
      EXPECT_TRUE(beside || std::abs(labels[i].y - labels[k].y) > 12.0)
          << labels[i].text << ", " << labels[k].text;
    }
  }
}

TEST(Plot, ReachesAsFarAsItsMarkers) {
  Plot plot = one_series({.x = {0, 1}, .y = {0.02, 0.03}});
  plot.horizontal = {{0.003, "aim"}};
  const std::string picture = svg(plot);
  EXPECT_LE(y_ruler(picture).from_value, 0.003);
  EXPECT_THAT(picture, HasSubstr(">aim<"));
}

TEST(Plot, WritesNamesBelowWhatTheyName) {
  Plot plot = one_series({.x = {0, 1, 2}, .y = {3, 1, 2}, .style = Style::dots});
  plot.x_names = {"line", "circle", "chaotic"};
  const std::string picture = svg(plot);
  const std::vector<Word> names = words(picture, "tick x");
  const std::vector<Point> dots = points_of(path_of(picture, "dots"));
  ASSERT_EQ(names.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(names[i].x, dots[i].x, kRoundingPx);
  EXPECT_EQ(names[1].text, "circle");
}

TEST(Plot, TellsReadersOfTheScreenWhatItShows) {
  Plot plot = one_series({.name = "filtered", .x = {0, 100}, .y = {0.002, 0.0125}});
  plot.horizontal = {{0.01, "aim"}};
  EXPECT_THAT(
      svg(plot),
      HasSubstr("Across: time (s), from 0 to 100. Up: error (m), from 0.002 to 0.014. filtered: 2 points, "
                "from 0.002 to 0.0125. Line at 0.01: aim.</desc>"));
}

TEST(Plot, IsStyledByItselfOnlyAsAFile) {
  const Plot plot = one_series({.x = {0, 1}, .y = {0, 1}});
  EXPECT_THAT(svg(plot), HasSubstr("<style>"));
  EXPECT_THAT(draw(plot, {.standalone = false}), Not(HasSubstr("<style>")));
}

}  // namespace
}  // namespace skylight::service::report
