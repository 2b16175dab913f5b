// Sensor noise against the models that it follows.
#include "sim/camera/noise.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace skylight::sim {
namespace {

constexpr int kFrames = 200;

/// One mean for all pixels.
struct Flat {
  Flat(double grey, const SensorSpec& sensor_in, const cv::Size& size = {48, 32})
      : mean(size, CV_16UC3, cv::Scalar::all(static_cast<double>(std::lround(grey * kGreyOne)))),
        sensor(sensor_in) {}
  cv::Mat shot(const NoiseStream& stream) const {
    cv::Mat image;
    expose({mean, {}}, sensor, stream, image);
    return image;
  }
  cv::Mat mean;
  SensorSpec sensor;
};

/// Mean and variance of all values of the pictures that were added.
class Moments {
 public:
  void add(const cv::Mat& image) {
    cv::Mat values;
    image.convertTo(values, CV_64F);
    sum_ += cv::sum(values.reshape(1))[0];
    squares_ += values.dot(values);  // over all channels
    count_ += static_cast<double>(values.total()) * values.channels();
  }
  double mean() const { return sum_ / count_; }
  double variance() const { return squares_ / count_ - mean() * mean(); }

 private:
  double sum_ = 0.0;
  double squares_ = 0.0;
  double count_ = 0.0;
};

/// Share of the sums of 16 random bytes that lie more than so many standard deviations above their mean,
/// counted out by folding the bytes' distribution with itself.
double tail(double sigmas) {
  std::vector<double> sums{1.0};
  for (int i = 0; i < 16; ++i) {
    std::vector<double> folded(sums.size() + 255, 0.0);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      for (std::size_t byte = 0; byte < 256; ++byte) folded[k + byte] += sums[k] / 256.0;
    }
    sums = folded;
  }
  double share = 0.0;
  for (std::size_t k = 0; k < sums.size(); ++k) {
    if (static_cast<double>(k) > 16 * 127.5 + sigmas * std::sqrt(16 * 65535.0 / 12.0)) share += sums[k];
  }
  return share;
}

TEST(SensorNoise, FollowsThePhotonTransferCurve) {
  for (const double gain : {1.0, 4.0, 16.0}) {
    SensorSpec sensor;
    sensor.gain = gain;
    for (const double grey : {20.0, 60.25, 120.5, 190.0}) {
      const Flat flat(grey, sensor);
      Moments moments;
      for (std::uint64_t i = 0; i < kFrames; ++i) moments.add(flat.shot({1, 0, i, false}));
      // Written out here once more: electrons at this grey, Poisson's variance, read noise, rounding to 8
      // bits.
      const double grey_per_electron = 255.0 / (14600.0 / gain);
      const double electrons = grey / grey_per_electron;
      const double expected = (electrons + 3.2 * 3.2) * grey_per_electron * grey_per_electron + 1.0 / 12.0;
      EXPECT_NEAR(moments.mean(), grey, 0.02) << "gain " << gain;
      EXPECT_NEAR(moments.variance() / expected, 1.0,
                  grey_per_electron * electrons * grey_per_electron > 0.3 ? 0.02 : 0.08)
          << "gain " << gain << " grey " << grey;
    }
  }
}

TEST(SensorNoise, OffGivesTheRoundedMean) {
  SensorSpec sensor;
  sensor.noise = false;
  EXPECT_EQ(
      cv::norm(Flat(77.4, sensor).shot({}), cv::Mat(32, 48, CV_8UC3, cv::Scalar::all(77)), cv::NORM_INF),
      0.0);
  EXPECT_EQ(
      cv::norm(Flat(300.0, sensor).shot({}), cv::Mat(32, 48, CV_8UC3, cv::Scalar::all(255)), cv::NORM_INF),
      0.0);
}

TEST(SensorNoise, IsIndependentBetweenPixelsChannelsAndFrames) {
  SensorSpec sensor;
  sensor.gain = 16.0;
  const cv::Size size(256, 128);
  const Flat flat(120.0, sensor, size);
  const auto values = [&](const NoiseStream& stream) {
    cv::Mat result;
    flat.shot(stream).reshape(1).convertTo(result, CV_64F);
    return cv::Mat(result - cv::mean(result)[0]);
  };
  const auto correlation = [](const cv::Mat& a, const cv::Mat& b) {
    return a.dot(b) / std::sqrt(a.dot(a) * b.dot(b));
  };
  const cv::Mat first = values({5, 0, 10, false});
  const double limit = 4.5 / std::sqrt(3.0 * size.area());  // 4.5 sigma of chance
  for (const NoiseStream& other :
       {NoiseStream{5, 0, 11, false}, NoiseStream{5, 1, 10, false}, NoiseStream{6, 0, 10, false}}) {
    EXPECT_LT(std::abs(correlation(first, values(other))), limit);
  }
  for (const int lag : {1, 2, 3, 6, 16, 48, 64, 96,
                        256}) {  // columns of single values: 1 and 2 are other channels, 3 the next pixel
    const cv::Rect left(0, 0, first.cols - lag, first.rows);
    EXPECT_LT(std::abs(correlation(first(left), first(left + cv::Point(lag, 0)))), limit) << lag;
  }
  const cv::Rect upper(0, 0, first.cols, first.rows - 1);
  EXPECT_LT(std::abs(correlation(first(upper), first(upper + cv::Point(0, 1)))), limit);
}

