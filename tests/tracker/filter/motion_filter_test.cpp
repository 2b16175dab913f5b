// The motion filter's behaviour: states, gate, gaps, late data, headings, odometry, bad input.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracker/filter/motion_feed.hpp"

namespace skylight {
namespace {

using test::at_pose;
using test::instant;
using test::Random;
using test::Route;
using test::RouteKind;
using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A robot that drives along x at 0.2 m/s, seen exactly where it is.
Pose2 along(double t, double yaw = 0.0) {
  return {0.2 * t, 0.0, yaw};
}
/// Fed with `along` until t (exclusive) at 30 Hz; the time of the next frame.
double drive(MotionFilter& filter, double until) {
  int i = 0;
  for (; i / 30.0 < until; ++i) filter.update(instant(i / 30.0), at_pose(i / 30.0, along(i / 30.0)));
  return i / 30.0;
}

TEST(MotionFilter, CalibratesThenTracksThenPredictsThenIsLostThenBeginsAgain) {
  MotionFilter filter({.calibration_observations = 3, .max_gap_s = 1.0});
  EXPECT_EQ(filter.update(instant(0.0), std::nullopt).state, TrackState::searching);
  EXPECT_FALSE(filter.predict(instant(1.0)));
  for (int i = 1; i <= 2; ++i) {
    const FilterStep step = filter.update(instant(i * 0.1), at_pose(i * 0.1, along(i * 0.1)));
    EXPECT_EQ(step.state, TrackState::calibrating);
    EXPECT_FALSE(step.estimate);
    EXPECT_TRUE(step.accepted);
  }
  FilterStep step = filter.update(instant(0.3), at_pose(0.3, along(0.3)));
  EXPECT_EQ(step.state, TrackState::tracking);
  ASSERT_TRUE(step.estimate);
  for (int i = 4; i <= 13; ++i) {
    step = filter.update(instant(i * 0.1), std::nullopt);
    EXPECT_EQ(step.state, TrackState::predicting) << i;
    EXPECT_TRUE(step.estimate);
    EXPECT_FALSE(step.accepted);
  }
  step = filter.update(instant(1.4), std::nullopt);
  EXPECT_EQ(step.state, TrackState::lost);
  EXPECT_FALSE(step.estimate);
  EXPECT_FALSE(filter.predict(instant(1.5)));
  EXPECT_EQ(filter.update(instant(1.5), at_pose(1.5, along(5.0))).state, TrackState::calibrating);
  filter.reset();
  EXPECT_EQ(filter.update(instant(0.0), std::nullopt).state, TrackState::searching);
}

TEST(MotionFilter, IsLostWhenItNoLongerKnowsTheRoom) {
  MotionFilter filter({.max_gap_s = 100.0, .max_sigma_m = 0.3});
  double t = drive(filter, 3.0);
  FilterStep step;
  while (step.state != TrackState::lost && t < 60.0) {
    step = filter.update(instant(t), std::nullopt);
    if (step.estimate) {
      EXPECT_LE(step.estimate->covariance(0, 0), 0.1);
    }
    t += 0.1;
  }
  EXPECT_EQ(step.state, TrackState::lost);
  EXPECT_LT(t, 30.0);
}

TEST(MotionFilter, RefusesOutliersAndBurstsOfThem) {
  MotionFilter filter;
  double t = drive(filter, 3.0);
  Random random(31);
  for (int burst = 0; burst < 5; ++burst) {
    for (int i = 0; i < 5; ++i, t += 1.0 / 30.0) {
      const FilterStep step = filter.update(
          instant(t), at_pose(t, {random.uniform(-3, 3), 1.0 + random.uniform(0, 2), random.uniform(-3, 3)}));
      EXPECT_FALSE(step.accepted);
      EXPECT_EQ(step.state, TrackState::predicting);
      EXPECT_LT(test::place_error(step.estimate->pose, along(t)), 0.004);
    }
    for (int i = 0; i < 10; ++i, t += 1.0 / 30.0)
      EXPECT_TRUE(filter.update(instant(t), at_pose(t, along(t))).accepted);
  }
}

TEST(MotionFilter, BelievesAKidnappingAfterEnoughObservationsAgree) {
  MotionFilter filter({.reacquire_observations = 8});
  double t = drive(filter, 3.0);
  for (int i = 1; i <= 12; ++i, t += 1.0 / 30.0) {
    const Pose2 there{2.0, 1.5, 2.0};
    const FilterStep step = filter.update(instant(t), at_pose(t, there));
    EXPECT_EQ(step.accepted, i >= 8) << i;
    ASSERT_TRUE(step.estimate);
    EXPECT_EQ(test::place_error(step.estimate->pose, there) < 0.01, i >= 8) << i;
  }
}

TEST(MotionFilter, NeverTellsOfAFasterRobotThanThereCanBe) {
  MotionFilter filter({.max_speed_mps = 0.5, .max_yaw_rate_radps = 1.0});
  Random random(35);
  for (int i = 0; i < 300; ++i) {
    const double t = i / 30.0;  // at 1.2 m/s, turning at 3 rad/s: not this robot
    const FilterStep step = filter.update(
        instant(t),
        at_pose(t, {1.2 * t + 0.05 * random.normal(), 0.05 * random.normal(), 3.0 * t}, 0.05, 0.2));
    if (!step.estimate) continue;
    EXPECT_LE(std::hypot(step.estimate->velocity.x, step.estimate->velocity.y), 0.5 + 1e-9);
    EXPECT_LE(std::abs(step.estimate->velocity.yaw_rate), 1.0 + 1e-9);
  }
}

TEST(MotionFilter, AFirstObservationThatWasWrongIsGivenUp) {
  MotionFilter filter;
  filter.update(instant(0.0), at_pose(0.0, {2.0, 2.0, 1.0}));
  FilterStep step;
  for (int i = 1; i <= 6; ++i) step = filter.update(instant(i / 30.0), at_pose(i / 30.0, along(i / 30.0)));
  ASSERT_TRUE(step.estimate);
  EXPECT_LT(test::place_error(step.estimate->pose, along(0.2)), 0.005);
}

TEST(MotionFilter, FollowsARobotThatIsPushedOrCarriedSideways) {
  MotionFilter filter;
  double t = drive(filter, 3.0);
  const Pose2 from = along(t);
  for (int i = 0; i < 60; ++i, t += 1.0 / 30.0) {
    // Braked, and to the left with 2 m/s^2 up to 0.5 m/s, without turning.
    const double since = i / 30.0;
    const double y = since < 0.25 ? since * since : 0.0625 + 0.5 * (since - 0.25);
    const Pose2 truth{from.x, y, 0.0};
    const FilterStep step = filter.update(instant(t), at_pose(t, truth));
    EXPECT_TRUE(step.accepted) << i;
    EXPECT_LT(test::place_error(step.estimate->pose, truth), 0.006) << i;
    if (i < 20) continue;
    EXPECT_NEAR(step.estimate->velocity.y, 0.5, 0.05);
  }
}

TEST(MotionFilter, AHolonomicRobotGoesSidewaysAsWellAsForward) {
  MotionFilter holonomic({.holonomic = true});
  MotionFilter driven;
  FilterStep a;
  FilterStep b;
  Random random(34);
  for (int i = 0; i < 200; ++i) {
    const double t = i / 30.0;
    Observation seen = at_pose(t, {0.0, 0.3 * t, 0.0}, 0.02, 0.05);
    seen.pose.x += 0.02 * random.normal();
    seen.pose.y += 0.02 * random.normal();
    a = holonomic.update(instant(t), seen);
    b = driven.update(instant(t), seen);
  }
  const Pose2 later{0.0, 0.3 * (199 / 30.0 + 1.0), 0.0};
  const double with = test::place_error(holonomic.predict(instant(199 / 30.0 + 1.0))->pose, later);
  const double without = test::place_error(driven.predict(instant(199 / 30.0 + 1.0))->pose, later);
  EXPECT_LT(with, 0.05);
  EXPECT_LT(with, without);
}

// ---- Headings ----------------------------------------------------------------------------------------

TEST(MotionFilter, FollowsAYawThroughTheSeamAtPi) {
  MotionFilter filter;
  for (int i = 0; i < 300; ++i) {
    const double t = i / 30.0;
    const FilterStep step = filter.update(instant(t), at_pose(t, {0.0, 0.0, wrap_angle(1.0 * t)}));
    if (i < 30) continue;
    ASSERT_EQ(step.state, TrackState::tracking) << i;
    EXPECT_LT(test::heading_error(step.estimate->pose, {0.0, 0.0, 1.0 * t}), 0.003);
    EXPECT_LE(std::abs(step.estimate->pose.yaw), kPi);
    EXPECT_NEAR(step.estimate->velocity.yaw_rate, 1.0, 0.05);
  }
}

TEST(MotionFilter, AHeadingKnownUpToAQuarterTurnIsFollowedWithoutJumps) {
  for (const int turns : {2, 4}) {
    MotionFilter filter;
    Random random(32);
    for (int i = 0; i < 200; ++i) {
      const double t = i / 30.0;
      const double yaw = 0.3 + 0.5 * t;
      Observation seen = at_pose(t, {0.1 * t, 0.0, yaw});
      if (i > 0) seen.pose.yaw = wrap_angle(yaw + 2.0 * kPi / turns * std::floor(random.uniform(0.0, turns)));
      seen.heading_turns = turns;
      const FilterStep step = filter.update(instant(t), seen);
      EXPECT_TRUE(step.accepted) << i;
      if (step.estimate) {
        EXPECT_LT(test::heading_error(step.estimate->pose, {0, 0, yaw}), 0.02) << i;
      }
    }
  }
}

TEST(MotionFilter, TurnsTheTrackWhenTheFrontBecomesKnown) {
  MotionFilter filter(test::white());
  FilterStep step;
  double t = 0.0;
  for (int i = 0; i < 60; ++i) {
    t = i / 30.0;
    Observation seen = at_pose(t, along(t, kPi));  // backwards, as far as can be told
    seen.heading_turns = 2;
    step = filter.update(instant(t), seen);
  }
  EXPECT_NEAR(std::abs(step.estimate->pose.yaw), kPi, 0.01);
  const double before = t;
  t += 1.0 / 30.0;
  step = filter.update(instant(t), at_pose(t, along(t, 0.0)));
  EXPECT_TRUE(step.accepted);
  EXPECT_NEAR(step.estimate->pose.yaw, 0.0, 0.01);
  EXPECT_NEAR(step.estimate->velocity.x, 0.2, 0.01);
  // And the past is told anew.
  const auto past = filter.smoothed(instant(before - 0.5));
  ASSERT_TRUE(past);
  EXPECT_NEAR(past->pose.yaw, 0.0, 0.01);
  EXPECT_LT(test::place_error(past->pose, along(before - 0.5)), 0.002);
}

// ---- Late and odd input ------------------------------------------------------------------------------

struct Fed {
  double t = 0.0;
  std::optional<Observation> seen;
  std::optional<BodyVelocity> said;
};

void give(MotionFilter& filter, const Fed& f) {
  if (f.said) {
    filter.odometry(*f.said);
  } else {
    filter.update(instant(f.t), f.seen);
  }
}

std::vector<Fed> eventful(std::uint64_t seed) {
  const Route route(RouteKind::chaotic, 12.0, seed);
  Random random(seed + 7);
  std::vector<Fed> out;
  for (int i = 0; i < 150; ++i) {
    const double t = i / 30.0;
    const double hidden = std::fmod(t, 2.0);
    auto seen = test::detect({.sigma_m = 2e-3, .sigma_rad = 0.01, .misses = 0.1, .outliers = 0.1},
                             route.at(t).pose, t, random);
    if (hidden > 1.0 && hidden < 1.3) seen.reset();
    out.push_back({.t = t, .seen = seen, .said = {}});
    const double between = t + 0.012;
    if (i % 3 == 0)
      out.push_back(
          {.t = between,
           .seen = {},
           .said = BodyVelocity{
               .at = instant(between), .forward = route.at(between).u, .yaw_rate = route.at(between).w}});
  }
  return out;
}

TEST(MotionFilter, LateDataGiveTheSameResultToTheBitAsDataInOrder) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const std::vector<Fed> events = eventful(seed);
    MotionFilter in_order;
    MotionFilter late;
    for (const Fed& f : events) give(in_order, f);
    // Delivered with delays of up to 0.4 s.
    Random random(seed);
    std::vector<std::pair<double, std::size_t>> delivery;
    for (std::size_t i = 0; i < events.size(); ++i)
      delivery.emplace_back(events[i].t + (random.uniform() < 0.3 ? random.uniform(0.0, 0.4) : 0.0), i);
    std::sort(delivery.begin(), delivery.end());
    for (const auto& [when, i] : delivery) give(late, events[i]);
    for (const double ahead : {0.1, 0.5, 2.0}) {
      const auto a = in_order.predict(instant(events.back().t + ahead));
      const auto b = late.predict(instant(events.back().t + ahead));
      ASSERT_TRUE(a && b);
      EXPECT_EQ(a->pose, b->pose);
      EXPECT_EQ(a->covariance, b->covariance);
    }
    const auto a = in_order.smoothed(instant(events.back().t - 0.777));
    const auto b = late.smoothed(instant(events.back().t - 0.777));
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->pose, b->pose);
    EXPECT_EQ(a->covariance, b->covariance);
  }
}

