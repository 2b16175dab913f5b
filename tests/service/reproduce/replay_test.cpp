#include "service/reproduce/replay.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "tests/service/reproduce/made_runs.hpp"

namespace skylight::service::reproduce::test {
namespace {

using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;
using testing::Eq;
using testing::Optional;

constexpr double kQuarterTurn = M_PI / 2;

/// Drives along x at this speed, 10 frames/s, detected without any error.
ObservedRun straight(double speed_mps, int frames) {
  ObservedRun run = empty_run("line-1");
  for (int i = 0; i < frames; ++i) {
    const Pose2 pose{speed_mps * i / 10.0, 0.0, 0.0};
    add(run, pose, pose, pose);
  }
  return run;
}

TEST(Trace, OfVerticalIsOfBaseLinkAndOfRayIsOfBaseScan) {
  ObservedRun run = empty_run("line-1");
  // Looks along +y: base_scan is 0.064 m behind, at smaller y. Detected with the heading turned round, its
  // point lies as far on the other side.
  add(run, {1, 2, kQuarterTurn}, Pose2{1.03, 2.04, 0}, Pose2{1, 2, -kQuarterTurn});
  const TracedFrame vertical = trace(run, "vertical").at(0);
  EXPECT_EQ(vertical.truth, Eigen::Vector2d(1, 2));
  EXPECT_NEAR((*vertical.detected - vertical.truth).norm(), 0.05, 1e-12);
  const TracedFrame ray = trace(run, "ray").at(0);
  EXPECT_NEAR((ray.truth - Eigen::Vector2d(1, 2 - 0.064)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((*ray.detected - Eigen::Vector2d(1, 2 + 0.064)).norm(), 0.0, 1e-12);
}

TEST(Trace, RefusesAVariantThatTheRunHasNot) {
  EXPECT_THROW(trace(empty_run("line-1"), "sideways"), std::invalid_argument);
}

TEST(AcceptedErrors, BeginAtTheFirstAcceptedFrameAndGoOnToTheEnd) {
  ObservedRun run = empty_run("line-1");
  add(run, {0, 0, 0}, std::nullopt, std::nullopt);
  add(run, {0, 0, 0}, Pose2{0.3, 0.4, 0}, std::nullopt);  // 0.5 m off
  add(run, {0, 0, 0}, Pose2{0.03, 0.04, 0}, std::nullopt);
  add(run, {0, 0, 0}, std::nullopt, std::nullopt);
  add(run, {0, 0, 0}, Pose2{0, 0.25, 0}, std::nullopt);  // exactly alpha
  add(run, {0, 0, 0}, Pose2{0.26, 0, 0}, std::nullopt);
  EXPECT_THAT(
      accepted_errors(run, "vertical", 0.25),
      ElementsAre(Optional(DoubleNear(0.05, 1e-12)), Eq(std::nullopt), Optional(0.25), Eq(std::nullopt)));
  EXPECT_THAT(accepted_errors(run, "ray", 0.25), Each(Eq(std::nullopt)));  // a failure is not left out
  EXPECT_EQ(accepted_errors(run, "ray", 0.25).size(), 6u);
}

// The sum of offsets telescopes: on a line the window filter lags by one frame's motion, whatever its size.
TEST(FilteredErrors, OfTheWindowOnALineAreOneFramesMotion) {
  for (const int window : {5, 12, 24}) {
    const Errors errors =
        filtered_errors(straight(0.22, 1500), "ray", paper_filter({.window_size = window, .alpha = 0.25}));
    // Three detections are let pass, a window is filled: its last frame has the first estimate, that frame's
    // detection itself.
    EXPECT_EQ(errors.size(), 1500u - 3u - static_cast<std::size_t>(window) + 1u);
    EXPECT_NEAR(errors.front().value(), 0.0, 1e-12);
    EXPECT_NEAR(errors.back().value(), 0.022, 1e-9) << window;
  }
}

// The gate measures from a prediction that lags by a frame to a robot that went on by another.
// (While it settles it swings a little beyond.)
TEST(FilteredErrors, EndWhereTheGateIsNarrowerThanTwoFramesMotion) {
  const ObservedRun fast = straight(1.0, 120);
  const auto lost = [&](double alpha) {
    return figures_of({filtered_errors(fast, "ray", paper_filter({.window_size = 12, .alpha = alpha}))}).lost;
  };
  EXPECT_GT(lost(0.18), 0.05);
  EXPECT_EQ(lost(0.25), 0.0);
}

TEST(FilteredErrors, OfAFilterOfBaseLinkAreJudgedAtTheVariantsPoint) {
  ObservedRun run = empty_run("circle-1");
  add(run, {1, 2, 0.7}, std::nullopt, Pose2{1, 2, 0.7});
  add(run, {1, 2, 0.7}, std::nullopt, Pose2{1, 2, 0.7 + M_PI});
  const Errors errors = filtered_errors(run, "ray", echo());
  EXPECT_NEAR(errors.at(0).value(), 0.0, 1e-12);
  EXPECT_NEAR(errors.at(1).value(), 2 * 0.064, 1e-12);
  EXPECT_NEAR(filtered_errors(run, "ray", echo(0.03)).at(0).value(), 0.03, 1e-12);
}

TEST(ErrorFigures, AreOfRunsFirstAndThenOfTheirMeans) {
  const ErrorFigures figures = figures_of({{0.03, 0.05, std::nullopt},
                                           {0.01},
                                           {0.2, std::nullopt, std::nullopt, 0.2},
                                           {std::nullopt, std::nullopt}});
  EXPECT_EQ(figures.runs, 3u);
  EXPECT_EQ(figures.failed_runs, 1u);
  EXPECT_EQ(figures.frames, 10u);
  // Means 0.04, 0.01 and 0.2; standard deviations 0.01, 0 and 0.
  EXPECT_NEAR(figures.mean_m, 0.25 / 3, 1e-12);
  EXPECT_NEAR(figures.dispersion_m, 0.01 / 3, 1e-12);
  EXPECT_NEAR(figures.minimum_m, (0.03 + 0.01 + 0.2) / 3, 1e-12);
  EXPECT_NEAR(figures.spread_m,
              std::sqrt((0.04 * 0.04 + 0.01 * 0.01 + 0.2 * 0.2) / 3 - std::pow(0.25 / 3, 2)), 1e-12);
  EXPECT_NEAR(figures.smallest_mean_m, 0.01, 1e-12);
  EXPECT_NEAR(figures.largest_mean_m, 0.2, 1e-12);
  EXPECT_NEAR(figures.pooled_mean_m, (0.03 + 0.05 + 0.01 + 0.2 + 0.2) / 5, 1e-12);
  EXPECT_NEAR(figures.usable, 3.0 / 10.0, 1e-12);
  EXPECT_NEAR(figures.lost, 5.0 / 10.0, 1e-12);
}

TEST(ErrorFigures, OfNothingAreNought) {
  EXPECT_EQ(figures_of({}).frames, 0u);
  const ErrorFigures failed = figures_of({{std::nullopt}, {std::nullopt}});
  EXPECT_EQ(failed.failed_runs, 2u);
  EXPECT_EQ(failed.mean_m, 0.0);
  EXPECT_EQ(failed.lost, 1.0);
}

}  // namespace
}  // namespace skylight::service::reproduce::test
