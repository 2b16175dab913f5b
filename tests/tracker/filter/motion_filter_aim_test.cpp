// How good the motion filter is: aims and honesty, over routes of the truth generator.
// Over a real recording: tests/service/reproduce/mrclam_test.cpp.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tracker/filter/motion_feed.hpp"
#include "tracker/filter/window.hpp"

namespace skylight {
namespace {

using test::Detector;
using test::instant;
using test::Random;
using test::Route;
using test::RouteKind;
using test::Score;

struct Run {
  RouteKind kind = RouteKind::chaotic;
  double rate_hz = 30.0;
  Detector detector = test::kMiddle;
  std::uint64_t seed = 1;
  double seconds = 40.0;
};

/// Feeds a new filter and calls each(t, route, step, filter) after every frame.
template <typename Each>
void feed(const Run& run, const MotionFilterConfig& config, const Each& each) {
  const Route route(run.kind, run.seconds + 3.0, run.seed);
  Random random(run.seed + 100);
  MotionFilter filter(config);
  for (int i = 0; i / run.rate_hz < run.seconds; ++i) {
    const double t = i / run.rate_hz;
    const auto seen = test::detect(run.detector, route.at(t).pose, t, random);
    each(i, t, route, filter.update(instant(t), seen), filter);
  }
}

TEST(MotionFilterAims, CovariancesAreHonestWhileTracking) {
  for (const Detector& detector : {test::kFine, test::kMiddle, test::kCoarse, test::kPaper}) {
    for (const RouteKind kind : {RouteKind::line, RouteKind::circle_1m25, RouteKind::chaotic}) {
      Score score;
      for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        feed({.kind = kind, .rate_hz = 10.0, .detector = detector, .seed = seed}, test::white(),
             [&](int, double t, const Route& route, const FilterStep& step, const MotionFilter&) {
               if (step.estimate) score.add(*step.estimate, route.at(t).pose);
             });
      }
      SCOPED_TRACE(testing::Message()
                   << "route " << static_cast<int>(kind) << ", sigma " << detector.sigma_m);
      EXPECT_GT(score.nees, 1.8);
      EXPECT_LT(score.nees, 4.2);
      EXPECT_GT(score.inside, 0.90);
      EXPECT_LT(score.inside, 0.99);
      EXPECT_GT(score.frames, 3000U);
    }
  }
}

TEST(MotionFilterAims, PredictionsKnowHowUncertainTheyAre) {
  const std::vector<double> horizons{0.1, 0.5, 1.0, 2.0};
  for (const Detector& detector : {test::kFine, test::kCoarse}) {
    std::vector<Score> scores(horizons.size());
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      feed({.detector = detector, .seed = seed}, test::white(),
           [&](int i, double t, const Route& route, const FilterStep& step, const MotionFilter& filter) {
             if (!step.estimate || i % 10 != 0) return;
             for (std::size_t h = 0; h < horizons.size(); ++h)
               scores[h].add(*filter.predict(instant(t + horizons[h])), route.at(t + horizons[h]).pose);
           });
    }
    for (std::size_t h = 0; h < horizons.size(); ++h) {
      EXPECT_GT(scores[h].nees, 0.5) << horizons[h] << " s ahead, sigma " << detector.sigma_m;
      EXPECT_LT(scores[h].nees, 5.0) << horizons[h] << " s ahead, sigma " << detector.sigma_m;
    }
    if (detector.sigma_m < 1e-3) {
      EXPECT_LT(scores[1].place_m, 0.015);
    }
  }
}

TEST(MotionFilterAims, ADetectorThatClaimsToBeBetterThanItIsIsFoundOut) {
  const auto run = [](double claimed, double most) {
    MotionFilterConfig config = test::white();
    config.max_noise_scale = most;
    Detector detector = test::kCoarse;
    detector.claimed = claimed;
    Score score;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      feed({.kind = RouteKind::circle_1m25, .detector = detector, .seed = seed}, config,
           [&](int, double t, const Route& route, const FilterStep& step, const MotionFilter&) {
             if (step.estimate) score.add(*step.estimate, route.at(t).pose);
           });
    }
    return score;
  };
  const Score honest = run(1.0, 10.0);
  const Score found_out = run(0.3, 10.0);
  const Score believed = run(0.3, 1.0);
  EXPECT_LT(found_out.place_m, 1.25 * honest.place_m);
  EXPECT_LT(found_out.nees, 6.0);
  EXPECT_GT(believed.place_m, 2.0 * honest.place_m);                        // what it would be without
  EXPECT_LT(std::abs(run(1.0, 1.0).place_m / honest.place_m - 1.0), 0.05);  // and the honest one pays nothing
}

