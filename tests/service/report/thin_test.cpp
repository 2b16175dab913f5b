#include "service/report/thin.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "sample.hpp"

namespace skylight::service::report {
namespace {

double distance_to(const std::vector<Point>& line, Point p) {
  double least = 1e9;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Point a = line[i];
    const Point b = line[i + 1];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    double along =
        length > 0.0 ? ((p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y)) / (length * length) : 0.0;
    along = std::clamp(along, 0.0, 1.0);
    least = std::min(least, std::hypot(p.x - a.x - along * (b.x - a.x), p.y - a.y - along * (b.y - a.y)));
  }
  return least;
}

struct Column {
  Point lowest, highest;
};
std::map<long, Column> columns_of(const std::vector<Point>& points) {
  std::map<long, Column> out;
  for (const Point& p : points) {
    Column& column = out.try_emplace(std::lround(std::floor(p.x)), Column{p, p}).first->second;
    if (p.y < column.lowest.y) column.lowest = p;
    if (p.y > column.highest.y) column.highest = p;
  }
  return out;
}

TEST(ThinLine, KeepsTheLowestAndTheHighestOfEachPixelColumn) {
  std::vector<Point> noisy;
  for (std::uint64_t i = 0; i < 40000; ++i)
    noisy.push_back({static_cast<double>(i) / 100.0, 200.0 * noise(i)});
  noisy[12345].y = 900.0;
  noisy[23456].y = -700.0;
  const std::vector<Point> thin = thin_line(noisy);
  EXPECT_LE(thin.size(), 4u * 400u);
  EXPECT_EQ(thin.front().y, noisy.front().y);
  EXPECT_EQ(thin.back().y, noisy.back().y);
  for (const auto& [x, column] : columns_of(noisy)) {
    ASSERT_LE(distance_to(thin, column.lowest), 0.16) << "column " << x;
    ASSERT_LE(distance_to(thin, column.highest), 0.16) << "column " << x;
  }
}

TEST(ThinLine, LeavesNoPointOfACurveBehindByMoreThanAThirdOfAPixel) {
  std::vector<Point> spiral;
  for (int i = 0; i < 20000; ++i) {
    const double turn = 0.002 * i;
    spiral.push_back({300.0 + 5.0 * turn * std::cos(turn), 300.0 + 5.0 * turn * std::sin(turn)});
  }
  const std::vector<Point> thin = thin_line(spiral);
  EXPECT_LT(thin.size(), 1000u);
  for (std::size_t i = 0; i < spiral.size(); i += 7) ASSERT_LE(distance_to(thin, spiral[i]), 0.31) << i;
}

TEST(ThinLine, NeedsTwoPointsForAStraightOne) {
  std::vector<Point> straight;
  for (int i = 0; i <= 1000; ++i) straight.push_back({0.3 * i, 0.1 * i});
  const std::vector<Point> thin = thin_line(straight);
  ASSERT_EQ(thin.size(), 2u);
  EXPECT_EQ(thin.back().x, straight.back().x);
  EXPECT_TRUE(thin_line({}).empty());
  EXPECT_EQ(thin_line({{1.0, 2.0}}).size(), 1u);
}

TEST(ThinDots, KeepsTheOutermostAndOneNearEachThatGoes) {
  std::vector<Point> cloud;
  for (std::uint64_t i = 0; i < 20000; ++i) cloud.push_back({600.0 * noise(2 * i), 300.0 * noise(2 * i + 1)});
  cloud[777] = {-50.0, 150.0};
  cloud[888] = {300.0, 950.0};
  const std::vector<std::size_t> kept = thin_dots(cloud, 4000);
  EXPECT_LE(kept.size(), 4004u);
  EXPECT_GT(kept.size(), 2000u);
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  for (const std::size_t outer : {777u, 888u})
    EXPECT_TRUE(std::binary_search(kept.begin(), kept.end(), outer));
  for (std::size_t i = 0; i < cloud.size(); i += 101) {
    double nearest = 1e9;
    for (const std::size_t k : kept) {
      nearest = std::min(nearest, std::hypot(cloud[k].x - cloud[i].x, cloud[k].y - cloud[i].y));
    }
    ASSERT_LE(nearest, 12.0) << i;  // 180 000 square pixels for 4000 dots: cells of about 7 px
  }
}

TEST(ThinDots, KeepsTheOutermostOfMuchCloserOnes) {
  std::vector<Point> cluster;
  for (std::uint64_t i = 0; i < 500; ++i)
    cluster.push_back({20.0 + 0.1 * noise(2 * i), 30.0 + 0.1 * noise(2 * i + 1)});
  const std::vector<std::size_t> kept = thin_dots(cluster);
  EXPECT_LT(kept.size(), 12u);
  const auto leftmost =
      std::min_element(cluster.begin(), cluster.end(), [](Point a, Point b) { return a.x < b.x; });
  const auto highest =
      std::max_element(cluster.begin(), cluster.end(), [](Point a, Point b) { return a.y < b.y; });
  for (const auto outer : {leftmost, highest}) {
    EXPECT_TRUE(
        std::binary_search(kept.begin(), kept.end(), static_cast<std::size_t>(outer - cluster.begin())));
  }
}

TEST(ThinDots, KeepsAllOfAFewAndOneOfManyAtOnePlace) {
  EXPECT_EQ(thin_dots({{1, 1}, {5, 5}, {9, 2}}).size(), 3u);
  EXPECT_EQ(thin_dots(std::vector<Point>(1000, Point{3.0, 4.0})).size(), 1u);
  EXPECT_TRUE(thin_dots({}).empty());
}

}  // namespace
}  // namespace skylight::service::report