TEST(MotionFilter, SmoothedAtTheNewestIsFilteredAndOnePassTellsTheSameAsMany) {
  for (std::uint64_t seed = 5; seed <= 7; ++seed) {
    MotionFilter filter;
    for (const Fed& f : eventful(seed)) give(filter, f);
    const Time newest = instant(149 / 30.0);
    const std::vector<Estimate> all = filter.smoothed_from(newest - from_seconds(0.8));
    ASSERT_GT(all.size(), 20U);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i > 0) {
        EXPECT_GT(all[i].at, all[i - 1].at);
      }
      const auto one = filter.smoothed(all[i].at);
      ASSERT_TRUE(one);
      EXPECT_LT(test::place_error(one->pose, all[i].pose), 1e-12);
      EXPECT_LT((one->covariance - all[i].covariance).norm(), 1e-12);
    }
    EXPECT_LT(test::place_error(all.back().pose, filter.predict(newest)->pose), 1e-12);
    EXPECT_FALSE(filter.smoothed(newest + from_seconds(0.01)));
    EXPECT_TRUE(filter.smoothed(newest - from_seconds(1.49)));
    EXPECT_FALSE(filter.smoothed(newest - from_seconds(1.51)));
  }
}

TEST(MotionFilter, AnObservationTooLateOrTwiceEmptyChangesNothing) {
  MotionFilter filter({.smoothing_lag_s = 0.5});
  const double t = drive(filter, 3.0);
  const auto before = filter.predict(instant(t));
  EXPECT_FALSE(filter.update(instant(1.0), at_pose(1.0, {1.0, 1.0, 0.0})).accepted);
  const FilterStep step =
      filter.update(instant(t - 1.0 / 30.0), std::nullopt);  // another camera: not seen there
  EXPECT_EQ(step.state, TrackState::tracking);
  EXPECT_EQ(filter.predict(instant(t))->pose, before->pose);
}

