// The paper's filter taken step by step: figure 5, figure 4, and what an estimate carries beside them.
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracker/window_feed.hpp"

namespace skylight {
namespace {

using testing::HasSubstr;
using Feed = test::WindowFeed;
constexpr double kPi = std::numbers::pi;

// ---- Figure 5, by hand -------------------------------------------------------------------------------

TEST(WindowFilter, TakesTheStepsOfFigure5WithAWindowOf12) {
  Feed feed({.window_size = 12, .alpha = 100.0, .calibration_threshold = 0});
  FilterStep step;
  for (int i = 1; i <= 11; ++i) {
    step = feed.at(i, 2.0);
    EXPECT_EQ(step.state, TrackState::calibrating) << "detection " << i;
    EXPECT_FALSE(step.estimate);
  }
  // Step 1: the predicted position is the last coordinate of the buffer.
  step = feed.at(12, 2.0);
  ASSERT_TRUE(step.estimate);
  EXPECT_EQ(step.state, TrackState::tracking);
  EXPECT_DOUBLE_EQ(step.estimate->pose.x, 12.0);
  // Steps 2 to 4. The buffer less its oldest is 2 .. 12 (ten differences of 1), then 13 - 12: 11 / 12.
  // At the n-th repetition the oldest that remains is n + 1, up to 12, and newest - oldest is always 11.
  for (int n = 1; n <= 11; ++n) {
    step = feed.at(12 + n, 2.0);
    EXPECT_NEAR(step.estimate->pose.x, 12.0 + n * 11.0 / 12.0, 1e-12) << "repetition " << n;
    EXPECT_DOUBLE_EQ(step.estimate->pose.y, 2.0);
  }
  // Step 5: from the twelfth repetition on all is smoothed: the oldest is the first predicted, 12 + 11/12.
  step = feed.at(24, 2.0);
  const double twelfth = 12.0 + 11.0 * 11.0 / 12.0 + (24.0 - (12.0 + 11.0 / 12.0)) / 12.0;
  EXPECT_NEAR(step.estimate->pose.x, twelfth, 1e-12);
  EXPECT_NEAR(step.estimate->pose.x, 23.006944444444443, 1e-12);
  // And the oldest is now 12 + 22/12.
  step = feed.at(25, 2.0);
  EXPECT_NEAR(step.estimate->pose.x, twelfth + (25.0 - (12.0 + 22.0 / 12.0)) / 12.0, 1e-12);
}

TEST(WindowFilter, TakesTheStepsOfFigure5WithAWindowOf3) {
  Feed feed({.window_size = 3, .alpha = 100.0, .calibration_threshold = 0});
  feed.at(0.0, 0.0);
  feed.at(1.0, 3.0);
  EXPECT_EQ(feed.at(2.0, 3.0).estimate->pose.position(), Eigen::Vector2d(2.0, 3.0));
  // Buffer (1,3) (2,3), new (3,6): ((1,0) + (1,3)) / 3 = (2/3, 1).
  FilterStep step = feed.at(3.0, 6.0);
  EXPECT_NEAR(step.estimate->pose.x, 2.0 + 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(step.estimate->pose.y, 4.0, 1e-12);
  // Buffer (2,3) (8/3,4), new (4,6): ((2/3,1) + (4/3,2)) / 3 = (2/3, 1).
  step = feed.at(4.0, 6.0);
  EXPECT_NEAR(step.estimate->pose.x, 10.0 / 3.0, 1e-12);
  EXPECT_NEAR(step.estimate->pose.y, 5.0, 1e-12);
  // Buffer (8/3,4) (10/3,5), new (5,6): (7/3, 2) / 3 = (7/9, 2/3).
  step = feed.at(5.0, 6.0);
  EXPECT_NEAR(step.estimate->pose.x, 37.0 / 9.0, 1e-12);
  EXPECT_NEAR(step.estimate->pose.y, 17.0 / 3.0, 1e-12);
}

TEST(WindowFilter, CarriesOnAtTheAverageOffsetWhenADetectionIsMissing) {
  Feed feed({.window_size = 3, .alpha = 100.0, .calibration_threshold = 0});
  feed.at(0.0);
  feed.at(1.0);
  feed.at(2.0);
  // Straight after calibration the offset is Eq. 1's: (1 + 1) / 3.
  FilterStep step = feed.nothing();
  EXPECT_EQ(step.state, TrackState::predicting);
  EXPECT_FALSE(step.accepted);
  EXPECT_NEAR(step.estimate->pose.x, 8.0 / 3.0, 1e-12);
  // The buffer slid: 2, 8/3; new 4: (4 - 2) / 3 = 2/3 would be with 2 as the oldest left.
  step = feed.at(4.0);
  EXPECT_EQ(step.state, TrackState::tracking);
  EXPECT_NEAR(step.estimate->pose.x, 10.0 / 3.0, 1e-12);
  // Now 8/3, 10/3; new 6: (6 - 8/3) / 3 = 10/9; it is this offset that carries through the next gap.
  step = feed.at(6.0);
  EXPECT_NEAR(step.estimate->pose.x, 40.0 / 9.0, 1e-12);
  EXPECT_NEAR(feed.nothing().estimate->pose.x, 50.0 / 9.0, 1e-12);
  EXPECT_NEAR(feed.nothing().estimate->pose.x, 60.0 / 9.0, 1e-12);
}

// ---- Figure 4: the ways in and out of calibration ------------------------------------------------------

const WindowFilterConfig kSmall{
    .window_size = 4, .alpha = 0.3, .calibration_threshold = 2, .frame_loss_threshold = 3};

TEST(WindowFilter, CountsThenCalibratesThenTracks) {
  Feed feed(kSmall);
  EXPECT_EQ(feed.nothing().state, TrackState::searching);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(feed.at(0.0).state, TrackState::searching) << "counted, not kept";
  for (int i = 0; i < 3; ++i) EXPECT_EQ(feed.at(0.0).state, TrackState::calibrating);
  const FilterStep step = feed.at(0.0);
  EXPECT_EQ(step.state, TrackState::tracking);
  EXPECT_TRUE(step.estimate);
}

TEST(WindowFilter, MissesWhileCountingBeginTheCountAgain) {
  Feed feed(kSmall);
  for (int i = 0; i < 40; ++i)
    EXPECT_EQ(feed.nothing().state, TrackState::searching) << "nothing to lose yet";
  feed.at(0.0);
  feed.at(0.0);
  feed.nothing();
  feed.nothing();
  EXPECT_EQ(feed.at(0.0).state, TrackState::calibrating) << "two misses of three: the count stands";
  feed.filter().reset();
  feed.at(0.0);
  feed.at(0.0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(feed.nothing().state, TrackState::searching);
  EXPECT_EQ(feed.at(0.0).state, TrackState::searching) << "first of a new count";
  EXPECT_EQ(feed.at(0.0).state, TrackState::searching);
  EXPECT_EQ(feed.at(0.0).state, TrackState::calibrating);
}

TEST(WindowFilter, MissesWhileCalibratingBeginItAgainAndADetectionSetsThemBack) {
  Feed feed(kSmall);
  for (int i = 0; i < 3; ++i) feed.at(0.0);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(feed.nothing().state, TrackState::calibrating);
  EXPECT_EQ(feed.at(0.0).state, TrackState::calibrating);
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(feed.nothing().state, TrackState::calibrating) << "the counter was set back";
  EXPECT_EQ(feed.nothing().state, TrackState::searching) << "third miss in a row";
  FilterStep step;
  for (int i = 0; i < 5; ++i) step = feed.at(0.0);
  EXPECT_EQ(step.state, TrackState::calibrating)
      << "two counted and three kept: nothing is left of the first";
  EXPECT_EQ(feed.at(0.0).state, TrackState::tracking);
}

TEST(WindowFilter, NoGateWhileCalibrating) {
  Feed feed(kSmall);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(feed.at(i * 5.0).accepted);
  EXPECT_EQ(feed.at(25.0).estimate->pose.x, 25.0);
}

TEST(WindowFilter, GapsCancelCalibrationWhenTheLossCounterReachesZero) {
  Feed feed(kSmall);
  feed.settle();
  EXPECT_EQ(feed.nothing().state, TrackState::predicting);
  EXPECT_EQ(feed.nothing().state, TrackState::predicting);
  const FilterStep step = feed.nothing();
  EXPECT_EQ(step.state, TrackState::lost);
  EXPECT_FALSE(step.estimate);
  EXPECT_FALSE(feed.filter().predict(feed.now()));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(feed.nothing().state, TrackState::lost);
}

TEST(WindowFilter, DetectionsBeyondTheGateCancelCalibrationToo) {
  Feed feed(kSmall);
  feed.settle();
  FilterStep step = feed.at(5.0);
  EXPECT_EQ(step.state, TrackState::predicting);
  EXPECT_FALSE(step.accepted);
  EXPECT_NEAR(step.estimate->pose.x, 0.0, 1e-12) << "the prediction stands, as the paper says";
  feed.at(5.0);
  EXPECT_EQ(feed.at(5.0).state, TrackState::lost);
  // Re-acquired where it now is: two counted, four kept.
  EXPECT_EQ(feed.at(5.0).state, TrackState::lost);
  EXPECT_EQ(feed.at(5.0).state, TrackState::lost);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(feed.at(5.0).state, TrackState::calibrating);
  step = feed.at(5.0);
  EXPECT_EQ(step.state, TrackState::tracking);
  EXPECT_EQ(step.estimate->pose.x, 5.0);
}

TEST(WindowFilter, AnAcceptedPositionSetsTheLossCounterBack) {
  Feed feed(kSmall);
  feed.settle();
  for (int round = 0; round < 10; ++round) {
    EXPECT_EQ(feed.nothing().state, TrackState::predicting);
    EXPECT_EQ(feed.at(9.0).state, TrackState::predicting);
    EXPECT_EQ(feed.at(0.0).state, TrackState::tracking) << "round " << round;
  }
}

TEST(WindowFilter, ARecalibrationThatFailsIsLostAgainNotSearching) {
  Feed feed(kSmall);
  feed.settle();
  for (int i = 0; i < 3; ++i) feed.nothing();
  for (int i = 0; i < 3; ++i) feed.at(1.0);
  for (int i = 0; i < 3; ++i) feed.nothing();
  EXPECT_EQ(feed.nothing().state, TrackState::lost);
  feed.filter().reset();
  EXPECT_EQ(feed.nothing().state, TrackState::searching);
}

TEST(WindowFilter, ExactlyAlphaIsAcceptedAndMoreIsNot) {
  Feed feed({.window_size = 4, .alpha = 0.25, .calibration_threshold = 0});
  feed.settle();
  EXPECT_FALSE(feed.at(std::nextafter(0.25, 1.0)).accepted);
  EXPECT_TRUE(feed.at(0.25).accepted);
  feed.filter().reset();
  feed.settle();
  EXPECT_FALSE(feed.at(0.2, 0.2).accepted) << "the distance counts, not each axis";
}

// ---- What the estimate carries beside the paper's position ---------------------------------------------

TEST(WindowFilter, YawIsTheLastObservedAndTurnsOnThroughGapsAcrossPi) {
  Feed feed(kSmall);
  FilterStep step;
  double yaw = kPi - 0.30;
  for (int k = 0; k < 8; ++k) step = feed.at(0.0, 0.0, wrap_angle(yaw += 0.05));
  EXPECT_EQ(step.estimate->pose.yaw, wrap_angle(yaw));
  EXPECT_LT(step.estimate->pose.yaw, 0.0) << "it has passed pi";
  EXPECT_NEAR(step.estimate->velocity.yaw_rate, 0.05 * 30, 1e-6);
  EXPECT_NEAR(feed.nothing().estimate->pose.yaw, wrap_angle(yaw + 0.05), 1e-6);
  const double before = step.estimate->covariance(2, 2);
  EXPECT_GT(feed.nothing().estimate->covariance(2, 2), before);
}

TEST(WindowFilter, TheYawRateIsNotMisledByAPictureThatLooksTheSameTurned) {
  Feed feed(kSmall);
  FilterStep step;
  for (int k = 0; k < 12; ++k) {
    Observation observation;
    observation.covariance *= 1e-4;
    observation.pose.yaw = wrap_angle(0.02 * k + (k % 3) * kPi / 2);
    observation.heading_turns = 4;
    step = feed.with(observation);
  }
  EXPECT_NEAR(step.estimate->velocity.yaw_rate, 0.02 * 30, 1e-6);
}

TEST(WindowFilter, PredictsAtTheEstimatesVelocityWithGrowingCovariance) {
  Feed feed({.alpha = 1.0});
  FilterStep step;
  for (int k = 0; k < 500; ++k) step = feed.at(0.01 * k, 0.0, 0.001 * k);
  const auto now = feed.filter().predict(feed.now());
  ASSERT_TRUE(now);
  EXPECT_EQ(now->pose, step.estimate->pose);
  const auto later = feed.filter().predict(feed.now() + std::chrono::milliseconds(500));
  ASSERT_TRUE(later);
  EXPECT_NEAR(later->pose.x, now->pose.x + 0.5 * 0.3, 1e-6);
  EXPECT_NEAR(later->pose.yaw, now->pose.yaw + 0.5 * 0.03, 1e-6);
  EXPECT_GT(later->covariance(0, 0), now->covariance(0, 0));
  EXPECT_GT(later->covariance(2, 2), now->covariance(2, 2));
  EXPECT_FALSE(feed.filter().predict(feed.now() - std::chrono::milliseconds(1)));
  // What it said of the next frame is what the filter does in a gap.
  const auto next = feed.filter().predict(feed.now() + feed.interval());
  const FilterStep gap = feed.nothing();
  EXPECT_NEAR(gap.estimate->pose.x, next->pose.x, 1e-9);
  EXPECT_NEAR(gap.estimate->covariance(0, 0), next->covariance(0, 0), 1e-9);
}

TEST(WindowFilter, FramesThatAreNotLaterAreIgnored) {
  WindowFilter filter(kSmall);
  const Time start{std::chrono::seconds(100)};
  Observation observation;
  FilterStep step;
  for (int k = 0; k < 8; ++k) step = filter.update(start + std::chrono::milliseconds(33 * k), observation);
  ASSERT_EQ(step.state, TrackState::tracking);
  for (int k = 0; k < 50; ++k) {
    EXPECT_EQ(filter.update(start, std::nullopt).state, TrackState::tracking) << "no frame, so no loss";
    EXPECT_EQ(filter.update(start + std::chrono::milliseconds(33 * 7), std::nullopt).estimate->pose,
              step.estimate->pose);
  }
}

TEST(WindowFilter, AnObservationThatIsNotFiniteCountsAsNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Feed feed(kSmall);
  feed.settle();
  EXPECT_EQ(feed.at(kNan).state, TrackState::predicting);
  EXPECT_EQ(feed.at(0.0, 0.0, kNan).state, TrackState::predicting);
  feed.at(0.0);
  EXPECT_EQ(feed.at(0.0, 0.0, 0.0, kNan).state, TrackState::predicting);
  const FilterStep step = feed.at(0.0);
  EXPECT_EQ(step.state, TrackState::tracking);
  EXPECT_TRUE(step.estimate->pose.position().allFinite() && step.estimate->covariance.allFinite());
}

TEST(WindowFilter, BadConfigurationIsNamedWithValueAndRange) {
  EXPECT_EQ(check(WindowFilterConfig{}), "");
  EXPECT_THAT(check(WindowFilterConfig{.window_size = 1}),
              HasSubstr("window_size is 1, must lie in [2, 1000]"));
  EXPECT_THAT(check(WindowFilterConfig{.window_size = 1001}), HasSubstr("window_size is 1001"));
  EXPECT_THAT(check(WindowFilterConfig{.alpha = 0.0}), HasSubstr("alpha is 0 m, must lie in (0, 100]"));
  EXPECT_THAT(check(WindowFilterConfig{.alpha = std::nan("")}), HasSubstr("alpha is nan"));
  EXPECT_THAT(check(WindowFilterConfig{.calibration_threshold = -1}),
              HasSubstr("calibration_threshold is -1"));
  EXPECT_THAT(check(WindowFilterConfig{.frame_loss_threshold = 0}), HasSubstr("frame_loss_threshold is 0"));
  EXPECT_THROW(WindowFilter({.window_size = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace skylight
