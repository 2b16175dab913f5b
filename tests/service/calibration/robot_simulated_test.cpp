// A robot of the simulator, told wrongly by 5 mm of height and 4 mm of reference point, and found out by
// turning and driving before a camera that is known exactly, and before one of a usual calibration.
#include <cstdio>
#include <deque>
#include <numbers>

#include <gtest/gtest.h>

#include "service/evaluation/camera_error.hpp"
#include "service/robot_geometry.hpp"
#include "service/sources/simulator.hpp"

namespace skylight::service {
namespace {

using calibration::GeometryFigure;
using calibration::RobotFit;
using calibration::RobotGeometry;

constexpr double kHeightWrong_m = 0.005;
constexpr double kForwardWrong_m = 0.004;
constexpr double kTape_m = 5e-4;

struct Case {
  Case(Assembly a, const RobotSpec& told)
      : assembly(std::move(a)),
        tracker(with(assembly, told)),
        run(told, models(assembly), assembly.tracker.calibration, {}) {}

  static Tracker with(Assembly& assembly, const RobotSpec& told) {
    assembly.robots = {told};
    return make_tracker(assembly);
  }
  static std::vector<CameraModel> models(const Assembly& assembly) {
    std::vector<CameraModel> out;
    for (const NamedCamera& camera : assembly.cameras) out.push_back(camera.model);
    return out;
  }

  Assembly assembly;
  Tracker tracker;
  GeometryRun run;
};

class SimulatedRobot : public testing::Test {
 protected:
  // Once for all tests: the frames are dear.
  static void SetUpTestSuite() {
    const auto simulator = std::make_shared<SimulatorFrames>(scenario_run("robot-geometry", std::nullopt));
    const Config config{.source = {SimulatorSource{}}};
    truth_ = configured_geometry(assemble(config, simulator).robots.at(0));
    RobotSpec told = assemble(config, simulator).robots.at(0);
    told.surface_height_m = truth_.surface_height_m + kHeightWrong_m;
    told.picture_mounting = Pose2{truth_.mounting.x + kForwardWrong_m, truth_.mounting.y, 0.0};
    std::deque<Case> cases;
    cases.emplace_back(assemble(config, simulator), told);
    for (const std::uint64_t seed : {1, 2}) {
      Assembly wrong = assemble(config, simulator);
      use_wrong_cameras(wrong, {.seed = seed});
      cases.emplace_back(std::move(wrong), told);
    }
    std::vector<Pose2> places;
    while (const auto frame = simulator->next()) {
      places.push_back(simulator->truth().at(0).pose);
      for (Case& one : cases) {
        const auto reports = one.tracker.process(*frame);
        if (reports[0].measured) one.run.add(*reports[0].measured);
      }
    }
    told_ = told;
    camera_ = cases.front().assembly.cameras.front().model;
    const double distance = (places.back().position() - places.front().position()).norm();
    for (Case& one : cases) {
      calibration::RobotRun run = one.run.run();
      run.known.distance = calibration::KnownLength{distance, kTape_m};
      runs_.push_back(run);
      fits_.push_back(calibration::fit_robot(run));
      std::printf(
          "%s camera: height off by %+.2f +- %.2f mm, reference point by %+.2f +- %.2f, %+.2f +- %.2f mm, "
          "heading by %+.3f +- %.3f degrees\n",
          fits_.size() == 1 ? "true" : "calibrated",
          1e3 * (*fits_.back().surface_height_m.value - truth_.surface_height_m),
          1e3 * fits_.back().surface_height_m.sigma,
          1e3 * (*fits_.back().mounting_x_m.value - truth_.mounting.x), 1e3 * fits_.back().mounting_x_m.sigma,
          1e3 * (*fits_.back().mounting_y_m.value - truth_.mounting.y), 1e3 * fits_.back().mounting_y_m.sigma,
          57.29578 * *fits_.back().mounting_yaw.value, 57.29578 * fits_.back().mounting_yaw.sigma);
    }
  }
  static void TearDownTestSuite() {
    runs_.clear();
    fits_.clear();
  }