TEST(MotionFilter, TwoCamerasAtOneInstantCountBoth) {
  MotionFilter one;
  MotionFilter two;
  for (int i = 0; i < 30; ++i) {
    const double t = i / 30.0;
    one.update(instant(t), at_pose(t, along(t), 0.01));
    two.update(instant(t), at_pose(t, along(t), 0.01));
    EXPECT_TRUE(two.update(instant(t), at_pose(t, along(t), 0.01)).accepted);
  }
  const double t = 29.0 / 30.0;
  EXPECT_LT(two.predict(instant(t))->covariance(0, 0), 0.7 * one.predict(instant(t))->covariance(0, 0));
}

TEST(MotionFilter, TheOrderInWhichOneInstantIsToldDoesNotMatter) {
  MotionFilter a;
  MotionFilter b;
  for (int i = 0; i < 30; ++i) {
    const double t = i / 30.0;
    Observation left = at_pose(t, along(t), 0.01);
    Observation right = at_pose(t, {0.2 * t + 0.005, 0.003, 0.01}, 0.02);
    right.camera = 1;
    const BodyVelocity said{.at = instant(t), .forward = 0.21};
    a.odometry(said);
    a.update(instant(t), left);
    a.update(instant(t), right);
    a.update(instant(t), std::nullopt);
    b.update(instant(t), std::nullopt);
    b.update(instant(t), right);
    b.odometry(said);
    b.update(instant(t), left);
  }
  EXPECT_EQ(a.predict(instant(1.5))->pose, b.predict(instant(1.5))->pose);
  EXPECT_EQ(a.predict(instant(1.5))->covariance, b.predict(instant(1.5))->covariance);
}

