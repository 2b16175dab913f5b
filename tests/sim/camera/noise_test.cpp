// Sensor noise against the models that it follows.
#include "sim/camera/noise.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace skylight::sim {
namespace {

constexpr int kFrames = 200;

/// Means in 1/128 grey and the noise's scale, uniform.
struct Flat {
  Flat(double grey, const SensorSpec& sensor, const cv::Size& size = {48, 32})
      : mean(size, CV_16UC3), scale(size, CV_16UC3) {
    const auto value = static_cast<std::uint16_t>(std::lround(grey * kGreyOne));
    mean.setTo(cv::Scalar::all(value));
    scale.setTo(cv::Scalar::all(SensorNoise(sensor).scale(value)));
  }
  cv::Mat shot(const NoiseStream& stream) const {
    cv::Mat image;
    expose(mean, scale, stream, image);
    return image;
  }
  cv::Mat mean, scale;
};

TEST(SensorNoise, FollowsThePhotonTransferCurve) {
  for (const double gain : {1.0, 4.0, 16.0}) {
    SensorSpec sensor;
    sensor.gain = gain;
    for (const double grey : {20.0, 60.25, 120.5, 190.0}) {
      const Flat flat(grey, sensor);
      double sum = 0.0;
      double squares = 0.0;
      for (std::uint64_t i = 0; i < kFrames; ++i) {
        cv::Mat values;
        flat.shot({1, 0, i, false}).convertTo(values, CV_64F);
        sum += cv::sum(values.reshape(1))[0];
        squares += values.dot(values);  // over all channels
      }
      const double count = 3.0 * 48 * 32 * kFrames;
      const double mean = sum / count;
      const double variance = squares / count - mean * mean;
      // Written out here once more: electrons at this grey, Poisson's variance, read noise, rounding to 8
      // bits.
      const double grey_per_electron = 255.0 / (14600.0 / gain);
      const double electrons = grey / grey_per_electron;
      const double expected = (electrons + 3.2 * 3.2) * grey_per_electron * grey_per_electron + 1.0 / 12.0;
      EXPECT_NEAR(mean, grey, 0.02) << "gain " << gain;
      EXPECT_NEAR(variance / expected, 1.0,
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
  for (const int lag :
       {1, 2, 3, 6, 64, 256}) {  // columns of single values: 1 and 2 are other channels, 3 the next pixel
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

TEST(DepthNoise, GrowsWithTheDistanceAsItsModelSays) {
  for (const double metres : {1.0, 2.5, 4.0}) {
    const cv::Mat flat(64, 64, CV_32FC1, cv::Scalar(metres));
    double sum = 0.0;
    double squares = 0.0;
    for (std::uint64_t i = 0; i < 30; ++i) {
      cv::Mat depth;
      measure_depth(flat, DepthSpec{}, {1, 0, i, true}, depth);
      depth.convertTo(depth, CV_64F);
      sum += cv::sum(depth)[0];
      squares += depth.dot(depth);
    }
    const double count = 30.0 * 64 * 64;
    const double mean = sum / count;
    const double expected = 1000.0 * (0.0012 + 0.0019 * std::pow(metres - 0.4, 2));
    EXPECT_NEAR(mean, 1000.0 * metres, 0.3);
    EXPECT_NEAR(std::sqrt(squares / count - mean * mean) / std::hypot(expected, std::sqrt(1.0 / 12.0)), 1.0,
                0.02);
  }
}

TEST(DepthNoise, GivesNoReadingWhereNothingIsOrBeyondTheRange) {
  cv::Mat metres = (cv::Mat_<float>(1, 4) << 0.0F, 3.0F, 12.0F, 200.0F);
  DepthSpec spec;
  spec.noise = false;
  cv::Mat depth;
  measure_depth(metres, spec, {}, depth);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 0), 0);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 1), 3000);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 2), 0);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 3), 0);
}

}  // namespace
}  // namespace skylight::sim
