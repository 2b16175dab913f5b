// Depth readings against the laws that they follow.
#include "sim/camera/depth.hpp"

#include <cmath>
#include <set>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace skylight::sim {
namespace {

CameraSpec camera_of(DepthModel model) {
  CameraSpec camera;
  camera.depth.enabled = true;
  camera.depth.model = model;
  return camera;
}

struct Spread {
  double mean;   ///< mm
  double sigma;  ///< mm
};

Spread spread(const CameraSpec& camera, double metres) {
  const cv::Mat flat(64, 64, CV_32FC1, cv::Scalar(metres));
  double sum = 0.0;
  double squares = 0.0;
  for (std::uint64_t i = 0; i < 30; ++i) {
    cv::Mat depth;
    measure_depth(flat, camera, {1, 0, i, true}, depth);
    depth.convertTo(depth, CV_64F);
    sum += cv::sum(depth)[0];
    squares += depth.dot(depth);
  }
  const double count = 30.0 * 64 * 64;
  return {sum / count, std::sqrt(squares / count - sum / count * sum / count)};
}

/// Noise, steps and the rounding to whole millimetres together.
double expected_sigma(double noise_mm, double step_mm) {
  return std::sqrt(noise_mm * noise_mm + (step_mm * step_mm + 1.0) / 12.0);
}

TEST(DepthNoise, GrowsWithTheDistanceAsItsModelSays) {
  for (const double metres : {1.0, 2.5, 4.0}) {
    const Spread seen = spread(camera_of(DepthModel::structured_light), metres);
    const double noise = 1000.0 * (0.0012 + 0.0019 * std::pow(metres - 0.4, 2));
    EXPECT_NEAR(seen.mean, 1000.0 * metres, 0.3);
    EXPECT_NEAR(seen.sigma / expected_sigma(noise, metres * metres), 1.0, 0.02) << metres;
  }
}

TEST(DepthNoise, OfStereoGrowsWithTheSquareOfTheDistance) {
  for (const double metres : {1.0, 2.0, 4.0}) {
    const Spread seen = spread(camera_of(DepthModel::stereo), metres);
    const double noise = 1000.0 * 0.08 / (424.0 * 0.05) * metres * metres;
    EXPECT_NEAR(seen.mean, 1000.0 * metres, 1.0);
    EXPECT_NEAR(seen.sigma / expected_sigma(noise, metres * metres), 1.0, 0.02) << metres;
    if (metres == 2.0) {
      EXPECT_LT(seen.sigma, 0.02 * 2000.0);  // what the D435's data sheet promises
    }
  }
}

TEST(DepthNoise, OfTimeOfFlightGrowsWithTheDistanceAndKeepsEachCamerasOwnOffset) {
  const CameraSpec camera = camera_of(DepthModel::time_of_flight);
  for (const double metres : {1.0, 2.0, 3.86}) {
    const Spread seen = spread(camera, metres);
    const double noise = 17.0 * metres / 3.86;
    EXPECT_NEAR(seen.sigma / expected_sigma(noise, 1.0), 1.0, 0.02) << metres;
    EXPECT_LT(std::abs(seen.mean - 1000.0 * metres), 11.0 + 0.001 * 1000.0 * metres + 0.3) << metres;
  }
  cv::Mat one;
  cv::Mat other;
  const cv::Mat flat(200, 200, CV_32FC1, cv::Scalar(1.0));
  measure_depth(flat, camera, {1, 0, 0, true}, one);
  measure_depth(flat, camera, {1, 1, 0, true}, other);
  EXPECT_GT(std::abs(cv::mean(one)[0] - cv::mean(other)[0]), 0.2);
}

TEST(DepthNoise, TakesACamerasOwnFigures) {
  CameraSpec camera = camera_of(DepthModel::time_of_flight);
  camera.depth.noise_floor_m = 0.02;
  camera.depth.noise_growth = 0.0;
  EXPECT_NEAR(spread(camera, 1.0).sigma, spread(camera, 3.0).sigma, 0.3);
  EXPECT_NEAR(spread(camera, 2.0).sigma, 20.0, 0.3);
}

TEST(DepthNoise, GivesNoReadingWhereNothingIsOrBeyondTheRange) {
  cv::Mat metres = (cv::Mat_<float>(1, 4) << 0.0F, 3.0F, 12.0F, 200.0F);
  CameraSpec camera = camera_of(DepthModel::structured_light);
  camera.depth.noise = false;
  cv::Mat depth;
  measure_depth(metres, camera, {}, depth);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 0), 0);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 1), 3000);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 2), 0);
  EXPECT_EQ(depth.at<std::uint16_t>(0, 3), 0);
}

std::set<int> readings(const CameraSpec& camera, double metres) {
  const cv::Mat flat(32, 512, CV_32FC1, cv::Scalar(metres));
  cv::Mat depth;
  measure_depth(flat, camera, {1, 0, 0, true}, depth);
  return {depth.begin<std::uint16_t>(), depth.end<std::uint16_t>()};
}

