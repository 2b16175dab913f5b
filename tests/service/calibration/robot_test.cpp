// A robot's own geometry from exact manoeuvres: against the truth, and the stated standard deviations against
// the errors over many seeds.
#include "service/calibration/robot.hpp"

#include <algorithm>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "service/evaluation/camera_error.hpp"
#include "tests/service/calibration/cameras.hpp"
#include "tests/service/calibration/robot_run.hpp"

namespace skylight::calibration {
namespace {

using test::Piece;
using test::robot_run;
using test::RunPlan;

constexpr double kTurn = 2.0 * std::numbers::pi;
const Piece kStand{.for_s = 2.0};
const Piece kSpin{.w_radps = 1.0, .for_s = kTurn + 0.5};
const Piece kLine{.v_mps = 0.25, .for_s = 16.0};
const Piece kCircle{.v_mps = 0.25, .w_radps = 0.25, .for_s = 4.0 * kTurn + 0.5};

CameraModel ceiling(const Eigen::Vector3d& at = {0.0, 0.0, 4.0}) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  pose.translation() = at;
  return {test::intrinsics_of(test::ceiling_camera()), pose};
}

// Wrong by 5 mm of height and 4 mm of reference point.
RunPlan plan(std::vector<Piece> pieces, std::uint64_t seed = 1) {
  RunPlan out{.pieces = std::move(pieces), .truth = {ceiling()}, .odometry_scale = 0.0, .seed = seed};
  out.geometry = {0.141, {0.020, -0.010, 0.01}};
  out.assumed = {0.136, {0.024, -0.010, 0.0}};
  return out;
}

RobotFit fit_with_distance(const RunPlan& plan, double sigma_m = 5e-4) {
  std::vector<Pose2> places;
  RobotRun run = robot_run(plan, &places);
  run.known.distance = KnownLength{(places[0].position() - places[1].position()).norm(), sigma_m};
  return fit_robot(run);
}

TEST(RobotGeometry, IsFoundWithATurnALineOfKnownLengthAndATurn) {
  const RunPlan asked = plan({kStand, kSpin, kStand, kLine, kStand, kSpin, kStand});
  const RobotFit fit = fit_with_distance(asked);
  ASSERT_TRUE(fit.surface_height_m.value && fit.mounting_x_m.value && fit.mounting_y_m.value);
  ASSERT_TRUE(fit.mounting_yaw.value);
  EXPECT_NEAR(*fit.surface_height_m.value, 0.141, 3.0 * fit.surface_height_m.sigma);
  EXPECT_NEAR(*fit.surface_height_m.value, 0.141, 0.001);
  EXPECT_NEAR(*fit.mounting_x_m.value, 0.020, 0.0002);
  EXPECT_NEAR(*fit.mounting_y_m.value, -0.010, 0.0002);
  EXPECT_NEAR(*fit.mounting_yaw.value, 0.01, 0.002);
  EXPECT_GT(*fit.surface_height_m.sigmas_off(), 4.0) << "5 mm off must be noticed";
  EXPECT_EQ(fit.places, 6U);
  EXPECT_NEAR(fit.span_m, 4.0, 0.002);
}

TEST(RobotGeometry, IsFoundWithATurnAndACircleOfKnownRadius) {
  RunPlan asked = plan({kStand, kSpin, kStand, kCircle, kStand});
  asked.start = {1.0, 0.0, 0.5 * std::numbers::pi};
  RobotRun run = robot_run(asked);
  run.known.radius = KnownLength{1.0, 2e-4};
  const RobotFit fit = fit_robot(run);
  ASSERT_TRUE(fit.surface_height_m.value && fit.mounting_x_m.value && fit.mounting_yaw.value);
  EXPECT_NEAR(*fit.surface_height_m.value, 0.141, 3.0 * fit.surface_height_m.sigma);
  EXPECT_NEAR(*fit.surface_height_m.value, 0.141, 0.002);
  EXPECT_NEAR(*fit.mounting_x_m.value, 0.020, 0.0002);
  EXPECT_NEAR(*fit.mounting_yaw.value, 0.01, 0.002);
  EXPECT_NEAR(fit.circle_radius_m, 1.0, 0.01);
}

TEST(RobotGeometry, SaysWhichManoeuvreIsMissingInsteadOfAFigure) {
  const RobotFit stood = fit_robot(robot_run(plan({kStand})));
  for (const GeometryFigure* figure :
       {&stood.surface_height_m, &stood.mounting_x_m, &stood.mounting_y_m, &stood.mounting_yaw}) {
    EXPECT_FALSE(figure->value);
    EXPECT_FALSE(figure->missing.empty());
  }
  const RobotFit spun = fit_robot(robot_run(plan({kStand, kSpin, kStand})));
  EXPECT_TRUE(spun.mounting_x_m.value && spun.mounting_y_m.value);
  EXPECT_FALSE(spun.surface_height_m.value) << "one camera and no length";
  EXPECT_FALSE(spun.mounting_yaw.value) << "it has not driven";
  const RobotFit drove = fit_robot(robot_run(plan({kStand, kLine, kStand})));
  EXPECT_TRUE(drove.mounting_yaw.value);
  EXPECT_FALSE(drove.mounting_x_m.value || drove.mounting_y_m.value || drove.surface_height_m.value);
  const RobotFit nothing = fit_robot(robot_run(plan({})));
  EXPECT_FALSE(nothing.surface_height_m.value || nothing.mounting_x_m.value || nothing.mounting_yaw.value);
}

// On a circle the point that goes along its heading cannot be told from a heading that is off: both figures
// hang together until the robot turns on the spot or drives straight on.
TEST(RobotGeometry, ACircleAloneLeavesReferencePointAndHeadingOpen) {
  RunPlan asked = plan({kStand, kCircle, kStand});
  asked.start = {1.0, 0.0, 0.5 * std::numbers::pi};
  const RobotFit fit = fit_robot(robot_run(asked));
  EXPECT_FALSE(fit.mounting_x_m.value || fit.mounting_yaw.value);
}

TEST(RobotGeometry, OdometryTellsAHeightOnlyIfItIsCalibrated) {
  RunPlan asked = plan({kStand, kSpin, kStand, kLine, kStand});
  asked.odometry_scale = 1.0;
  asked.odometry_clock_s = 0.73;
  RobotRun run = robot_run(asked);
  const RobotFit usual = fit_robot(run);
  EXPECT_TRUE(usual.remarks.size() <= 1) << usual.remarks.back();
  EXPECT_FALSE(usual.surface_height_m.value)
      << "half a percent is 19 mm, and a ruler's 50 mm tell little more";
  EXPECT_NEAR(usual.surface_height_m.sigma, 1.0 / std::hypot(1.0 / (0.005 * (4.0 - 0.141)), 1.0 / 0.05),
              0.0002);
  run.known.odometry_scale_sigma = 2e-4;
  const RobotFit calibrated = fit_robot(run);
  ASSERT_TRUE(calibrated.surface_height_m.value);
  EXPECT_NEAR(*calibrated.surface_height_m.value, 0.141, 3.0 * calibrated.surface_height_m.sigma);
}

TEST(RobotGeometry, AMeasuredLineTellsTheOdometrysScaleToo) {
  RunPlan asked = plan({kStand, kSpin, kStand, kLine, kStand});
  asked.odometry_scale = 1.006;
  std::vector<Pose2> places;
  RobotRun run = robot_run(asked, &places);
  run.known.distance = KnownLength{4.0, 5e-4};
  const RobotFit fit = fit_robot(run);
  ASSERT_TRUE(fit.odometry_scale.value) << fit.odometry_scale.sigma << " " << fit.surface_height_m.sigma;
  EXPECT_NEAR(*fit.odometry_scale.value, 1.006, 4.0 * fit.odometry_scale.sigma);
}

TEST(RobotGeometry, TwoCamerasThatSeeOnePlaceTellTheHeight) {
  RunPlan asked = plan({kStand, kSpin, kStand});
  asked.start = {0.0, 0.0, 0.0};
  asked.truth = {ceiling({-2.0, 0.0, 4.0}), ceiling({2.0, 0.0, 4.0})};
  const RobotFit fit = fit_robot(robot_run(asked));
  ASSERT_TRUE(fit.surface_height_m.value);
  EXPECT_NEAR(*fit.surface_height_m.value, 0.141, 3.0 * fit.surface_height_m.sigma);
  EXPECT_LT(fit.surface_height_m.sigma, 0.001);
}

// What a user gains: the 4 mm for 5 mm at the edge of a room of 6 m under a camera at 4 m.
TEST(RobotGeometry, AHeightFiveMillimetresOffCostsFourAtTheRoomsEdge) {
  const RunPlan asked = plan({kStand, kSpin, kStand, kLine, kStand, kSpin, kStand});
  const RobotGeometry found = fit_with_distance(asked).geometry();
  const auto error_at_edge = [&](const RobotGeometry& geometry) {
    const Pose2 base{0.0, -2.7, 1.0};  // the camera sees 3 m to either side there
    RobotGeometry height = geometry;
    height.mounting = asked.geometry.mounting;
    const auto seen =
        test::seen_by(asked.truth[0], asked.truth[0], base, asked.geometry, height.surface_height_m);
    const Eigen::Vector2d there =
        seen->position() - Eigen::Rotation2Dd(seen->yaw - height.mounting.yaw) * height.mounting.position();
    return (there - base.position()).norm();
  };
  const double before = error_at_edge(asked.assumed);
  const double after = error_at_edge(found);
  std::printf("at 2.7 m from the point under the camera: %.2f mm before, %.2f mm after\n", 1e3 * before,
              1e3 * after);
  EXPECT_NEAR(before, shift_by_height(0.005, 2.7, 4.0, 0.141), 0.0002);
  EXPECT_NEAR(shift_by_height(0.005, 3.0, 4.0, 0.141), 0.004, 0.0002);
  EXPECT_LT(after, 0.001);
}

TEST(RobotGeometry, WhatContradictsTheRestIsLeftOut) {
  RunPlan asked = plan({kStand, kSpin, kStand, kLine, kStand, kSpin, kStand});
  std::vector<Pose2> places;
  RobotRun run = robot_run(asked, &places);
  for (std::size_t i = 20; i < 60; i += 7) run.seen[i].pose.x += 0.03;  // during the first turn
  run.known.distance = KnownLength{4.0, 5e-4};
  const RobotFit fit = fit_robot(run);
  std::size_t dropped = 0;
  for (const Stretch& stretch : fit.stretches) dropped += stretch.dropped;
  EXPECT_GE(dropped, 4U);
  EXPECT_NEAR(*fit.mounting_x_m.value, 0.020, 0.0005);
  EXPECT_NEAR(*fit.surface_height_m.value, 0.141, 0.001);
}

TEST(RobotGeometry, ARobotThatDoesNotTurnOnTheSpotIsNamed) {
  RunPlan asked = plan({kStand,
                        {.v_mps = 0.03, .w_radps = 1.0, .for_s = 7.0},
                        kStand,
                        {.v_mps = -0.03, .w_radps = 1.0, .for_s = 7.0},
                        kStand});
  RobotRun run = robot_run(asked);
  const RobotFit fit = fit_robot(run);
  const std::string all = [&] {
    std::string out;
    for (const std::string& remark : fit.remarks) out += remark + "\n";
    return out;
  }();
  EXPECT_NE(all.find("does not turn on the spot"), std::string::npos) << all;
}

TEST(RobotGeometry, OdometryOfAnotherRobotIsRefused) {
  RunPlan asked = plan({kStand, kSpin, kStand, kLine, kStand});
  asked.odometry_scale = 1.0;
  RobotRun run = robot_run(asked);
  for (BodyVelocity& reading : run.odometry)
    reading.yaw_rate *= reading.at < Time{from_seconds(1e6 + 6)} ? -1.0 : 1.0;
  const RobotFit fit = fit_robot(run);
  ASSERT_FALSE(fit.remarks.empty());
  EXPECT_NE(fit.remarks[0].find("odometry was left out: it turns otherwise"), std::string::npos)
      << fit.remarks[0];
  for (BodyVelocity& reading : run.odometry) reading.at += std::chrono::hours(1);
  const RobotFit late = fit_robot(run);
  ASSERT_FALSE(late.remarks.empty());
  EXPECT_NE(late.remarks[0].find("covers less than half of the looks"), std::string::npos) << late.remarks[0];
}

// Wheels that turn to and fro by a wave of 0.5 rad/s more than the robot does are off by its amplitude over
// 0.5 rad/s over the square root of two.
TEST(RobotGeometry, OdometryIsBelievedThatTurnsAsTheRobotWasSeenToWithinThreeDegrees) {
  for (const double rms_rad : {0.02, 0.15}) {
    RunPlan asked = plan({kStand, kSpin, kStand, kLine, kStand, kSpin, kStand});
    asked.odometry_scale = 1.0;
    RobotRun run = robot_run(asked);
    for (BodyVelocity& reading : run.odometry)
      reading.yaw_rate +=
          rms_rad * std::sqrt(2.0) * 0.5 * std::cos(0.5 * to_seconds(reading.at - run.odometry.front().at));
    const RobotFit fit = fit_robot(run);
    const bool believed = std::none_of(fit.remarks.begin(), fit.remarks.end(), [](const std::string& remark) {
      return remark.find("odometry was left out") != std::string::npos;
    });
    EXPECT_EQ(believed, rms_rad < 0.05) << rms_rad;
  }
}

TEST(RobotGeometry, ACameraAsHighAsTheRobotTellsNothing) {
  RobotRun run = robot_run(plan({kStand, kSpin, kStand, kLine, kStand}));
  Eigen::Isometry3d low = run.cameras[0].map_from_camera();
  low.translation().z() = run.assumed.surface_height_m;
  run.cameras[0] = CameraModel(run.cameras[0].intrinsics(), low);
  run.known.distance = KnownLength{4.0, 1e-3};
  const RobotFit fit = fit_robot(run);
  EXPECT_FALSE(fit.surface_height_m.value);
  EXPECT_FALSE(fit.mounting_x_m.value || fit.mounting_y_m.value);
}

// Ten minutes are what a history keeps. However long it stood and turned, the fit stays small.
TEST(RobotGeometry, AVeryLongRunIsThinned) {
  const RunPlan asked = plan({{.for_s = 200.0}, {.w_radps = 1.0, .for_s = 200.0}, kStand});
  const RobotFit fit = fit_robot(robot_run(asked));
  for (const Stretch& stretch : fit.stretches) EXPECT_LE(stretch.used + stretch.dropped, 1010U);
  ASSERT_TRUE(fit.mounting_x_m.value);
  EXPECT_NEAR(*fit.mounting_x_m.value, 0.020, 0.0002);
  EXPECT_NEAR(fit.spun_rad, 200.0, 2.0);
}

TEST(RobotGeometry, LengthsOutOfRangeAreRefused) {
  RobotRun run = robot_run(plan({kStand}));
  run.known.distance = KnownLength{0.01, 1e-3};
  EXPECT_EQ(check(run.known), "distance is 0.01 m, allowed 0.1 to 1000");
  EXPECT_THROW(fit_robot(run), std::invalid_argument);
  run.known.distance = KnownLength{4.0, 0.0};
  EXPECT_EQ(check(run.known), "distance is known to 0 m, allowed 0.00001 to 1");
  run.known.distance.reset();
  run.known.radius = KnownLength{2000.0, 1e-3};
  EXPECT_EQ(check(run.known), "radius is 2000 m, allowed 0.1 to 1000");
  run.known.radius.reset();
  run.known.odometry_scale_sigma = 0.0;
  EXPECT_EQ(check(run.known), "odometry_scale_sigma is 0, allowed 0.00001 to 0.5");
  run.known.odometry_scale_sigma = 0.01;
  EXPECT_EQ(check(run.known), "");
}

// Over seeds the error in standard deviations is that of a unit normal: with a camera that is known exactly
// and a tape that errs as it says, and with cameras of a calibration that errs by 1.5 mm over the floor.
struct Honesty {
  double height = 0.0, mounting = 0.0, heading = 0.0;
};

Honesty mean_squares(bool wrong_cameras) {
  constexpr int kSeeds = 40;
  Honesty out;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    RunPlan asked =
        plan({kStand, kSpin, kStand, kLine, kStand, kSpin, kStand}, static_cast<std::uint64_t>(seed));
    if (wrong_cameras) {
      const service::WrongCamera wrong =
          service::wrong_camera(asked.truth[0], {.seed = static_cast<std::uint64_t>(seed)});
      asked.calibrated = {wrong.model};
      asked.told = {wrong.told};
    }
    service::Random tape(1000 + static_cast<std::uint64_t>(seed));
    asked.picture_error = {2e-4 * tape.normal(), 2e-4 * tape.normal(), 5e-4 * tape.normal()};
    RobotRun run = robot_run(asked);
    run.known.distance = KnownLength{4.0 + 1e-3 * tape.normal(), 1e-3};
    const RobotFit fit = fit_robot(run);
    const auto square = [](const GeometryFigure& figure, double truth) {
      return std::pow((figure.value.value_or(figure.assumed) - truth) / figure.sigma, 2) / kSeeds;
    };
    out.height += square(fit.surface_height_m, 0.141);
    out.mounting += 0.5 * (square(fit.mounting_x_m, 0.020) + square(fit.mounting_y_m, -0.010));
    out.heading += square(fit.mounting_yaw, 0.01);
  }
  std::printf("%s: mean squared error in standard deviations: height %.2f, mounting %.2f, heading %.2f\n",
              wrong_cameras ? "calibrated cameras" : "true camera", out.height, out.mounting, out.heading);
  return out;
}

// 40 seeds: the mean of a chi-square of one degree is within 1 +- 0.67 in 99.7 of 100; the sums claim a
// little too much rather than too little where the residuals are tempered by a floor.
TEST(RobotGeometry, TheStandardDeviationsAreHonestWithTheTrueCamera) {
  const Honesty all = mean_squares(false);
  for (const double mean : {all.height, all.mounting, all.heading}) {
    EXPECT_GT(mean, 0.2);
    EXPECT_LT(mean, 1.67);
  }
}

TEST(RobotGeometry, TheStandardDeviationsCoverTheCamerasError) {
  const Honesty all = mean_squares(true);
  for (const double mean : {all.height, all.mounting, all.heading}) {
    EXPECT_GT(mean, 0.2);
    EXPECT_LT(mean, 1.67);
  }
}

}  // namespace
}  // namespace skylight::calibration