  static bool within(const GeometryFigure& figure, double truth) {
    return figure.value && std::abs(*figure.value - truth) <= 3.0 * figure.sigma;
  }

  static inline RobotGeometry truth_;
  static inline RobotSpec told_;
  static inline std::optional<CameraModel> camera_;
  static inline std::vector<calibration::RobotRun> runs_;
  static inline std::vector<RobotFit> fits_;
};

TEST_F(SimulatedRobot, ItsHeightAndReferencePointAreFoundWithTheTrueCamera) {
  const RobotFit& fit = fits_.at(0);
  EXPECT_TRUE(within(fit.surface_height_m, truth_.surface_height_m));
  EXPECT_TRUE(within(fit.mounting_x_m, truth_.mounting.x));
  EXPECT_TRUE(within(fit.mounting_y_m, truth_.mounting.y));
  EXPECT_TRUE(within(fit.mounting_yaw, 0.0));
  EXPECT_NEAR(*fit.surface_height_m.value, truth_.surface_height_m, 0.001);
  EXPECT_NEAR(*fit.mounting_x_m.value, truth_.mounting.x, 0.0005);
  EXPECT_NEAR(*fit.mounting_y_m.value, truth_.mounting.y, 0.0005);
  EXPECT_EQ(verdict(fit.surface_height_m), "change");
  EXPECT_EQ(verdict(fit.mounting_x_m), "change");
  EXPECT_EQ(verdict(fit.mounting_y_m), "agrees");
}

TEST_F(SimulatedRobot, WithACalibratedCameraTheStatedDeviationsCoverTheError) {
  for (std::size_t i = 1; i < fits_.size(); ++i) {
    const RobotFit& fit = fits_[i];
    EXPECT_TRUE(within(fit.surface_height_m, truth_.surface_height_m)) << i;
    EXPECT_TRUE(within(fit.mounting_x_m, truth_.mounting.x)) << i;
    EXPECT_TRUE(within(fit.mounting_y_m, truth_.mounting.y)) << i;
    EXPECT_TRUE(within(fit.mounting_yaw, 0.0)) << i;
    EXPECT_GT(fit.surface_height_m.sigma, fits_[0].surface_height_m.sigma);
  }
}

TEST_F(SimulatedRobot, TheCircleOfAKnownRadiusTellsTheHeightAsTheLineDoes) {
  calibration::RobotRun run = runs_.at(0);
  run.known.distance.reset();
  const RobotFit open = calibration::fit_robot(run);
  EXPECT_FALSE(open.surface_height_m.value);
  EXPECT_FALSE(open.surface_height_m.missing.empty());
  ASSERT_GT(open.circled_rad, std::numbers::pi);
  run.known.radius = calibration::KnownLength{0.9, 5e-4};
  const RobotFit fit = calibration::fit_robot(run);
  ASSERT_TRUE(fit.surface_height_m.value) << fit.surface_height_m.missing;
  EXPECT_TRUE(within(fit.surface_height_m, truth_.surface_height_m))
      << *fit.surface_height_m.value << " +- " << fit.surface_height_m.sigma;
}

// The figure: a height wrong by 5 mm costs 4 mm at the room's edge.
TEST_F(SimulatedRobot, WhatIsFoundTakesAwayWhatTheWrongHeightCostsAtTheRoomsEdge) {
  const RobotSpec corrected = with_geometry(told_, fits_.at(0));
  const auto shift = [&](const RobotSpec& spec) {
    return calibration::shift_by_height(*spec.surface_height_m - truth_.surface_height_m, 3.0,
                                        camera_->map_from_camera().translation().z(),
                                        truth_.surface_height_m);
  };
  std::printf("3 m from the point under the camera: %.2f mm off before, %.2f mm after\n", 1e3 * shift(told_),
              1e3 * shift(corrected));
  EXPECT_NEAR(shift(told_), 0.004, 0.0002);
  EXPECT_LT(std::abs(shift(corrected)), 0.0008);
  EXPECT_NEAR(corrected.picture_mounting->x, truth_.mounting.x, 0.0005);
}

}  // namespace
}  // namespace skylight::service
