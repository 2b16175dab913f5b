// What rows are exposed with, against the closed forms.
#include "sim/camera/exposure.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace skylight::sim {
namespace {

double steady(Duration) {
  return 1.0;
}

CameraSpec rolling_camera() {
  CameraSpec camera;
  camera.width_px = 64;
  camera.height_px = 480;
  camera.shutter = Shutter::rolling;
  camera.readout_s = 0.020;
  camera.exposure_s = 0.004;
  return camera;
}

/// The mean of the lamps' light over an exposure, added up in small steps.
double mean_light(const FlickerSpec& flicker, double middle_s, double exposure_s) {
  constexpr int kSteps = 2000;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = middle_s + ((i + 0.5) / kSteps - 0.5) * exposure_s;
    sum += 1.0 + flicker.depth * std::sin(2.0 * std::numbers::pi * flicker.frequency_hz * t);
  }
  return sum / kSteps;
}

TEST(Flicker, GivesEachRowTheMeanOfTheLightOverItsExposure) {
  const CameraSpec camera = rolling_camera();
  const FlickerSpec flicker{0.3, 100.0};
  const auto rows = ExposureControl(camera, flicker).rows(from_seconds(0.3217), steady);
  ASSERT_EQ(rows.size(), 480U);
  for (std::size_t y = 0; y < rows.size(); y += 37) {
    const double middle = 0.3217 + (static_cast<double>(y) - 239.5) / 479.0 * 0.020;
    EXPECT_NEAR(rows[y].light, mean_light(flicker, middle, 0.004), 1e-5) << y;
    EXPECT_EQ(rows[y].gain, 1.0F);
  }
}

TEST(Flicker, DrawsBandsOfTheAttenuatedDepth) {
  const FlickerSpec flicker{0.3, 100.0};
  const auto rows = ExposureControl(rolling_camera(), flicker).rows(from_seconds(1.0), steady);
  float least = 2.0F;
  float most = 0.0F;
  for (const RowLight& row : rows) {
    least = std::min(least, row.light);
    most = std::max(most, row.light);
  }
  const double depth = 0.3 * std::sin(std::numbers::pi * 0.4) / (std::numbers::pi * 0.4);  // 0.4 periods
  EXPECT_NEAR((most - least) / (most + least), depth, 1e-3);
  // 20 ms of readout show two periods: row 120 is half a period, 5 ms, before row 240.
  EXPECT_NEAR(rows[120].light + rows[240].light, 2.0, 0.01);
}

TEST(Flicker, IsNotSeenByAnExposureOfWholePeriods) {
  CameraSpec camera = rolling_camera();
  camera.exposure_s = 0.02;
  for (const RowLight& row : ExposureControl(camera, {0.5, 100.0}).rows(from_seconds(0.123), steady))
    EXPECT_NEAR(row.light, 1.0, 1e-6);
}

TEST(Flicker, IsTheSameInAllRowsOfAGlobalShutter) {
  CameraSpec camera = rolling_camera();
  camera.shutter = Shutter::global;
  const FlickerSpec flicker{0.3, 100.0};
  const auto rows = ExposureControl(camera, flicker).rows(from_seconds(0.1024), steady);
  for (const RowLight& row : rows) EXPECT_NEAR(row.light, mean_light(flicker, 0.1024, 0.004), 1e-5);
}

TEST(LightLevel, IsTheMeanOverTheRowsExposure) {
  CameraSpec camera = rolling_camera();
  const auto rows = ExposureControl(camera, {0.0, 100.0}).rows(from_seconds(1.0), [](Duration t) {
    return 2.0 + 10.0 * (to_seconds(t) - 1.0);
  });
  EXPECT_NEAR(rows[0].light, 1.9, 1e-5);  // 10 ms before the middle
  EXPECT_NEAR(rows[479].light, 2.1, 1e-5);
  camera.shutter = Shutter::global;
  const auto half = ExposureControl(camera, {0.0, 100.0}).rows(from_seconds(1.0), [](Duration t) {
    return t < from_seconds(1.0) ? 0.0 : 1.0;
  });
  EXPECT_NEAR(half[0].light, 0.5, 1e-6);  // switched on in its middle
}

CameraSpec automatic() {
  CameraSpec camera;
  camera.width_px = 64;
  camera.height_px = 48;
  camera.auto_exposure.enabled = true;
  camera.auto_exposure.target_grey = 100.0;
  camera.auto_exposure.lag_s = 0.3;
  camera.auto_exposure.max_factor = 4.0;
  return camera;
}

/// The picture that a room of this grey gives.
cv::Mat picture(const ExposureControl& exposure, double grey) {
  const RowLight row = exposure.rows(Duration{0}, steady)[0];
  return {48, 64, CV_8UC3, cv::Scalar::all(std::min(255.0, std::round(grey * row.light * row.gain)))};
}

TEST(AutoExposure, FollowsAStepWithItsTimeConstant) {
  ExposureControl exposure(automatic(), {0.0, 100.0});
  const Duration frame = from_seconds(1.0 / 60.0);
  const double wanted = 100.0 / 40.0;
  for (int i = 1; i <= 90; ++i) {
    exposure.observe(picture(exposure, 40.0), frame);
    const double expected = std::log(wanted) * (1.0 - std::exp(-i / 60.0 / 0.3));
    EXPECT_NEAR(std::log(exposure.factor()), expected, 0.02) << i;  // pictures are whole grey levels
  }
  EXPECT_NEAR(exposure.factor(), wanted, 0.05);
}

TEST(AutoExposure, TakesTheSameTimeAtAnyFrameRate) {
  const auto after_a_lag = [](int frames) {
    ExposureControl exposure(automatic(), {0.0, 100.0});
    for (int i = 0; i < frames; ++i) exposure.observe(picture(exposure, 200.0), from_seconds(0.3 / frames));
    return std::log(exposure.factor());
  };
  EXPECT_NEAR(after_a_lag(3), std::log(0.5) * (1.0 - std::exp(-1.0)), 0.02);
  EXPECT_NEAR(after_a_lag(30), after_a_lag(3), 0.02);
}

TEST(AutoExposure, BrightensByGainAndDarkensByLightWithinItsBounds) {
  ExposureControl exposure(automatic(), {0.0, 100.0});
  for (int i = 0; i < 200; ++i) exposure.observe(picture(exposure, 3.0), from_seconds(0.1));
  EXPECT_NEAR(exposure.factor(), 4.0, 1e-9);
  EXPECT_EQ(exposure.rows(Duration{0}, steady)[0].gain, 4.0F);
  EXPECT_EQ(exposure.rows(Duration{0}, steady)[0].light, 1.0F);
  for (int i = 0; i < 400; ++i)
    exposure.observe(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(255)), from_seconds(0.1));
  EXPECT_NEAR(exposure.factor(), 0.25, 1e-9);
  EXPECT_EQ(exposure.rows(Duration{0}, steady)[0].gain, 1.0F);
  EXPECT_EQ(exposure.rows(Duration{0}, steady)[0].light, 0.25F);
  exposure.observe(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(0)), from_seconds(0.1));  // black: no infinity
  EXPECT_LE(exposure.factor(), 4.0);
}

TEST(AutoExposure, OffChangesNothing) {
  ExposureControl exposure(CameraSpec{}, {0.0, 100.0});
  exposure.observe(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(3)), from_seconds(1.0));
  EXPECT_EQ(exposure.factor(), 1.0);
}

}  // namespace
}  // namespace skylight::sim