/// A detector whose error has a slow part: first-order Gauss-Markov.
class SlowError {
 public:
  SlowError(double sigma_m, double time_s, double dt, std::uint64_t seed)
      : sigma_(sigma_m), keep_(std::exp(-dt / time_s)), random_(seed) {
    error_ = {sigma_ * random_.normal(), sigma_ * random_.normal()};
  }
  Eigen::Vector2d next() {
    const double kick = sigma_ * std::sqrt(1.0 - keep_ * keep_);
    error_ = keep_ * error_ + kick * Eigen::Vector2d(random_.normal(), random_.normal());
    return error_;
  }

 private:
  double sigma_;
  double keep_;
  Random random_;
  Eigen::Vector2d error_;
};

TEST(MotionFilterAims, ASlowErrorOfTheDetectorIsNotAveragedAway) {
  Score told;
  Score untold;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Route route(RouteKind::circle_1m25, 31.0, seed);
    Random random(seed);
    SlowError slow(0.002, 2.0, 1.0 / 30.0, seed + 50);
    MotionFilter knows({.observation_bias_m = 0.002, .observation_bias_rad = 0.0, .bias_time_s = 2.0});
    MotionFilter believes(test::white());
    for (int i = 0; i < 900; ++i) {
      const double t = i / 30.0;
      const Pose2 truth = route.at(t).pose;
      auto seen = test::detect(test::kMiddle, truth, t, random);
      const Eigen::Vector2d error = slow.next();
      seen->pose.x += error.x();
      seen->pose.y += error.y();
      if (const auto e = knows.update(instant(t), seen).estimate) told.add(*e, truth);
      if (const auto e = believes.update(instant(t), seen).estimate) untold.add(*e, truth);
    }
  }
  EXPECT_GT(told.nees, 1.8);
  EXPECT_LT(told.nees, 4.2);
  EXPECT_GT(untold.nees, 10.0);  // what it would be without
}

/// Hidden for 2 s; before, over `entry_s`, an error that grows to 10 mm in some direction. At reappearance.
Score hidden(RouteKind kind, double rate_hz, bool burst, double entry_bias_m) {
  Score score;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Route route(kind, 16.0, seed);
    Random random(seed + 5000);
    const double from = 6.0 + random.uniform(0.0, 5.0);
    const double way = random.uniform(-3.1, 3.1);
    MotionFilter filter({.entry_bias_m = entry_bias_m});
    FilterStep step;
    double t = 0.0;
    for (int i = 0; t < from + 2.0; ++i) {
      t = i / rate_hz;
      auto seen = test::detect(test::kFine, route.at(t).pose, t, random);
      if (t >= from) seen.reset();
      const double ramp = burst ? std::clamp(1.0 - (from - t) / 0.3, 0.0, 1.0) : 0.0;
      if (seen) {
        seen->pose.x += 0.01 * ramp * std::cos(way);
        seen->pose.y += 0.01 * ramp * std::sin(way);
      }
      step = filter.update(instant(t), seen);
    }
    if (step.estimate) score.add(*step.estimate, route.at(t).pose);
  }
  return score;
}

TEST(MotionFilterAims, AfterTwoSecondsUnderABeamItIsWhereItWasPredicted) {
  for (const double rate_hz : {30.0, 10.0}) {
    for (const RouteKind kind : {RouteKind::line, RouteKind::circle_1m25}) {
      for (const bool burst : {false, true}) {
        const Score score = hidden(kind, rate_hz, burst, 0.01);
        EXPECT_EQ(score.frames, 40U);
        EXPECT_LT(score.place_m, 0.030)
            << rate_hz << " Hz, route " << static_cast<int>(kind) << ", burst " << burst;
        EXPECT_LT(score.nees, 4.0);
      }
    }
  }
}

TEST(MotionFilterAims, JudgingTheLastFramesAgainIsWhatHoldsAHalfCoveredRobot) {
  const double with = hidden(RouteKind::line, 30.0, true, 0.01).place_m;
  const double without = hidden(RouteKind::line, 30.0, true, 0.0).place_m;
  EXPECT_LT(2.0 * with, without);
}

