#include "tracker/metrics.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace skylight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Time kStart{std::chrono::seconds(1'700'000'000)};

/// A frame past the first second (once one at kStart came into view), off by `error` along x.
ScoredFrame frame(double seconds, std::optional<double> error) {
  ScoredFrame out;
  out.captured = kStart + from_seconds(seconds);
  out.truth = {1.0, 2.0, 0.0};
  if (error) out.estimate = Pose2{1.0 + *error, 2.0, 0.0};
  out.state = TrackState::predicting;
  return out;
}

RobotMetrics in_view() {
  RobotMetrics out;
  out.add(frame(0.0, std::nullopt));
  return out;
}

TEST(Metrics, SummarisesFiveErrorsAsByHand) {
  RobotMetrics metrics = in_view();
  for (const double error : {0.05, 0.01, 0.03, 0.02, 0.04}) metrics.add(frame(1.0 + error, error));
  const RobotScore score = metrics.score();
  const ErrorSummary& e = score.position_error_m;
  EXPECT_EQ(score.frames, 5U);
  EXPECT_EQ(e.count, 5U);
  EXPECT_NEAR(e.mean, 0.03, 1e-12);
  EXPECT_NEAR(e.std, std::sqrt(0.0010 / 5), 1e-12);  // 4 + 1 + 0 + 1 + 4 squared hundredths
  EXPECT_NEAR(e.min, 0.01, 1e-12);
  EXPECT_NEAR(e.p50, 0.03, 1e-12);
  EXPECT_NEAR(e.p95, 0.048, 1e-12);   // rank 4 * 0.95 = 3.8
  EXPECT_NEAR(e.p99, 0.0496, 1e-12);  // rank 3.96
  EXPECT_NEAR(e.max, 0.05, 1e-12);
}