TEST(MotionFilter, InputThatIsNotFiniteOrNoCovarianceIsNoObservation) {
  const auto broken = [](auto change) {
    Observation o = at_pose(0.0, {1.0, 0.0, 0.0});
    change(o);
    return o;
  };
  const std::vector<Observation> bad{
      broken([](Observation& o) { o.pose.x = kNan; }),
      broken([](Observation& o) { o.pose.yaw = std::numeric_limits<double>::infinity(); }),
      broken([](Observation& o) { o.covariance(1, 1) = kNan; }),
      broken([](Observation& o) { o.covariance(2, 2) = 0.0; }),
      broken([](Observation& o) { o.covariance(0, 1) = o.covariance(1, 0) = 1.0; }),
      broken([](Observation& o) { o.pose.y = 1e300; }),
  };
  for (const Observation& o : bad) {
    MotionFilter filter;
    EXPECT_EQ(filter.update(instant(0.0), o).state, TrackState::searching);
    const double t = drive(filter, 1.0);
    const FilterStep step = filter.update(instant(t), o);
    EXPECT_FALSE(step.accepted);
    EXPECT_LT(test::place_error(step.estimate->pose, along(t)), 0.002);
  }
  MotionFilter filter;
  const double t = drive(filter, 1.0);
  EXPECT_FALSE(filter.odometry({.at = instant(t), .forward = kNan}));
}