TEST(DepthSteps, OfADisparityGrowWithTheSquareOfTheDistance) {
  for (const DepthModel model : {DepthModel::stereo, DepthModel::structured_light}) {
    CameraSpec camera = camera_of(model);
    camera.depth.step_mm = 4.0;
    for (const double metres : {1.0, 2.0, 4.0}) {
      int last = 0;
      int smallest = 1 << 20;
      for (const int reading : readings(camera, metres)) {
        EXPECT_NEAR(1e6 / 4.0 / reading, std::round(1e6 / 4.0 / reading), 1e6 / 4.0 * 0.6 / reading / reading)
            << "no whole disparity";
        if (last != 0) smallest = std::min(smallest, reading - last);
        last = reading;
      }
      const double nearest = 1e-3 * *readings(camera, metres).begin();
      EXPECT_NEAR(smallest, 4.0 * nearest * nearest, 1.5 + 0.05 * 4.0 * nearest * nearest) << metres;
    }
  }
}

TEST(DepthSteps, OfTimeOfFlightAreTheSameEverywhere) {
  CameraSpec camera = camera_of(DepthModel::time_of_flight);
  camera.depth.step_mm = 5.0;
  for (const double metres : {1.0, 3.0}) {
    for (const int reading : readings(camera, metres)) EXPECT_EQ(reading % 5, 0);
  }
}

/// A near thing before a far wall.
cv::Mat scene(const cv::Rect& thing, double near_m, double far_m) {
  cv::Mat metres(60, 400, CV_32FC1, cv::Scalar(far_m));
  metres(thing).setTo(near_m);
  return metres;
}

cv::Mat missing(const CameraSpec& camera, const cv::Mat& metres) {
  cv::Mat depth;
  measure_depth(metres, camera, {1, 0, 0, true}, depth);
  return depth == 0;
}

TEST(DepthHoles, AreAsWideAsTheSecondEyeIsShadowed) {
  const cv::Rect thing(200, 20, 60, 20);
  for (const DepthModel model : {DepthModel::stereo, DepthModel::structured_light}) {
    CameraSpec camera = camera_of(model);
    const double baseline = model == DepthModel::stereo ? 0.050 : 0.075;
    for (const double factor : {1.0, 3.0}) {
      camera.depth.holes = factor;
      const cv::Mat holes = missing(camera, scene(thing, 1.0, 4.0));
      // Similar triangles: the far place that the second eye sees past the edge.
      const double width = factor * baseline * camera.fx_px * (1.0 / 1.0 - 1.0 / 4.0);
      for (int y = 0; y < holes.rows; ++y) {
        const bool beside = y >= thing.y && y < thing.y + thing.height;
        const int count = cv::countNonZero(holes.row(y));
        EXPECT_NEAR(count, beside ? width : 0.0, beside ? 0.51 : 0.0) << y;
        if (!beside) continue;
        EXPECT_EQ(cv::countNonZero(holes.row(y).colRange(thing.x - count, thing.x)), count) << "to its left";
      }
    }
  }
}

TEST(DepthHoles, AreAPixelOnBothSidesOfAnEdgeInTimeOfFlight) {
  const cv::Rect thing(200, 20, 60, 20);
  const cv::Mat holes = missing(camera_of(DepthModel::time_of_flight), scene(thing, 1.0, 2.0));
  cv::Mat expected(holes.size(), CV_8UC1, cv::Scalar(0));
  expected({thing.x - 1, thing.y, 2, thing.height}).setTo(255);
  expected({thing.x + thing.width - 1, thing.y, 2, thing.height}).setTo(255);
  expected({thing.x, thing.y - 1, thing.width, 2}).setTo(255);
  expected({thing.x, thing.y + thing.height - 1, thing.width, 2}).setTo(255);
  EXPECT_EQ(cv::norm(holes, expected, cv::NORM_INF), 0.0);
}

TEST(DepthHoles, AreNotOnASlopeNorWithoutNoiseNorAtFactorZero) {
  cv::Mat slope(60, 400, CV_32FC1);
  for (int y = 0; y < slope.rows; ++y) {
    for (int x = 0; x < slope.cols; ++x) slope.at<float>(y, x) = 2.0F + 0.012F * static_cast<float>(x + y);
  }
  const cv::Mat edge = scene({200, 20, 60, 20}, 1.0, 2.0);
  for (const DepthModel model :
       {DepthModel::stereo, DepthModel::structured_light, DepthModel::time_of_flight}) {
    CameraSpec camera = camera_of(model);
    EXPECT_EQ(cv::countNonZero(missing(camera, slope)), 0);
    camera.depth.holes = 0.0;
    EXPECT_EQ(cv::countNonZero(missing(camera, edge)), 0);
    camera.depth.holes = 1.0;
    camera.depth.noise = false;
    EXPECT_EQ(cv::countNonZero(missing(camera, edge)), 0);
  }
}

}  // namespace
}  // namespace skylight::sim