TEST(MotionFilterAims, SmoothedIsMuchBetterThanFilteredWithANoisyDetector) {
  for (const double rate_hz : {30.0, 10.0}) {
    for (const RouteKind kind : {RouteKind::line, RouteKind::circle_1m25, RouteKind::chaotic}) {
      Score filtered;
      Score smoothed;
      for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        feed({.kind = kind, .rate_hz = rate_hz, .detector = test::kCoarse, .seed = seed}, test::white(),
             [&](int i, double t, const Route& route, const FilterStep& step, const MotionFilter& filter) {
               if (!step.estimate || t < 6.0) return;
               filtered.add(*step.estimate, route.at(t).pose);
               if (i % static_cast<int>(rate_hz / 3.0) != 0) return;
               const auto s = filter.smoothed(instant(t - 1.0));
               ASSERT_TRUE(s);
               smoothed.add(*s, route.at(t - 1.0).pose);
             });
      }
      SCOPED_TRACE(testing::Message() << rate_hz << " Hz, route " << static_cast<int>(kind));
      EXPECT_GT(filtered.place_m, 1.2 * smoothed.place_m);
      // What went before tells nothing new of a heading that stays as it is.
      if (kind == RouteKind::chaotic) {
        EXPECT_GT(filtered.heading_rad, 1.4 * smoothed.heading_rad);
      }
      EXPECT_GT(smoothed.nees, 1.5);
      EXPECT_LT(smoothed.nees, 5.0);
    }
  }
}

TEST(MotionFilterAims, IsBetterThanTheWindowFilterOnTheSameDetections) {
  for (const double rate_hz : {30.0, 10.0}) {
    for (const RouteKind kind :
         {RouteKind::line, RouteKind::circle_2m, RouteKind::circle_1m25, RouteKind::chaotic}) {
      Score motion;
      Score window;
      for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        const Route route(kind, 40.0, seed);
        Random random(seed + 300);
        MotionFilter ours;
        WindowFilter papers;
        for (int i = 0; i / rate_hz < 40.0; ++i) {
          const double t = i / rate_hz;
          const auto seen = test::detect(test::kCoarse, route.at(t).pose, t, random);
          if (const auto e = ours.update(instant(t), seen).estimate) motion.add(*e, route.at(t).pose);
          if (const auto e = papers.update(instant(t), seen).estimate) window.add(*e, route.at(t).pose);
        }
      }
      EXPECT_GT(window.place_m, (kind == RouteKind::line ? 1.0 : 1.5) * motion.place_m)
          << rate_hz << " Hz, route " << static_cast<int>(kind);
      EXPECT_GT(motion.frames, window.frames);
    }
  }
}

TEST(MotionFilterAims, OdometryCarriesItThroughAGap) {
  Score with;
  Score without;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Route route(RouteKind::chaotic, 12.0, seed);
    Random random(seed);
    MotionFilter said;
    MotionFilter unsaid;
    FilterStep a;
    FilterStep b;
    for (int i = 0; i < 300; ++i) {
      const double t = i / 30.0;
      auto seen = test::detect(test::kMiddle, route.at(t).pose, t, random);
      if (t > 8.0) seen.reset();
      said.odometry({.at = instant(t),
                     .forward = 1.02 * route.at(t).u + 0.005 * random.normal(),
                     .sideways = 0.0,
                     .yaw_rate = 0.98 * route.at(t).w + 0.01 * random.normal(),
                     .covariance = Eigen::Vector3d(2.5e-5, 2.5e-5, 1e-4).asDiagonal()});
      a = said.update(instant(t), seen);
      b = unsaid.update(instant(t), seen);
    }
    const Pose2 truth = route.at(299 / 30.0).pose;
    if (a.estimate) with.add(*a.estimate, truth);
    if (b.estimate) without.add(*b.estimate, truth);
  }
  EXPECT_EQ(with.frames, 30U);
  EXPECT_LT(4.0 * with.place_m, without.place_m);
  EXPECT_LT(4.0 * with.heading_rad, without.heading_rad);
  EXPECT_LT(with.nees, 5.0);
}

TEST(MotionFilterAims, WheelsThatSlipDoNotMisleadIt) {
  // They turn, the robot stands, the camera sees it.
  MotionFilter filter;
  FilterStep step;
  for (int i = 0; i < 200; ++i) {
    const double t = i / 30.0;
    if (i > 60)
      filter.odometry({.at = instant(t),
                       .forward = 0.2,
                       .covariance = Eigen::Vector3d(2.5e-5, 2.5e-5, 1e-4).asDiagonal()});
    step = filter.update(instant(t), test::at_pose(t, {0.5, 0.5, 0.0}));
    if (i < 3) continue;
    EXPECT_LT(test::place_error(step.estimate->pose, {0.5, 0.5, 0.0}), 0.003) << i;
  }
}

}  // namespace
}  // namespace skylight
