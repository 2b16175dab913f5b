#include "service/reproduce/paper_tables.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "service/reproduce/detection_errors.hpp"
#include "service/reproduce/paper_figures.hpp"
#include "tests/service/reproduce/made_runs.hpp"

namespace skylight::service::reproduce::test {
namespace {

/// Stands at the origin looking along x; every frame is detected with the same error.
ObservedRun standing(const std::string& route, const Pose2& vertical, const Pose2& ray, int frames = 60) {
  ObservedRun run = empty_run(route);
  for (int i = 0; i < frames; ++i) add(run, {0, 0, 0}, vertical, ray);
  return run;
}

TEST(Table1, CountsWhatLiesWithinAlphaOfTheTruth) {
  ObservedRun run = empty_run("line-1");
  add(run, {0, 0, 0}, Pose2{0.03, 0.04, 0}, Pose2{0.2, 0, 0});
  add(run, {0, 0, 0}, std::nullopt, std::nullopt);
  add(run, {0, 0, 0}, Pose2{0.3, 0.4, 0}, Pose2{0, 0.1, 0});
  add(run, {0, 0, 0}, Pose2{0.15, 0.2, 0}, Pose2{0, 0, M_PI});  // base_scan on the wrong side: 0.128 m
  const auto rows = table_1({run, run});
  ASSERT_EQ(rows.size(), 3u);
  for (const AcceptanceRow& row : rows) {
    EXPECT_EQ(row.frames, 8u);
    EXPECT_EQ(row.found, 6u);
  }
  EXPECT_EQ(rows[0].variant, "vertical");
  EXPECT_EQ(rows[0].accepted, 4u);  // exactly 0.25 m is accepted
  EXPECT_NEAR(rows[0].mean_m, 0.15, 1e-12);
  EXPECT_NEAR(rows[0].of_all(), 0.5, 1e-12);
  EXPECT_NEAR(rows[0].of_found(), 2.0 / 3.0, 1e-12);
  EXPECT_EQ(rows[1].variant, "ray");
  EXPECT_EQ(rows[1].accepted, 6u);
  EXPECT_NEAR(rows[1].mean_m, (0.2 + 0.1 + 0.128) / 3, 1e-12);
  EXPECT_EQ(rows[2].accepted, 4u);
  EXPECT_NEAR(rows[2].mean_m, (0.1 + 0.128) / 2, 1e-12);
  EXPECT_EQ(table_1({})[0].of_all(), 0.0);
}

TEST(Figures6And7, OfARobotThatStandsAreTheDetectionsOwnError) {
  const Runs runs{standing("line-1", {}, {0.03, 0.04, 0}), standing("line-1", {}, {0.06, 0.08, 0})};
  const auto windows = figure_6(runs);
  ASSERT_EQ(windows.size(), 20u);
  EXPECT_EQ(windows.front().value, 5.0);
  EXPECT_EQ(windows.back().value, 24.0);
  const auto alphas = figure_7(runs);
  ASSERT_EQ(alphas.size(), 19u);
  EXPECT_NEAR(alphas.front().value, 0.05, 1e-12);
  EXPECT_NEAR(alphas.back().value, 0.5, 1e-12);
  for (const auto& points : {windows, alphas}) {
    for (const SweepPoint& point : points) {
      EXPECT_NEAR(point.figures.mean_m, 0.075, 1e-9) << point.value;
      EXPECT_NEAR(point.figures.spread_m, 0.025, 1e-9) << point.value;
      EXPECT_NEAR(point.figures.lost, 0.0, 1e-12) << point.value;
    }
  }
}

TEST(Table2, AveragesItsRowsAsThePaperDoes) {
  // Three linear runs, one curved: an average over runs would weigh them otherwise.
  const Runs runs{
      standing("line-1", {0.03, 0.04, 0}, {0.01, 0, 0}), standing("line-1", {0.03, 0.04, 0}, {0.01, 0, 0}),
      standing("line-2", {0.06, 0.08, 0}, {0.04, 0, 0}), standing("circle-1", {0.12, 0.16, 0}, {0, 0.06, 0})};
  const Table2 table = table_2(runs);
  ASSERT_EQ(table.movements.size(), 3u);
  EXPECT_EQ(table.movements[0].movement, "linear");
  EXPECT_NEAR(table.movements[0].before.mean_m, 0.2 / 3, 1e-9);
  EXPECT_NEAR(table.movements[0].after.mean_m, 0.06 / 3, 1e-9);
  EXPECT_NEAR(table.movements[0].improvement(), 10.0 / 3, 1e-6);
  EXPECT_EQ(table.movements[1].movement, "curvilinear");
  EXPECT_NEAR(table.movements[1].before.mean_m, 0.2, 1e-9);
  EXPECT_NEAR(table.movements[1].before.minimum_m, 0.2, 1e-9);
  EXPECT_NEAR(table.movements[1].before.dispersion_m, 0.0, 1e-9);
  EXPECT_NEAR(table.movements[1].after.mean_m, 0.06, 1e-9);
  EXPECT_EQ(table.movements[2].movement, "average");
  EXPECT_NEAR(table.movements[2].before.mean_m, (0.2 / 3 + 0.2) / 2, 1e-9);
  EXPECT_NEAR(table.movements[2].after.mean_m, (0.02 + 0.06) / 2, 1e-9);
  EXPECT_EQ(table.movements[2].before.runs, 4u);
  ASSERT_EQ(table.routes.size(), 3u);
  EXPECT_EQ(table.routes[1].movement, "line-2");
  EXPECT_NEAR(table.routes[1].after.mean_m, 0.04, 1e-9);
}

TEST(Table2, DispersionIsWithinARunAndNotBetweenThem) {
  ObservedRun swings = empty_run("line-1");
  for (int i = 0; i < 40; ++i) add(swings, {0, 0, 0}, Pose2{i % 2 == 0 ? 0.05 : 0.15, 0, 0}, Pose2{});
  const Table2 table = table_2({swings, standing("line-1", {0.2, 0, 0}, {})});
  EXPECT_NEAR(table.movements[0].before.mean_m, 0.15, 1e-12);
  EXPECT_NEAR(table.movements[0].before.dispersion_m, (0.05 + 0.0) / 2, 1e-12);
  EXPECT_NEAR(table.movements[0].before.minimum_m, (0.05 + 0.2) / 2, 1e-12);
}

TEST(Table2, TellsOfRunsInWhichNothingWasFound) {
  ObservedRun blind = empty_run("circle-1");
  for (int i = 0; i < 20; ++i) add(blind, {0, 0, 0}, std::nullopt, std::nullopt);
  const MovementRow row = table_2({blind}).movements[1];
  EXPECT_EQ(row.after.failed_runs, 1u);
  EXPECT_EQ(row.after.lost, 1.0);
  EXPECT_EQ(row.after.usable, 0.0);
  EXPECT_EQ(row.improvement(), 0.0);
}

// The paper's own numbers agree with each other as far as they are rounded.
TEST(ThePaper, AveragesItsTable2AndImprovesByItsFactor) {
  const auto& [linear, curved, average] = paper::kTable2;
  EXPECT_NEAR(average.previously.mean_m, (linear.previously.mean_m + curved.previously.mean_m) / 2, 0.00051);
  EXPECT_NEAR(average.currently.mean_m, (linear.currently.mean_m + curved.currently.mean_m) / 2, 0.00051);
  EXPECT_NEAR(average.previously.mean_m / average.currently.mean_m, paper::kImprovement, 0.01);
}

TEST(Contest, IsOverTheFramesOfBoth) {
  ObservedRun run = standing("circle-1", {}, {}, 10);
  run.frames[7].seen[1].reset();  // neither echo has an estimate there
  const auto rows = contest({run}, "ray", echo(0.06, 2), echo(0.02, 4));
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].route, "circle-1");
  EXPECT_EQ(rows[0].frames, 6u);
  EXPECT_EQ(rows[0].both, 5u);
  EXPECT_NEAR(rows[0].first_mean_m, 0.06, 1e-12);
  EXPECT_NEAR(rows[0].second_mean_m, 0.02, 1e-12);
  EXPECT_NEAR(rows[0].ratio(), 3.0, 1e-9);
  EXPECT_NEAR(rows[0].second_lost, 1.0 / 6.0, 1e-12);
  EXPECT_EQ(rows[1].route, "linear");
  EXPECT_EQ(rows[1].frames, 0u);
  EXPECT_EQ(rows[1].ratio(), 0.0);
  EXPECT_EQ(rows[2].route, "curvilinear");
  EXPECT_NEAR(rows[2].ratio(), 3.0, 1e-9);
}

