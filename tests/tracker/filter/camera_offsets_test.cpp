// The parts of several cameras in one pose, by themselves: against cases worked out by hand.
#include "tracker/filter/camera_offsets.hpp"

#include <numbers>

#include <gtest/gtest.h>

namespace skylight::motion {
namespace {

Time at(double s) {
  return Time{} + from_seconds(1000.0 + s);
}

/// 2 mm and 2 mrad.
Covariance3 calibration() {
  return 4e-6 * Covariance3::Identity();
}

Observation seen_by(std::size_t camera, double t) {
  return {.captured = at(t), .correlated = calibration(), .camera = camera};
}

/// A track that stands in the origin and knows it, under cameras that see it elsewhere by what they are
/// wrong.
class CamerasOfOne : public testing::Test {
 protected:
  CamerasOfOne() { offsets_.begin(seen_by(0, 0.0)); }

  CameraPart& see(std::size_t camera, double t, double wrong_m, double noise_m = 1e-6) {
    CameraPart& part = offsets_.meet(seen_by(camera, t), Eigen::Vector2d(0.0, 0.0));
    offsets_.accepted(part, measured({wrong_m, 0.0, 0.0}, noise_m), track_, at(t));
    return part;
  }
  static LinearMeasurement measured(const Eigen::Vector3d& value, double noise_m) {
    return {.value = value,
            .noise = noise_m * noise_m * Eigen::Matrix3d::Identity(),
            .yaw_period = 2.0 * std::numbers::pi};
  }
  /// All of these, 50 times a second.
  void watch(double from, double to, const std::vector<std::pair<std::size_t, double>>& cameras) {
    for (double t = from; t < to - 1e-9; t += 0.02) {
      offsets_.carry(at(t), at(t + 0.02));
      for (const auto& [camera, wrong_m] : cameras) see(camera, t + 0.02, wrong_m);
    }
  }
  const CameraPart& part(std::size_t camera) const {
    for (const CameraPart& each : offsets_.parts()) {
      if (each.camera == camera) return each;
    }
    throw std::logic_error("no such part");
  }