TEST(MotionFilter, StaysFiniteAndPositiveInAStormOfInput) {
  Random random(33);
  MotionFilter filter;
  double t = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const double dice = random.uniform();
    t += dice < 0.02 ? random.uniform(0.0, 4.0) : random.uniform(-0.05, 0.12);
    const double size = std::pow(10.0, random.uniform(-9.0, 5.0));
    Observation seen =
        at_pose(t, {random.normal() * (dice < 0.3 ? 1e3 : 0.01), random.normal(), random.normal()});
    seen.covariance *= size;
    seen.heading_turns = 1 << static_cast<int>(random.uniform(0.0, 3.0));
    if (random.uniform() < 0.2) {
      filter.odometry({.at = instant(t), .forward = random.normal() * 10, .yaw_rate = random.normal() * 20});
    } else if (random.uniform() < 0.3) {
      filter.update(instant(t), std::nullopt);
    } else {
      filter.update(instant(t), seen);
    }
    for (const double ahead : {0.0, 0.3, 30.0}) {
      const auto e = filter.predict(instant(t + ahead));
      if (!e) continue;
      ASSERT_TRUE(std::isfinite(e->pose.x) && std::isfinite(e->pose.y) &&
                  std::isfinite(e->velocity.yaw_rate));
      ASSERT_LE(std::abs(e->pose.yaw), kPi);
      ASSERT_TRUE(e->covariance.allFinite());
      ASSERT_GT(Eigen::SelfAdjointEigenSolver<Covariance3>(e->covariance).eigenvalues().minCoeff(), 0.0) << i;
    }
    if (i % 10 != 0) continue;
    if (const auto s = filter.smoothed(instant(t - random.uniform(0.0, 1.0)))) {
      ASSERT_TRUE(s->covariance.allFinite());
      ASSERT_GT(Eigen::SelfAdjointEigenSolver<Covariance3>(s->covariance).eigenvalues().minCoeff(), 0.0) << i;
    }
  }
}

TEST(MotionFilter, EverySettingOutsideItsRangeIsNamed) {
  EXPECT_EQ(check(MotionFilterConfig{}), "");
  EXPECT_THAT(check({.max_speed_mps = 0.0}), HasSubstr("max_speed_mps is 0, must lie in [0.01, 50]"));
  EXPECT_THAT(check({.gate = kNan}), HasSubstr("gate"));
  EXPECT_THAT(check({.calibration_observations = 0}), HasSubstr("calibration_observations"));
  EXPECT_THAT(check({.smoothing_lag_s = -1.0}), HasSubstr("smoothing_lag_s"));
  EXPECT_THROW(MotionFilter({.max_gap_s = 0.0}), std::invalid_argument);
}

TEST(MotionFilter, ACloneGoesItsOwnWay) {
  MotionFilter filter;
  const double t = drive(filter, 1.0);
  const auto copy = filter.clone();
  const auto before = copy->predict(instant(t + 0.5));
  filter.update(instant(t), at_pose(t, {0.2 * t, 0.01, 0.0}));
  EXPECT_EQ(copy->predict(instant(t + 0.5))->pose, before->pose);
  EXPECT_NE(filter.predict(instant(t + 0.5))->pose, before->pose);
}

TEST(MotionFilter, ModelProbabilitiesTellHowItMoves) {
  MotionFilter filter(test::white());
  const double t = drive(filter, 3.0);
  const auto driving = *filter.model_probabilities();
  EXPECT_GT(driving[motion::kSteady] + driving[motion::kAdjusting], 0.9);
  for (int i = 0; i < 20; ++i)
    filter.update(instant(t + i / 30.0), at_pose(t + i / 30.0, along(t - 1.0 / 30.0)));
  EXPECT_GT((*filter.model_probabilities())[motion::kStanding], 0.9);
}

}  // namespace
}  // namespace skylight