TEST(Contest, TellsOfAFilterThatNeverHasAnEstimate) {
  const auto rows = contest({standing("line-1", {}, {}, 10)}, "ray", echo(0.06), echo(0.0, 1000));
  EXPECT_EQ(rows[0].both, 0u);
  EXPECT_EQ(rows[0].frames, 10u);
  EXPECT_EQ(rows[0].first_lost, 0.0);
  EXPECT_EQ(rows[0].second_lost, 1.0);
}

TEST(DetectionErrors, OfAParallaxAreABiasOutward) {
  // Once round the camera at 2 m, looking along the circle, seen 0.05 m too far out.
  ObservedRun run = empty_run("circle-1");
  const int frames = 200;
  const double step = 2 * M_PI / frames;
  for (int i = 0; i < frames; ++i) {
    const double angle = i * step;
    const double yaw = wrap_angle(angle + M_PI / 2);
    add(run, {2 * std::cos(angle), 2 * std::sin(angle), yaw},
        Pose2{2.05 * std::cos(angle), 2.05 * std::sin(angle), wrap_angle(yaw + 0.1)}, std::nullopt);
  }
  const DetectionErrors errors = detection_errors({run}, "vertical").at(0);
  EXPECT_EQ(errors.found, 200u);
  EXPECT_NEAR(errors.mean_m, 0.05, 1e-9);
  EXPECT_NEAR(errors.bias_map_m.norm(), 0.0, 1e-9);
  EXPECT_NEAR((errors.bias_outward_m - Eigen::Vector2d(0.05, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((errors.bias_robot_m - Eigen::Vector2d(0, -0.05)).norm(), 0.0, 1e-9);  // to its right
  EXPECT_NEAR(errors.mean_yaw_error, 0.1, 1e-9);
  EXPECT_NEAR(errors.std_m, 0.05, 1e-9);
  // Vectors that turn by a step each frame: their product is the cosine of the angle between them.
  EXPECT_NEAR(errors.lag_1, std::cos(step), 1e-9);
  EXPECT_NEAR(errors.e_folding_s.value(), std::acos(1 / M_E) / step / 10.0, 0.001);
  EXPECT_EQ(detection_errors({run}, "ray").at(0).found, 0u);
}

TEST(DetectionErrors, ThatAlternateAreAgainstTheNextOnes) {
  ObservedRun run = empty_run("line-1");
  for (int i = 0; i < 50; ++i)
    add(run, {0, 0, M_PI / 2}, Pose2{i % 2 == 0 ? 0.1 : -0.1, 0.3, 0}, std::nullopt);
  const DetectionErrors errors = detection_errors({run, run}, "vertical").at(0);
  EXPECT_NEAR(errors.lag_1, -1.0, 1e-9);
  EXPECT_NEAR(errors.std_m, 0.1, 1e-9);
  EXPECT_NEAR((errors.bias_map_m - Eigen::Vector2d(0, 0.3)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((errors.bias_robot_m - Eigen::Vector2d(0.3, 0)).norm(), 0.0, 1e-9);  // ahead
  // From 1 to -1 in one frame of 0.1 s: 1/e lies (1 - 1/e) / 2 of the way.
  EXPECT_NEAR(errors.e_folding_s.value(), 0.1 * (1 - 1 / M_E) / 2, 1e-9);
}

TEST(DetectionErrors, WithoutAnySpreadHaveNoCorrelation) {
  const DetectionErrors errors = detection_errors({standing("line-1", {0.1, 0, 0}, {})}, "vertical").at(0);
  EXPECT_EQ(errors.lag_1, 0.0);
  EXPECT_FALSE(errors.e_folding_s.has_value());
}

}  // namespace
}  // namespace skylight::service::reproduce::test
