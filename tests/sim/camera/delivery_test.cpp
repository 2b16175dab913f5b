// Stamps, delays, losses and compression against what the scenario says.
#include "sim/camera/delivery.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace skylight::sim {
namespace {

Duration middle_of(int frame) {
  return from_seconds(0.004 + frame / 30.0);
}

TEST(Delivery, StampsByTheCamerasClock) {
  CameraSpec camera;
  camera.delivery.clock_offset_s = -0.25;
  camera.delivery.clock_drift_ppm = 50.0;
  Delivery delivery(camera, 1, 0);
  EXPECT_EQ(delivery.deliver(0, Duration{0}).stamp, from_seconds(-0.25));
  // An hour later the clock is 50 millionths of an hour, 0.18 s, ahead of where it was.
  EXPECT_NEAR(to_seconds(delivery.deliver(108000, from_seconds(3600.0)).stamp), 3600.0 - 0.25 + 0.18, 1e-6);
}

TEST(Delivery, ComesAfterTheEndOfTheExposureAndTheLatency) {
  CameraSpec camera;
  camera.exposure_s = 0.008;
  camera.delivery.latency_s = 0.030;
  EXPECT_EQ(Delivery(camera, 1, 0).deliver(0, from_seconds(1.0)).at, from_seconds(1.034));
  camera.shutter = Shutter::rolling;  // the last row ends half a readout later
  camera.readout_s = 0.016;
  EXPECT_EQ(Delivery(camera, 1, 0).deliver(0, from_seconds(1.0)).at, from_seconds(1.042));
  EXPECT_EQ(Delivery(camera, 1, 0).deliver(0, from_seconds(1.0)).stamp, from_seconds(1.0));
}

TEST(Delivery, JittersEvenlyWithinItsBounds) {
  CameraSpec camera;
  camera.exposure_s = 0.0;
  camera.delivery.jitter_s = 0.020;  // less than a period: none waits for another
  Delivery delivery(camera, 7, 2);
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kFrames = 4000;
  for (int i = 0; i < kFrames; ++i) {
    const double late =
        to_seconds(delivery.deliver(static_cast<std::uint64_t>(i), middle_of(i)).at - middle_of(i));
    EXPECT_GE(late, 0.0);
    EXPECT_LE(late, 0.020);
    sum += late;
    squares += late * late;
  }
  const double sigma = 0.020 / std::sqrt(12.0);
  EXPECT_NEAR(sum / kFrames, 0.010, 4.0 * sigma / std::sqrt(1.0 * kFrames));
  EXPECT_NEAR(std::sqrt(squares / kFrames - std::pow(sum / kFrames, 2)), sigma, 0.03 * sigma);
}

TEST(Delivery, NeverLetsAFrameOvertake) {
  CameraSpec camera;
  camera.delivery.jitter_s = 0.5;
  camera.delivery.drop_share = 0.2;
  Delivery delivery(camera, 3, 0);
  Duration last = Duration::min();
  for (int i = 0; i < 1000; ++i) {
    const Delivered frame = delivery.deliver(static_cast<std::uint64_t>(i), middle_of(i));
    if (frame.lost) continue;
    EXPECT_GE(frame.at, last);
    EXPECT_LE(frame.at, middle_of(i) + from_seconds(0.5 * camera.exposure_s + 0.5));
    last = frame.at;
  }
}

TEST(Delivery, LosesItsShareOfFramesIndependently) {
  CameraSpec camera;
  camera.delivery.drop_share = 0.1;
  Delivery delivery(camera, 11, 0);
  constexpr int kFrames = 20000;
  int lost = 0;
  int twice = 0;
  bool before = false;
  for (int i = 0; i < kFrames; ++i) {
    const bool now = delivery.deliver(static_cast<std::uint64_t>(i), middle_of(i)).lost;
    lost += now ? 1 : 0;
    twice += now && before ? 1 : 0;
    before = now;
  }
  EXPECT_NEAR(lost, 0.1 * kFrames, 4.0 * std::sqrt(kFrames * 0.1 * 0.9));
  EXPECT_NEAR(twice, 0.01 * kFrames, 5.0 * std::sqrt(kFrames * 0.01));
  camera.delivery.drop_share = 0.0;
  EXPECT_FALSE(Delivery(camera, 11, 0).deliver(0, Duration{0}).lost);
  camera.delivery.drop_share = 1.0;
  EXPECT_TRUE(Delivery(camera, 11, 0).deliver(0, Duration{0}).lost);
}

TEST(Delivery, IsTheSameForTheSameSeedAndAnotherForAnother) {
  CameraSpec camera;
  camera.delivery.jitter_s = 0.01;
  const auto at = [&](std::uint64_t seed, std::uint64_t index) {
    return Delivery(camera, seed, index).deliver(5, middle_of(5)).at;
  };
  EXPECT_EQ(at(1, 0), at(1, 0));
  EXPECT_NE(at(1, 0), at(2, 0));
  EXPECT_NE(at(1, 0), at(1, 1));
}

TEST(Compression, LosesMoreTheLowerTheQualityIs) {
  cv::Mat image(120, 160, CV_8UC3);
  cv::RNG random(5);
  random.fill(image, cv::RNG::UNIFORM, 60, 200);
  cv::GaussianBlur(image, image, {5, 5}, 1.5);
  double last = 0.0;
  for (const int quality : {95, 50, 10}) {
    cv::Mat copy = image.clone();
    compress(quality, copy);
    ASSERT_EQ(copy.size(), image.size());
    ASSERT_EQ(copy.type(), image.type());
    const double error =
        cv::norm(copy, image, cv::NORM_L2) / std::sqrt(3.0 * static_cast<double>(image.total()));
    EXPECT_GT(error, last);
    last = error;
  }
  EXPECT_LT(last, 20.0);
}

}  // namespace
}  // namespace skylight::sim
