#include "service/report/axis.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "sample.hpp"

namespace skylight::service::report {
namespace {

// 1, 2 or 5 times a power of ten, told by its decimal digits.
bool is_round(double step) {
  char digits[40];
  std::snprintf(digits, sizeof digits, "%.8e", step);
  const std::string mantissa(digits, 10);
  return mantissa == "1.00000000" || mantissa == "2.00000000" || mantissa == "5.00000000";
}

// What a reader takes a label for: "−0.5", "2×10⁻⁶", "10⁴".
double read_label(std::string label) {
  constexpr std::array<const char*, 11> kRaised{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹", "⁻"};
  constexpr const char* kPlain = "0123456789-";
  const auto replace = [&label](const std::string& from, const std::string& to) {
    for (std::size_t at = label.find(from); at != std::string::npos; at = label.find(from)) {
      label.replace(at, from.size(), to);
    }
  };
  replace("−", "-");
  bool power = false;
  for (std::size_t i = 0; i < kRaised.size(); ++i) {
    power = power || label.find(kRaised[i]) != std::string::npos;
    replace(kRaised[i], std::string(1, kPlain[i]));
  }
  if (!power) return std::strtod(label.c_str(), nullptr);
  const std::size_t times = label.find("×10");
  if (times == std::string::npos) {  // 10⁴: as 1×10⁴
    const bool minus = label[0] == '-';
    return (minus ? -1.0 : 1.0) * std::strtod(("1e" + label.substr(minus ? 3 : 2)).c_str(), nullptr);
  }
  return std::strtod((label.substr(0, times) + "e" + label.substr(times + std::string("×10").size())).c_str(),
                     nullptr);
}

AxisWish random_wish(std::uint64_t n) {
  const double size = std::pow(10.0, 30.0 * noise(5 * n) - 15.0);
  const double middle = size * (noise(5 * n + 1) - 0.5) * std::pow(10.0, 4.0 * noise(5 * n + 2));
  const double half = 0.5 * size * (0.01 + noise(5 * n + 3));
  return {.low = middle - half, .high = middle + half, .ticks = 4 + static_cast<int>(5.0 * noise(5 * n + 4))};
}

TEST(Axis, HasThreeToTenRoundTicksThatCoverTheData) {
  for (std::uint64_t n = 0; n < 3000; ++n) {
    const AxisWish wish = random_wish(n);
    const Axis axis = make_axis(wish);
    SCOPED_TRACE("range " + std::to_string(n));
    ASSERT_GE(axis.ticks.size(), 3u);
    ASSERT_LE(axis.ticks.size(), 10u);
    ASSERT_TRUE(is_round(axis.step)) << axis.step;
    for (std::size_t i = 0; i < axis.ticks.size(); ++i) {
      ASSERT_NEAR(axis.ticks[i] / axis.step, std::round(axis.ticks[i] / axis.step), 1e-6);
      if (i > 0) {
        ASSERT_NEAR((axis.ticks[i] - axis.ticks[i - 1]) / axis.step, 1.0, 1e-6);
      }
    }
    const double slack = 1e-6 * axis.step;
    ASSERT_EQ(axis.low, axis.ticks.front());
    ASSERT_EQ(axis.high, axis.ticks.back());
    ASSERT_TRUE(axis.low <= wish.low + slack && wish.low < axis.low + axis.step + slack);
    ASSERT_TRUE(axis.high >= wish.high - slack && wish.high > axis.high - axis.step - slack);
  }
}

TEST(Axis, KeepsFixedEndsAndTicksWithinThem) {
  for (std::uint64_t n = 0; n < 3000; ++n) {
    AxisWish wish = random_wish(n);
    wish.fixed = {.low = wish.low, .high = wish.high};
    const Axis axis = make_axis(wish);
    ASSERT_EQ(axis.low, wish.low);
    ASSERT_EQ(axis.high, wish.high);
    ASSERT_GE(axis.ticks.size(), 3u);
    ASSERT_LE(axis.ticks.size(), 10u);
    const double slack = 1e-6 * axis.step;
    ASSERT_TRUE(axis.ticks.front() >= axis.low - slack && axis.ticks.front() < axis.low + axis.step + slack);
    ASSERT_TRUE(axis.ticks.back() <= axis.high + slack && axis.ticks.back() > axis.high - axis.step - slack);
  }
}

TEST(Axis, WithLogarithmHasRoundTicksThatCoverTheData) {
  for (std::uint64_t n = 0; n < 2000; ++n) {
    const double low = std::pow(10.0, 20.0 * noise(3 * n) - 10.0);
    const double decades = std::pow(10.0, 3.0 * noise(3 * n + 1) - 1.7);  // 0.02 to 20
    const AxisWish wish{.low = low, .high = low * std::pow(10.0, decades), .log = true, .ticks = 5};
    const Axis axis = make_axis(wish);
    SCOPED_TRACE(std::to_string(wish.low) + " and " + std::to_string(decades) + " decades");
    ASSERT_GE(axis.ticks.size(), 3u);
    ASSERT_LE(axis.ticks.size(), 10u);
    ASSERT_GT(axis.low, 0.0);
    ASSERT_LE(axis.low, wish.low * (1.0 + 1e-8));
    ASSERT_GE(axis.high, wish.high * (1.0 - 1e-8));
    if (decades < 1.0) continue;  // there ticks stand as on a linear axis
    for (const double tick : axis.ticks) ASSERT_TRUE(is_round(tick)) << tick;
  }
}

TEST(Axis, WritesItsTicksSoThatReadersGetThemBack) {
  const auto expect_labels = [](const Axis& axis) {
    ASSERT_EQ(axis.labels.size(), axis.ticks.size());
    const double size = std::max(std::abs(axis.low), std::abs(axis.high));
    for (std::size_t i = 0; i < axis.ticks.size(); ++i) {
      ASSERT_NEAR(read_label(axis.labels[i]), axis.ticks[i], 1e-9 * size) << axis.labels[i];
      if (i > 0) {
        ASSERT_NE(axis.labels[i], axis.labels[i - 1]);
      }
    }
  };
  for (std::uint64_t n = 0; n < 1000; ++n) expect_labels(make_axis(random_wish(n)));
  for (int e = -9; e < 9; ++e) {
    const double low = std::pow(10.0, e);
    expect_labels(make_axis({.low = low, .high = 300.0 * low, .log = true}));
    expect_labels(make_axis({.low = low, .high = 1e5 * low, .log = true}));
  }
  expect_labels(make_axis({.low = 1e9, .high = 1e9 + 10.0}));
}

TEST(Axis, PutsPlainDigitsWhereTheyAreShort) {
  EXPECT_EQ(make_axis({.low = 0.0, .high = 0.1, .ticks = 6}).labels,
            (std::vector<std::string>{"0.00", "0.02", "0.04", "0.06", "0.08", "0.10"}));
  EXPECT_EQ(make_axis({.low = -1.0, .high = 1.0, .ticks = 5}).labels,
            (std::vector<std::string>{"−1.0", "−0.5", "0.0", "0.5", "1.0"}));
}

TEST(Axis, ReachesToBothSidesOfASingleValue) {
  for (const double value : {0.0, 5.0, -5.0, 1e-12, -1e90, 1e100}) {
    const Axis axis = make_axis({.low = value, .high = value});
    EXPECT_LT(axis.low, value);
    EXPECT_GT(axis.high, value);
  }
  const Axis log = make_axis({.low = 0.02, .high = 0.02, .log = true});
  EXPECT_LT(log.low, 0.02);
  EXPECT_GT(log.high, 0.02);
}

TEST(Axis, LogarithmGivesEqualLengthsToEqualRatios) {
  const Axis axis = make_axis({.low = 0.001, .high = 10.0, .log = true});
  EXPECT_DOUBLE_EQ(axis.share(0.001), 0.0);
  EXPECT_NEAR(axis.share(0.01), 0.25, 1e-12);
  EXPECT_NEAR(axis.share(10.0), 1.0, 1e-12);
}

TEST(EqualAxes, HaveOneStepAndHoldTheData) {
  for (std::uint64_t n = 0; n < 500; ++n) {
    const AxisWish x{.low = -2.0 * noise(4 * n), .high = 3.0 * noise(4 * n + 1), .ticks = 6};
    const AxisWish y{.low = -2.0 * noise(4 * n + 2), .high = 3.0 * noise(4 * n + 3), .ticks = 6};
    const AxisPair pair = make_equal_axes(x, y);
    ASSERT_EQ(pair.x.step, pair.y.step);
    ASSERT_TRUE(pair.x.low < x.low && pair.x.high > x.high && pair.y.low < y.low && pair.y.high > y.high);
    for (const Axis& axis : {pair.x, pair.y}) {
      ASSERT_GE(axis.ticks.size(), 3u);
      ASSERT_LE(axis.ticks.size(), 10u);
    }
  }
}

TEST(EqualAxes, GiveAStraightRouteAQuarterOfItsLength) {
  const AxisPair pair = make_equal_axes({.low = 0.0, .high = 4.0}, {.low = 1.0, .high = 1.0});
  EXPECT_GE(pair.y.high - pair.y.low, 1.0);
  EXPECT_NEAR((pair.y.low + pair.y.high) / 2.0, 1.0, 1e-12);
}

}  // namespace
}  // namespace skylight::service::report
