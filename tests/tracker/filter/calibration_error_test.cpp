// A calibration's error in the filters: published, never averaged away.
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/tracker/filter/wrong_cameras.hpp"
#include "tracker/filter/window.hpp"

namespace skylight {
namespace {

using test::calibration;
using test::detect;
using test::instant;
using test::kTenthOfAMillimetre;
using test::Random;
using test::Route;
using test::RouteKind;

double least_eigenvalue(const Covariance3& m) {
  return Eigen::SelfAdjointEigenSolver<Covariance3>(m, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

/// The same frames with and without what the calibration leaves unknown.
template <class F>
void expect_only_added(F& without, F& with, const Covariance3& added) {
  const Route route(RouteKind::chaotic, 6.0, 4301);
  Random random(4302);
  for (int i = 0; i < 180; ++i) {
    const double t = i / 30.0;
    auto seen = i % 50 > 45 ? std::nullopt : detect(kTenthOfAMillimetre, route.at(t).pose, t, random);
    const FilterStep plain = without.update(instant(t), seen);
    if (seen) seen->correlated = added;
    const FilterStep step = with.update(instant(t), seen);
    ASSERT_EQ(step.state, plain.state);
    ASSERT_EQ(step.accepted, plain.accepted);
    const auto expect_same = [&](const std::optional<Estimate>& a, const std::optional<Estimate>& b) {
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) return;
      EXPECT_EQ(a->pose, b->pose);
      EXPECT_EQ(a->velocity, b->velocity);
      EXPECT_EQ(a->covariance, Covariance3(b->covariance + added));
    };
    expect_same(step.estimate, plain.estimate);
    expect_same(with.predict(instant(t + 0.5)), without.predict(instant(t + 0.5)));
    if constexpr (std::is_same_v<F, MotionFilter>)  // the other has no smoother
      expect_same(with.smoothed(instant(t - 0.51)), without.smoothed(instant(t - 0.51)));
  }
}

TEST(CalibrationError, IsAddedToWhatTheMotionFilterPublishesAndChangesNothingElse) {
  MotionFilter without;
  MotionFilter with;
  expect_only_added(without, with, calibration());
}

TEST(CalibrationError, IsAddedToWhatTheWindowFilterPublishesAndChangesNothingElse) {
  WindowFilter without;
  WindowFilter with;
  expect_only_added(without, with, calibration());
}

TEST(CalibrationError, OfACameraKnownExactlyLeavesEveryBitAsItWas) {
  MotionFilter without;
  MotionFilter with;
  expect_only_added(without, with, Covariance3::Zero());
}

TEST(CalibrationError, IsNotAveragedAwayHoweverManyFrames) {
  MotionFilter motion(test::white());
  WindowFilter window;
  Random random(4303);
  for (int i = 0; i < 900; ++i) {
    auto seen = detect(kTenthOfAMillimetre, {1.0, 0.5, 0.2}, i / 30.0, random);
    seen->correlated = calibration();
    const FilterStep a = motion.update(instant(i / 30.0), seen);
    const FilterStep b = window.update(instant(i / 30.0), seen);
    for (const auto& estimate : {a.estimate, b.estimate}) {
      if (!estimate) continue;
      ASSERT_GE(least_eigenvalue(estimate->covariance - calibration()), 0.0) << i;
    }
  }
  const auto smoothed = motion.smoothed(instant(29.5));
  ASSERT_TRUE(smoothed);
  EXPECT_GE(least_eigenvalue(smoothed->covariance - calibration()), 0.0);
  // ... while the noise is: what is left above it is far below one frame's.
  EXPECT_LT(smoothed->covariance(0, 0) - calibration()(0, 0), 0.3e-8);
}

TEST(CalibrationError, ThatIsNoCovarianceCountsAsNoObservation) {
  MotionFilter motion;
  WindowFilter window({.calibration_threshold = 0});
  Observation seen = test::at_pose(0.0, {0.0, 0.0, 0.0});
  seen.correlated(1, 1) = std::nan("");
  EXPECT_FALSE(motion.update(seen.captured, seen).accepted);
  EXPECT_FALSE(window.update(seen.captured, seen).accepted);
  seen = test::at_pose(0.1, {0.0, 0.0, 0.0});
  seen.correlated(1, 1) = -1.0;
  EXPECT_FALSE(motion.update(seen.captured, seen).accepted);
}

}  // namespace
}  // namespace skylight
