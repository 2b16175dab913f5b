// The sensor's inner loops: the two versions give the same bytes, and the random numbers are what they claim.
#include "sim/camera/noise_rows.hpp"

#include <array>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

namespace skylight::sim {
namespace {

constexpr std::array kCounts{1, 31, 32, 255, 256, 257, 1920, 5760};

TEST(NoiseRows, AreTheSameWithAndWithoutVectors) {
  for (const int count : kCounts) {
    NoiseRow plain(count);
    NoiseRow fast(count);
    plain_rows().random(plain, 12345, {7, 9});
    fast_rows().random(fast, 12345, {7, 9});
    ASSERT_EQ(plain.values, fast.values);

    const auto size = static_cast<std::size_t>(count);
    std::vector<std::uint16_t> mean(size);
    std::vector<float> metres(size);
    for (std::size_t i = 0; i < size; ++i) {
      mean[i] = static_cast<std::uint16_t>(i * 7919 % 65536);
      metres[i] = i % 11 == 0 ? 0.0F : static_cast<float>(i * 131 % 9000) * 1e-3F;
    }
    std::vector<std::uint8_t> grey_plain(size);
    std::vector<std::uint8_t> grey_fast(size);
    ExposeRow expose{mean.data(), plain.values.data(), grey_plain.data(), count, 0.9F / 128.0F, 3e-7F, 1e-5F};
    plain_rows().expose(expose);
    expose.out = grey_fast.data();
    fast_rows().expose(expose);
    EXPECT_EQ(grey_plain, grey_fast) << count;

    std::vector<std::uint16_t> depth_plain(size);
    std::vector<std::uint16_t> depth_fast(size);
    for (const bool in_disparity : {true, false}) {
      DepthRow depth{metres.data(), plain.values.data(),        depth_plain.data(),
                     count,         {0.003F, -0.002F, 0.004F},  2.5F,
                     1001.0F,       in_disparity ? 1e6F : 0.5F, in_disparity,
                     8000.0F};
      plain_rows().depth(depth);
      depth.out = depth_fast.data();
      fast_rows().depth(depth);
      EXPECT_EQ(depth_plain, depth_fast) << count;
    }
  }
}

TEST(NoiseRows, HoldNumbersOfMeanZeroAndTheStatedSpread) {
  NoiseRow row(5760);
  double sum = 0.0;
  double squares = 0.0;
  double fourth = 0.0;
  double count = 0.0;
  for (std::uint32_t y = 0; y < 200; ++y) {
    fast_rows().random(row, y * static_cast<std::uint32_t>(row.words.size() / 2), {1, 2});
    for (const std::int16_t value : row.values) {
      const double z = value / kNoiseSigma;
      sum += z;
      squares += z * z;
      fourth += z * z * z * z;
      count += 1.0;
    }
  }
  EXPECT_NEAR(sum / count, 0.0, 5.0 / std::sqrt(count));
  EXPECT_NEAR(squares / count, 1.0, 5.0 * std::sqrt(2.0 / count));
  EXPECT_NEAR(fourth / count, 3.0 - 1.2 / kMixed, 0.03);  // excess kurtosis of a sum of 16 uniform numbers
}

/// The sixteen sums that share their bytes are orthogonal: no pair of places of a row goes together, nor do
/// their squares.
TEST(NoiseRows, AreUncorrelatedWhereTheyShareTheirBytes) {
  NoiseRow row(256);
  const int rows = 20000;
  std::array<std::array<double, kMixed>, kMixed> products{};
  std::array<std::array<double, kMixed>, kMixed> squares{};
  for (int y = 0; y < rows; ++y) {
    fast_rows().random(row, static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(row.words.size() / 2),
                       {3, 4});
    for (std::size_t i = 0; i < kMixed; ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const double a = row.values[i * 16 + 5] / kNoiseSigma;
        const double b = row.values[k * 16 + 5] / kNoiseSigma;
        products[i][k] += a * b;
        squares[i][k] += (a * a - 1.0) * (b * b - 1.0);
      }
    }
  }
  for (std::size_t i = 0; i < kMixed; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_NEAR(products[i][k] / rows, 0.0, 5.0 / std::sqrt(1.0 * rows)) << i << " " << k;
      // The sum of all squares is that of the bytes: -1.2 / 16 between any two.
      EXPECT_NEAR(squares[i][k] / rows, -1.2 / kMixed, 10.0 / std::sqrt(1.0 * rows)) << i << " " << k;
    }
  }
}

}  // namespace
}  // namespace skylight::sim
