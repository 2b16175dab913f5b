// Random numbers: their moments, and that streams have nothing to do with each other.
#include "sim/world/chance.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace skylight::sim {
namespace {

constexpr int kCount = 100000;

/// Mean and variance of kCount draws.
template <class Draw>
std::pair<double, double> moments(const Draw& draw) {
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const double x = draw();
    sum += x;
    squares += x * x;
  }
  const double mean = sum / kCount;
  return {mean, squares / kCount - mean * mean};
}

TEST(Chance, HasTheMomentsOfItsDistributions) {
  // Tolerances: five standard errors of each figure.
  const double root = std::sqrt(1.0 * kCount);
  for (const std::uint64_t seed : {0U, 1U, 2U}) {
    Chance chance(seed, 9);
    const auto [even, even_variance] = moments([&] { return chance.uniform(); });
    EXPECT_NEAR(even, 0.5, 5.0 * std::sqrt(1.0 / 12.0) / root);
    EXPECT_NEAR(even_variance, 1.0 / 12.0, 5.0 * std::sqrt(1.0 / 180.0) / root);
    const auto [normal, normal_variance] = moments([&] { return chance.normal(); });
    EXPECT_NEAR(normal, 0.0, 5.0 / root);
    EXPECT_NEAR(normal_variance, 1.0, 5.0 * std::sqrt(2.0) / root);
    const auto [wait, wait_variance] = moments([&] { return chance.exponential(2.4); });
    EXPECT_NEAR(wait, 2.4, 5.0 * 2.4 / root);
    EXPECT_NEAR(wait_variance, 2.4 * 2.4, 5.0 * 2.4 * 2.4 * std::sqrt(8.0) / root);
  }
}

TEST(Chance, StreamsOfOneSeedAndSeedsOfOneStreamAreUncorrelated) {
  const auto correlation = [](Chance a, Chance b) {
    return moments([&] { return 12.0 * (a.uniform() - 0.5) * (b.uniform() - 0.5); }).first;
  };
  const double most = 5.0 / std::sqrt(1.0 * kCount);
  EXPECT_NEAR(correlation(Chance(1, 0), Chance(1, 1)), 0.0, most);
  EXPECT_NEAR(correlation(Chance(1, 0), Chance(2, 0)), 0.0, most);
  EXPECT_NEAR(correlation(Chance(0, 1), Chance(1, 0)), 0.0, most);
  EXPECT_NEAR(correlation(Chance(1, 0), Chance(1, 0)), 1.0, 0.02);
}

}  // namespace
}  // namespace skylight::sim
