// Cameras that are wrong by a stated amount, and whether poses through them know how wrong they are.
#include "service/evaluation/camera_error.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/tracker/filter/motion_feed.hpp"
#include "tracker/filter/window.hpp"

namespace skylight::service {
namespace {

using test::Random;

constexpr double kRms = 0.0015;
constexpr double kHeight = 0.14;
constexpr double kSide = 0.28;  // of the robot's picture

/// Sees a floor of 6 x 6 m from the middle of its ceiling.
CameraModel ceiling(LensModel lens = LensModel::brown_conrady) {
  Intrinsics in{.width_px = 1920,
                .height_px = 1080,
                .fx_px = 880.0,
                .fy_px = 880.0,
                .cx_px = 962.0,
                .cy_px = 538.0,
                .lens = lens,
                .distortion = {-0.05, 0.01, 0.0, 0.0, 0.0}};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(Eigen::Vector3d(0.1, -0.05, 5.4));
  pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  return {in, pose};
}

/// Where a robot seems to stand through `wrong`: its square picture's corners, fitted by least squares.
Pose2 seen_through(const CameraModel& truth, const CameraModel& wrong, const Pose2& robot) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  Eigen::Vector2d turn = Eigen::Vector2d::Zero();
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector2d arm(corner % 2 == 0 ? -kSide / 2 : kSide / 2, corner < 2 ? -kSide / 2 : kSide / 2);
    const Eigen::Vector2d at = robot.position() + Eigen::Rotation2Dd(robot.yaw) * arm;
    const Pixel pixel = truth.pixel_from_map({at.x(), at.y(), kHeight}).value();
    const Eigen::Vector2d there = wrong.plane_from_pixel(pixel, kHeight).value();
    middle += 0.25 * there;
    turn += Eigen::Vector2d(arm.dot(there), arm.x() * there.y() - arm.y() * there.x());
  }
  return {middle.x(), middle.y(), std::atan2(turn.y(), turn.x())};
}

TEST(WrongCamera, MovesTheFloorByExactlyWhatIsAsked) {
  for (const LensModel lens : {LensModel::brown_conrady, LensModel::kannala_brandt}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      for (const double rms : {1e-4, kRms, 0.02}) {
        const WrongCamera wrong = wrong_camera(ceiling(lens), {.rms_m = rms, .seed = seed});
        EXPECT_NEAR(floor_rms(ceiling(lens), wrong.model, {6.0, 6.0}), rms, 1e-9 * rms) << seed;
        EXPECT_EQ(check(wrong.told), "");
      }
    }
  }
}

TEST(WrongCamera, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const WrongCamera a = wrong_camera(ceiling(), {.seed = 7});
  const WrongCamera b = wrong_camera(ceiling(), {.seed = 7});
  const WrongCamera c = wrong_camera(ceiling(), {.seed = 8});
  EXPECT_EQ(a.model.intrinsics().fx_px, b.model.intrinsics().fx_px);
  EXPECT_EQ(a.model.map_from_camera().matrix(), b.model.map_from_camera().matrix());
  EXPECT_GT(floor_rms(a.model, c.model, {6.0, 6.0}), 0.5 * kRms);
}

TEST(WrongCamera, WithoutAnErrorIsTheTrueOne) {
  const WrongCamera wrong = wrong_camera(ceiling(), {.rms_m = 0.0});
  EXPECT_EQ(wrong.model.map_from_camera().matrix(), ceiling().map_from_camera().matrix());
  EXPECT_EQ(wrong.told.covariance.norm(), 0.0);
}

TEST(WrongCamera, HasALensAndAHeightThatErrTogether) {
  const auto told = wrong_camera(ceiling(), {}).told.covariance;
  const int height = kCameraPosition + 2;
  const double together = told(kFocalX, height) / std::sqrt(told(kFocalX, kFocalX) * told(height, height));
  EXPECT_GT(together, 0.7);
  // Of the size that chessboards leave: a few tenths of a percent at most.
  EXPECT_LT(std::sqrt(told(kFocalX, kFocalX)), 0.004 * 880.0);
  EXPECT_GT(std::sqrt(told(kFocalX, kFocalX)), 0.0003 * 880.0);
}

TEST(WrongCamera, WhatCannotBeIsRefused) {
  EXPECT_THROW(wrong_camera(ceiling(), {.rms_m = -1.0}), std::invalid_argument);
  EXPECT_THROW(wrong_camera(ceiling(), {.rms_m = std::nan("")}), std::invalid_argument);
  Eigen::Isometry3d away = ceiling().map_from_camera();
  away.translation().x() = 100.0;
  EXPECT_THROW(wrong_camera({ceiling().intrinsics(), away}, {}), std::invalid_argument);
}