  CameraOffsets offsets_;
  Gaussian6 track_{.cov = 1e-12 * Matrix6::Identity()};
};

TEST_F(CamerasOfOne, TwoAlikeMakeUpHalfOfThePoseEachAndAThirdBeginsWhereThatIs) {
  watch(0.0, 6.0, {{0, 0.0}, {1, 0.003}});
  EXPECT_NEAR(offsets_.shift().x(), 0.0015, 1e-6);
  // Half of each error: a quarter and a quarter of the variance.
  EXPECT_LT((offsets_.correlated() - 0.5 * calibration()).norm(), 0.01 * calibration().norm());
  EXPECT_EQ(offsets_.contributing(), 0b11U);
  const CameraPart& third = offsets_.meet(seen_by(2, 6.0), {0.0, 0.0});
  EXPECT_NEAR(third.offset.x(), 0.0015, 1e-6);
  EXPECT_LT((third.spread - 1.5 * calibration()).norm(), 0.01 * calibration().norm());
  EXPECT_NEAR(offsets_.shift().x(), 0.0015, 1e-6) << "it counts for nothing yet";
}

TEST_F(CamerasOfOne, WhatIsNotKnownOfAnOffsetIsInTheCovariance) {
  const CameraPart& young = see(1, 0.0, 0.001, 2e-3);  // one look that errs by 2 mm
  // Before it 2 mm by each calibration, 8e-6 together; 1 / (1 / 8e-6 + 1 / 4e-6) after it.
  EXPECT_NEAR(young.spread(0, 0), 8e-6 / 3.0, 1e-10);
  offsets_.carry(at(0.0), at(0.2));
  const double weight = part(1).weight(0, 0);
  // Glided by 1 - exp(-0.2 / 0.3) towards its share of the inverse variances 1 / 4e-6 and 1 / (4e-6 + 8e-6 /
  // 3).
  EXPECT_NEAR(weight, (1.0 - std::exp(-2.0 / 3.0)) * 0.375, 1e-3);
  EXPECT_NEAR(offsets_.correlated()(0, 0),
              4e-6 * (1.0 - weight) * (1.0 - weight) + (4e-6 + 8e-6 / 3.0) * weight * weight, 1e-9);
}

TEST_F(CamerasOfOne, WhenTheReferenceIsGoneAnotherTiesThePoseDown) {
  const double spread = see(1, 0.0, 0.001, 2e-3).spread(0, 0);
  ASSERT_TRUE(offsets_.is_reference(0));
  offsets_.carry(at(0.0), at(0.2));
  const double second = see(1, 0.2, 0.001, 2e-3).spread(0, 0);
  EXPECT_LT(second, spread);
  EXPECT_TRUE(offsets_.is_reference(0)) << "it was seen just now";
  offsets_.carry(at(0.2), at(0.3));
  EXPECT_TRUE(offsets_.is_reference(1));
  EXPECT_EQ(part(1).spread(0, 0), 0.0);
  EXPECT_DOUBLE_EQ(part(0).spread(0, 0), second) << "what was unknown between them stays so";
}

TEST_F(CamerasOfOne, OneThatIsRefusedThreeTimesInARowCountsForNothing) {
  see(0, 0.0, 0.0);
  CameraPart& other = see(1, 0.0, 0.001);
  for (int times = 1; times <= 3; ++times) {
    CameraOffsets::refused(other, measured({0.04, 0.0, 0.0}, 1e-4), track_);
    CameraOffsets after = offsets_;
    after.carry(at(0.0), at(0.2));
    EXPECT_EQ(after.parts()[1].weight(0, 0) > 0.1, times < 3) << times;
  }
  EXPECT_DOUBLE_EQ(other.said.x(), 0.04);
  see(1, 0.1, 0.001);
  EXPECT_EQ(part(1).refused, 0);
}

TEST_F(CamerasOfOne, OneThatIsGoneGlidesOutAndIsForgottenAfterThreeSeconds) {
  watch(0.0, 3.0, {{0, 0.0}, {1, 0.003}});
  const double before = offsets_.shift().x();
  double largest = 0.0;
  for (double t = 3.0; t < 5.9; t += 0.02) {
    const double was = offsets_.shift().x();
    watch(t, t + 0.02, {{0, 0.0}});
    largest = std::max(largest, std::abs(offsets_.shift().x() - was));
  }
  EXPECT_EQ(offsets_.parts().size(), 2U);
  EXPECT_LT(largest, 0.1 * before) << "1.5 mm within 0.3 s, at 50 Hz";
  EXPECT_NEAR(offsets_.shift().x(), 0.0, 1e-6);
  watch(5.9, 6.1, {{0, 0.0}});
  ASSERT_EQ(offsets_.parts().size(), 1U);
  EXPECT_EQ(offsets_.parts()[0].camera, 0U);
  EXPECT_LT((offsets_.parts()[0].weight - Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

TEST_F(CamerasOfOne, SomeMetresOnTheirErrorsAreOtherOnes) {
  watch(0.0, 3.0, {{0, 0.0}, {1, 0.003}});
  const double known = part(1).spread(0, 0);
  offsets_.meet(seen_by(0, 3.0), {0.5, 0.0});  // a quarter of the way over which nothing stays the same
  EXPECT_NEAR(part(1).spread(0, 0), known + 0.25 * 8e-6, 1e-12);
  offsets_.meet(seen_by(0, 3.0), {5.0, 0.0});
  EXPECT_NEAR(part(1).spread(0, 0), known + 1.25 * 8e-6, 1e-12);
  EXPECT_EQ(part(0).spread(0, 0), 0.0);
}

TEST_F(CamerasOfOne, YawsAreComparedTheShorterWayRound) {
  track_.mean[kYaw] = std::numbers::pi - 0.001;
  CameraPart& part = offsets_.meet(seen_by(1, 0.0), {0.0, 0.0});
  const double prior = part.spread(2, 2);
  offsets_.accepted(part, measured({0.0, 0.0, -std::numbers::pi + 0.001}, 1e-3), track_, at(0.0));
  EXPECT_NEAR(part.offset.z(), 0.002 * prior / (prior + 1e-6), 1e-8);
}

}  // namespace
}  // namespace skylight::motion