TEST(Metrics, PercentilesInterpolateBetweenOrderStatistics) {
  EXPECT_EQ(percentile({}, 0.5), 0.0);
  EXPECT_EQ(percentile({7.0}, 0.99), 7.0);
  const std::vector<double> four{1.0, 2.0, 4.0, 8.0};
  EXPECT_DOUBLE_EQ(percentile(four, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(percentile(four, 0.5), 3.0);
  EXPECT_DOUBLE_EQ(percentile(four, 0.75), 5.0);
  EXPECT_DOUBLE_EQ(percentile(four, 1.0), 8.0);
}

TEST(Metrics, CountsFromOneSecondAfterTheRobotCameIntoView) {
  RobotMetrics metrics;
  for (int k = 0; k < 50; ++k) {  // 10 Hz: out of view for 1 s, in view from 1.0 s, hidden from 4 s
    ScoredFrame f = frame(0.1 * k, std::nullopt);
    f.in_view = k >= 10 && k < 40;
    metrics.add(f);
  }
  EXPECT_EQ(metrics.score().frames, 30U) << "2.0 s to 4.9 s, the time hidden included";
  RobotMetrics never;
  for (int k = 0; k < 50; ++k) {
    ScoredFrame f = frame(0.1 * k, 0.0);
    f.in_view = false;
    never.add(f);
  }
  EXPECT_EQ(never.score().frames, 0U);
  EXPECT_EQ(never.score().availability, 0.0);
}

TEST(Metrics, SharesAreOfAllCountedFrames) {
  RobotMetrics metrics = in_view();
  const auto add = [&](std::optional<double> error, bool measured) {
    ScoredFrame f = frame(2.0, error);
    f.measured = measured;
    metrics.add(f);
  };
  for (int i = 0; i < 5; ++i) add(0.01, true);
  add(0.2, true);            // a pose, but no use
  add(0.05, false);          // coasting well
  add(5.0, false);           // coasting for ever
  add(std::nullopt, false);  // lost
  add(std::nullopt, true);   // seen, calibrating
  const RobotScore score = metrics.score();
  EXPECT_EQ(score.frames, 10U);
  EXPECT_DOUBLE_EQ(score.availability, 0.8);
  EXPECT_DOUBLE_EQ(score.measured, 0.7);
  EXPECT_DOUBLE_EQ(score.usable, 0.6);
  EXPECT_EQ(score.position_error_m.count, 8U);
}

TEST(Metrics, ConfidentWrongCountsTrackedPosesOffByMoreThanATenthOfAMetreAtAnyTime) {
  RobotMetrics metrics;
  const auto add = [&](double seconds, double error, TrackState state, bool visible = true) {
    ScoredFrame f = frame(seconds, error);
    f.truth = {0.0, 0.0, 0.0};
    f.estimate = Pose2{error, 0.0, 0.0};
    f.state = state;
    f.in_view = visible;
    metrics.add(f);
  };
  add(0.0, 3.0, TrackState::tracking, false);  // a robot that is not even there
  add(0.1, 0.5, TrackState::tracking);         // in the first second
  EXPECT_EQ(metrics.score().confident_wrong, 2U);
  add(2.0, 0.5, TrackState::predicting);  // it did not claim to see it
  add(2.1, 0.1, TrackState::tracking);    // exactly at the bound: neither usable nor wrong
  add(2.2, 0.099, TrackState::tracking);
  EXPECT_EQ(metrics.score().confident_wrong, 2U);
  EXPECT_DOUBLE_EQ(metrics.score().usable, 1.0 / 3.0);
  add(2.3, std::nextafter(0.1, 1.0), TrackState::tracking);
  add(2.4, kNan, TrackState::tracking);
  EXPECT_EQ(metrics.score().confident_wrong, 4U);
  EXPECT_DOUBLE_EQ(metrics.score().availability, 4.0 / 5.0) << "a pose that is not finite is none";
  EXPECT_TRUE(std::isfinite(metrics.score().position_error_m.mean));
}

// Seen from 0 s and tracked from 0.4 s on; hidden from 2 s to 3 s with a pose that drifts off, found 0.2 s
// after; carried across the room at 5 s and never found again.
RobotMetrics with_losses() {
  RobotMetrics metrics;
  for (int i = 0; i < 70; ++i) {
    const double seconds = 0.1 * i;
    const bool hidden = seconds > 1.95 && seconds < 2.95;
    const bool found = (i >= 4 && i < 20) || (i >= 32 && i < 50);
    ScoredFrame f = frame(seconds, 0.0);
    f.truth = {i < 50 ? 0.0 : 2.0, 0.0, 0.0};
    f.visible = hidden ? 0.49 : 0.5;
    f.state = found ? TrackState::tracking : TrackState::predicting;
    f.estimate = Pose2{hidden ? 0.0201 * (i - 19) : 0.0, 0.0, 0.0};
    if (hidden && i < 24) f.state = TrackState::occluded;
    if (i != 20) f.covariance = Covariance3(Eigen::Vector3d(0.0001, 1.0, 1.0).asDiagonal());
    metrics.add(f);
  }
  return metrics;
}

TEST(Metrics, TellHowLongARobotThatIsInViewAgainIsLookedFor) {
  const RobotScore score = with_losses().score();
  EXPECT_EQ(score.finds, 2U);
  EXPECT_NEAR(score.find_mean_s, (0.4 + 0.2) / 2, 1e-9);
  EXPECT_NEAR(score.find_worst_s, 0.4, 1e-9);
  EXPECT_EQ(score.never_found, 1U);
  RobotMetrics away = with_losses();
  away.away();
  ScoredFrame back = frame(9.0, 0.0);
  back.state = TrackState::tracking;
  away.add(back);
  EXPECT_EQ(away.score().finds, 3U) << "put down where it was is in view again too";
  EXPECT_NEAR(away.score().find_mean_s, 0.6 / 3, 1e-9);
  EXPECT_EQ(away.score().never_found, 1U);
}

TEST(Metrics, TellWhatWasSaidOfARobotWhileItWasHidden) {
  const RobotScore score = with_losses().score();
  EXPECT_EQ(score.hidden, 10U);
  EXPECT_EQ(score.hidden_wrong, 6U) << "from the fifth frame on";
  EXPECT_EQ(score.hidden_told, 4U);
  EXPECT_EQ(score.hidden_nees_frames, 9U) << "one had no covariance";
  EXPECT_NEAR(score.hidden_nees_mean, (385 - 1) * 2.01 * 2.01 / 9, 1e-6) << "squares of 2 to 10";
  RobotMetrics twice = with_losses();
  twice.merge(with_losses());
  EXPECT_EQ(twice.score().hidden_wrong, 12U);
  EXPECT_EQ(twice.score().hidden_nees_frames, 18U);
  EXPECT_NEAR(twice.score().hidden_nees_mean, score.hidden_nees_mean, 1e-9);
  EXPECT_EQ(twice.score().finds, 4U);
  EXPECT_EQ(twice.score().never_found, 2U);
}

TEST(Metrics, YawErrorsGoTheShortWayRound) {
  RobotMetrics metrics = in_view();
  ScoredFrame f = frame(2.0, 0.0);
  f.truth.yaw = kPi - 0.01;
  f.estimate->yaw = -kPi + 0.02;
  metrics.add(f);
  EXPECT_NEAR(metrics.score().yaw_error_rad.mean, 0.03, 1e-12);
  EXPECT_NEAR(metrics.score().yaw_error_rad.max, 0.03, 1e-12);
}

TEST(Metrics, NeesOfOneErrorAsByHand) {
  RobotMetrics metrics = in_view();
  ScoredFrame f = frame(2.0, std::nullopt);
  f.estimate = Pose2{1.02, 1.97, 0.1};  // off by 0.02, -0.03, 0.1
  f.covariance = Eigen::Vector3d(0.01 * 0.01, 0.03 * 0.03, 0.05 * 0.05).asDiagonal();
  metrics.add(f);
  EXPECT_NEAR(metrics.score().nees_mean, 4.0 + 1.0 + 4.0, 1e-9);
  EXPECT_EQ(metrics.score().ellipse_95, 1.0) << "4 + 1 lies below 5.99";
  f.estimate->x = 1.03;
  metrics.add(f);
  EXPECT_EQ(metrics.score().ellipse_95, 0.5) << "9 + 1 lies outside";
}

TEST(Metrics, ErrorsDrawnFromTheStatedCovarianceGiveANeesOf3And95PercentInTheEllipse) {
  RobotMetrics metrics = in_view();
  Covariance3 covariance;
  covariance << 4e-6, 1e-6, -3e-6, 1e-6, 9e-6, 6e-6, -3e-6, 6e-6, 1e-4;
  const Eigen::Matrix3d root = covariance.llt().matrixL();
  std::mt19937 random(2024);
  std::normal_distribution<double> normal;
  constexpr int kFrames = 20'000;
  for (int k = 0; k < kFrames; ++k) {
    const Eigen::Vector3d error = root * Eigen::Vector3d(normal(random), normal(random), normal(random));
    ScoredFrame f = frame(2.0 + k, std::nullopt);
    f.truth = {0.0, 0.0, kPi};
    f.estimate = Pose2{error.x(), error.y(), wrap_angle(kPi + error.z())};
    f.covariance = covariance;
    metrics.add(f);
  }
  const RobotScore score = metrics.score();
  EXPECT_NEAR(score.nees_mean, 3.0, 4.0 * std::sqrt(6.0 / kFrames));  // chi-squared with 3: variance 6
  EXPECT_NEAR(score.ellipse_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / kFrames));
  EXPECT_EQ(score.bad_covariances, 0U);
}

TEST(Metrics, CovariancesThatAreNoneAreCountedAndLeftOut) {
  RobotMetrics metrics = in_view();
  const auto add = [&](const Covariance3& covariance) {
    ScoredFrame f = frame(2.0, 0.01);
    f.covariance = covariance;
    metrics.add(f);
  };
  add(Covariance3::Zero());
  add(Covariance3::Constant(1e-4));  // singular
  add(Covariance3::Identity() * kNan);
  add(Covariance3::Identity() * std::numeric_limits<double>::infinity());
  add(-Covariance3::Identity());
  Covariance3 skew = Covariance3::Identity();
  skew(0, 1) = 0.5;
  add(skew);
  EXPECT_EQ(metrics.score().bad_covariances, 6U);
  EXPECT_EQ(metrics.score().nees_frames, 0U);
  EXPECT_EQ(metrics.score().nees_mean, 0.0);
  add(Eigen::Vector3d(1e-4, 1e-4, 1e3).asDiagonal());  // heading all but unknown: honest, not singular
  EXPECT_EQ(metrics.score().nees_frames, 1U);
  EXPECT_NEAR(metrics.score().nees_mean, 1.0, 1e-9);
  EXPECT_EQ(metrics.score().position_error_m.count, 7U) << "the errors count all the same";
}

TEST(Metrics, MergingPoolsFramesAsIfTheyWereOfOneRun) {
  RobotMetrics all = in_view();
  RobotMetrics a = in_view();
  RobotMetrics b = in_view();
  for (int k = 0; k < 20; ++k) {
    ScoredFrame f = frame(2.0 + k, 0.01 * k);
    f.covariance = Covariance3::Identity() * 1e-3;
    f.state = TrackState::tracking;
    all.add(f);
    (k % 3 == 0 ? a : b).add(f);
  }
  a.merge(b);
  const RobotScore pooled = a.score();
  const RobotScore expected = all.score();
  EXPECT_EQ(pooled.frames, expected.frames);
  EXPECT_NEAR(pooled.position_error_m.mean, expected.position_error_m.mean, 1e-12);
  EXPECT_EQ(pooled.position_error_m.p95, expected.position_error_m.p95);
  EXPECT_EQ(pooled.usable, expected.usable);
  EXPECT_EQ(pooled.confident_wrong, expected.confident_wrong);
  EXPECT_NEAR(pooled.nees_mean, expected.nees_mean, 1e-9);
  EXPECT_EQ(pooled.ellipse_95, expected.ellipse_95);
  a.merge(a);
  EXPECT_EQ(a.score().frames, 2 * expected.frames);
  EXPECT_NEAR(a.score().position_error_m.mean, expected.position_error_m.mean, 1e-12);
}

}  // namespace
}  // namespace skylight