TEST(WrongCamera, TakesThePlaceOfEachCameraOfAnAssemblyAndTheTrackerIsToldOfIt) {
  Assembly assembly;
  assembly.cameras = {{"left", ceiling()}, {"right", ceiling()}};
  use_wrong_cameras(assembly, {.rms_m = kRms, .seed = 3});
  ASSERT_EQ(assembly.tracker.calibration.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(floor_rms(ceiling(), assembly.cameras[i].model, {6.0, 6.0}), kRms, 1e-9 * kRms);
    EXPECT_GT(assembly.tracker.calibration[i].covariance.norm(), 0.0);
  }
  // Two cameras of one make are calibrated one by one.
  EXPECT_GT(floor_rms(assembly.cameras[0].model, assembly.cameras[1].model, {6.0, 6.0}), 0.5 * kRms);
  EXPECT_NO_THROW(Tracker({assembly.cameras[0].model, assembly.cameras[1].model}, assembly.tracker));
}

/// What a filter publishes of robots that stand at random places, seen through 200 wrong cameras.
struct Claims {
  test::Score told, untold;
};
template <class F, class G>
Claims claims(int frames, const F& make_filter, const G& camera) {
  Claims out;
  Random random(4401);
  const CameraModel truth = ceiling();
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const WrongCamera wrong = camera(seed);
    const Pose2 robot{random.uniform(-2.6, 2.6), random.uniform(-2.6, 2.6), random.uniform(-3.1, 3.1)};
    const Pose2 seen = seen_through(truth, wrong.model, robot);
    auto filter = make_filter();
    for (int i = 0; i < frames; ++i) {
      const Pose2 noisy{seen.x + 1e-4 * random.normal(), seen.y + 1e-4 * random.normal(),
                        seen.yaw + 4e-4 * random.normal()};
      Observation observation = test::at_pose(i / 30.0, noisy, 1e-4, 4e-4);
      observation.correlated =
          floor_covariance(wrong.model, wrong.told, observation.pose.position(), kHeight).value();
      const FilterStep step = filter.update(observation.captured, observation);
      if (i + 1 < frames) continue;
      Estimate estimate = step.estimate.value();
      out.told.add(estimate, robot);
      estimate.covariance -= observation.correlated;
      out.untold.add(estimate, robot);
    }
  }
  return out;
}

MotionFilter motion() {
  return MotionFilter(test::white());
}
WindowFilter window() {
  return WindowFilter();
}

/// As large as the family makes it.
WrongCamera any_size(std::uint64_t seed) {
  static const WrongCamera usual = wrong_camera(ceiling(), {.rms_m = kRms});
  Random random(4500 + seed);
  CameraParameters white;
  for (double& each : white) each = random.normal();
  // By eigenvectors: of k3 nothing is unknown, which a Cholesky factor does not take.
  const Eigen::SelfAdjointEigenSolver<decltype(usual.told.covariance)> solver(usual.told.covariance);
  const CameraParameters by =
      solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().cwiseProduct(white);
  return {.model = moved(ceiling(), by), .told = usual.told};
}
/// Of exactly the size that is expected: then none is much worse than usual, and more than 95 % lie inside.
WrongCamera exact_size(std::uint64_t seed) {
  return wrong_camera(ceiling(), {.rms_m = kRms, .seed = seed});
}

void expect_honest(const Claims& claims) {
  EXPECT_NEAR(claims.told.nees, 3.0, 0.6);
  EXPECT_GE(claims.told.inside, 0.90);
  // Averaged away as if it were noise:
  EXPECT_GT(claims.untold.nees, 100.0);
  EXPECT_LT(claims.untold.inside, 0.3);
}

TEST(WrongCamera, PosesOfTheMotionFilterKnowHowWrongItIsOverManyCalibrations) {
  const Claims any = claims(12, motion, any_size);
  expect_honest(any);
  EXPECT_LE(any.told.inside, 0.98);
  expect_honest(claims(12, motion, exact_size));
}

TEST(WrongCamera, PosesOfTheWindowFilterKnowHowWrongItIsOverManyCalibrations) {
  const Claims any = claims(24, window, any_size);
  expect_honest(any);
  EXPECT_LE(any.told.inside, 0.98);
  expect_honest(claims(24, window, exact_size));
}

}  // namespace
}  // namespace skylight::service