TEST(SensorNoise, IsTheSameForTheSameStream) {
  const Flat flat(120.0, SensorSpec{});
  const NoiseStream stream{9, 1, 1234, false};
  EXPECT_EQ(cv::norm(flat.shot(stream), flat.shot(stream), cv::NORM_INF), 0.0);
}

TEST(SensorNoise, ScalesPhotonNoiseWithTheLightAndEverythingWithTheGain) {
  SensorSpec sensor;
  sensor.gain = 4.0;
  const cv::Size size(768, 2);
  const Flat flat(50.0, sensor, size);
  const std::array<RowLight, 2> rows{RowLight{3.0F, 1.0F}, RowLight{1.0F, 3.0F}};  // the same mean, 150
  std::array<Moments, 2> moments;
  for (std::uint64_t i = 0; i < 100; ++i) {
    cv::Mat image;
    expose({flat.mean, rows}, sensor, {3, 0, i, false}, image);
    for (int y = 0; y < 2; ++y) moments[static_cast<std::size_t>(y)].add(image.row(y));
  }
  const double per_electron = 255.0 * 4.0 / 14600.0;
  const double read = 3.2 * per_electron;
  const double brighter = per_electron * 150.0 + read * read;
  const double amplified = 9.0 * (per_electron * 50.0 + read * read);
  EXPECT_NEAR(moments[0].mean(), 150.0, 0.05);
  EXPECT_NEAR(moments[1].mean(), 150.0, 0.05);
  EXPECT_NEAR(moments[0].variance() / (brighter + 1.0 / 12.0), 1.0, 0.02);
  EXPECT_NEAR(moments[1].variance() / (amplified + 1.0 / 12.0), 1.0, 0.02);
}

TEST(SensorNoise, InTheDarkIsTheReadNoiseAlone) {
  SensorSpec sensor;
  sensor.gain = 100.0;  // 5.6 grey levels
  const Flat flat(0.0, sensor, {512, 64});
  // Half of the values are clipped to 0: the standard deviation is told by the share above it.
  std::array<double, 3> above{};
  const double sigma = 3.2 * 255.0 * 100.0 / 14600.0;
  double count = 0.0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const cv::Mat image = flat.shot({4, 0, i, false}).reshape(1);
    for (std::size_t k = 0; k < above.size(); ++k) {
      above[k] += cv::countNonZero(image > std::floor((static_cast<double>(k) + 0.5) * sigma));
    }
    count += static_cast<double>(image.total());
  }
  for (std::size_t k = 0; k < above.size(); ++k) {
    const double limit = (std::floor((static_cast<double>(k) + 0.5) * sigma) + 0.5) / sigma;
    EXPECT_NEAR(above[k] / count / tail(limit), 1.0, 0.02) << limit << " sigma";
  }
}

TEST(SensorNoise, IsNearlyNormal) {
  SensorSpec sensor;
  sensor.gain = 16.0;
  const Flat flat(128.0, sensor, {1024, 64});
  const double sigma = std::sqrt(std::pow(noise_sigma(sensor, 128.0), 2) + 1.0 / 12.0);
  std::array<double, 4> beyond{};
  double count = 0.0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    cv::Mat off;
    cv::absdiff(flat.shot({8, 0, i, false}).reshape(1), cv::Scalar(128), off);
    for (std::size_t k = 0; k < beyond.size(); ++k) {
      beyond[k] += cv::countNonZero(off > std::floor(static_cast<double>(k + 1) * sigma));
    }
    count += static_cast<double>(off.total());
  }
  for (std::size_t k = 0; k < beyond.size(); ++k) {
    const double limit = (std::floor(static_cast<double>(k + 1) * sigma) + 0.5) / sigma;
    const double share = 2.0 * tail(limit);
    EXPECT_NEAR(beyond[k] / count, share, 0.01 * share + 4.0 * std::sqrt(share / count)) << k + 1 << " sigma";
    const double normal = std::erfc(limit / std::sqrt(2.0));
    if (k < 2) {
      EXPECT_NEAR(share / normal, 1.0, 0.05);  // fewer beyond three sigma: these are sums of 16 bytes
    }
  }
}

TEST(SensorNoise, StaysClippedWhereTheLightIsTooMuch) {
  const Flat flat(400.0, SensorSpec{});
  EXPECT_EQ(cv::norm(flat.shot({}), cv::Mat(32, 48, CV_8UC3, cv::Scalar::all(255)), cv::NORM_INF), 0.0);
}

TEST(SensorNoise, IsTheSameForAnyPartOfTheRows) {
  const Flat flat(120.0, SensorSpec{});
  const NoiseStream stream{9, 1, 77, false};
  cv::Mat parts(flat.mean.size(), CV_8UC3);
  expose_rows({flat.mean, {}}, SensorSpec{}, stream, {20, 32}, parts);
  expose_rows({flat.mean, {}}, SensorSpec{}, stream, {0, 20}, parts);
  EXPECT_EQ(cv::norm(flat.shot(stream), parts, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace skylight::sim
