// A robot's odometry against the laws of dead reckoning.
#include "sim/world/odometry.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world/world.hpp"

namespace skylight::sim {
namespace {

constexpr double kDt = std::chrono::duration<double>(World::kStep).count();

OdometrySpec without_errors() {
  OdometrySpec spec;
  spec.wheel_radius_error = 0.0;
  spec.separation_error = 0.0;
  return spec;
}

/// A robot from (0, 0, 0) of its own frame, with its odometry.
struct Reckoner {
  Reckoner(RobotModelName name, const OdometrySpec& spec, double friction = 1.0, std::uint64_t seed = 1)
      : model(robot_model(name)),
        world(room(friction), {RobotSpec{.id = "a", .model = name}}),
        odometry(spec, model, seed) {}
  static RoomSpec room(double friction) {
    RoomSpec room;
    room.floor.friction = friction;
    return room;
  }
  void run(const Command& command, double seconds) {
    for (int i = 0; i < std::lround(seconds / kDt); ++i) {
      world.step({command});
      odometry.turn(world.wheel_speeds(0), kDt);
    }
  }
  Pose2 truth() const { return world.state(0).pose; }
  double tick_m(const OdometrySpec& spec) const {
    return 2.0 * std::numbers::pi * model.wheel_radius_m / spec.ticks_per_turn;
  }

  const RobotModel& model;
  World world;
  Odometry odometry;
};

TEST(Odometry, WithoutErrorsAndSlipAStraightIsExactToATick) {
  const OdometrySpec spec = without_errors();
  Reckoner a(RobotModelName::waffle_pi, spec);
  a.run({.v_mps = 0.2}, 10.0);
  EXPECT_NEAR(a.odometry.pose().x, a.truth().x, a.tick_m(spec));
  EXPECT_NEAR(a.odometry.pose().y, 0.0, a.tick_m(spec));
  EXPECT_NEAR(a.odometry.pose().yaw, 0.0, a.tick_m(spec) / a.model.wheel_separation_m);
}

TEST(Odometry, WithoutErrorsAndSlipACircleClosesToATickWhateverTheTicks) {
  for (const double ticks : {4096.0, 256.0}) {
    OdometrySpec spec = without_errors();
    spec.ticks_per_turn = ticks;
    Reckoner a(RobotModelName::waffle_pi, spec);
    const double tick = a.tick_m(spec);
    for (int i = 0; i < 13; ++i) {
      a.run({.v_mps = 0.2, .w_radps = 0.5}, 1.0);
      const Pose2& pose = a.odometry.pose();
      const Pose2 truth = a.truth();
      EXPECT_NEAR(wrap_angle(pose.yaw - truth.yaw), 0.0, tick / a.model.wheel_separation_m);
      // Half a tick of heading, on average, over a circle of radius 0.4 m; and the tyres' own few
      // micrometres.
      EXPECT_NEAR(pose.x, truth.x, 2.0 * tick + 0.8 * tick / a.model.wheel_separation_m + 2e-4);
      EXPECT_NEAR(pose.y, truth.y, 2.0 * tick + 0.8 * tick / a.model.wheel_separation_m + 2e-4);
    }
  }
}

TEST(Odometry, AHolonomicRobotReckonsSidewaysToo) {
  const OdometrySpec spec = without_errors();
  Reckoner a(RobotModelName::holonomic, spec);
  a.run({.v_mps = 0.3, .side_mps = 0.2, .w_radps = 0.4}, 5.0);
  EXPECT_NEAR(a.odometry.pose().x, a.truth().x, 2e-3);
  EXPECT_NEAR(a.odometry.pose().y, a.truth().y, 2e-3);
  EXPECT_NEAR(wrap_angle(a.odometry.pose().yaw - a.truth().yaw), 0.0, 1e-3);
  a.odometry.report(std::chrono::seconds(5));
  a.run({.v_mps = 0.3, .side_mps = 0.2, .w_radps = 0.4}, 0.5);
  const OdometryReport report = a.odometry.report(std::chrono::milliseconds(5500));
  EXPECT_NEAR(report.v_mps, 0.3, 0.002);
  EXPECT_NEAR(report.side_mps, 0.2, 0.002);
  EXPECT_NEAR(report.w_radps, 0.4, 0.01);
}

TEST(Odometry, AWrongSeparationTurnsItByTheSameShare) {
  OdometrySpec spec = without_errors();
  spec.separation_error = 0.05;
  Reckoner a(RobotModelName::waffle_pi, spec, 1.0, 7);
  const double factor = a.odometry.separation_factor();
  ASSERT_GT(std::abs(factor - 1.0), 0.005);
  a.run({.w_radps = 1.0}, 3.0);
  EXPECT_NEAR(a.odometry.pose().yaw, a.truth().yaw / factor, 5e-4);
}

TEST(Odometry, UnequalWheelsMakeACircleOfAStraight) {
  OdometrySpec spec = without_errors();
  spec.wheel_radius_error = 0.05;
  Reckoner a(RobotModelName::waffle_pi, spec, 1.0, 3);
  const double left = a.odometry.radius_factors()[0];
  const double right = a.odometry.radius_factors()[1];
  ASSERT_GT(std::abs(left - right), 0.01);
  a.run({.v_mps = 0.2}, 10.0);
  const double way = a.truth().x;
  const double yaw = way * (right - left) / a.model.wheel_separation_m;
  const double radius = 0.5 * way * (left + right) / yaw;
  EXPECT_NEAR(a.odometry.pose().yaw, yaw, 5e-4);
  EXPECT_NEAR(a.odometry.pose().x, radius * std::sin(yaw), 1e-3);
  EXPECT_NEAR(a.odometry.pose().y, radius * (1.0 - std::cos(yaw)), 1e-3);
}

TEST(Odometry, ErrorsOfManyRobotsHaveTheAskedSpread) {
  OdometrySpec spec;
  spec.wheel_radius_error = 0.02;
  spec.separation_error = 0.04;
  double radius2 = 0.0;
  double separation2 = 0.0;
  double mean = 0.0;
  const int count = 4000;
  for (int i = 0; i < count; ++i) {
    const Odometry odometry(spec, robot_model(RobotModelName::waffle_pi), static_cast<std::uint64_t>(i));
    radius2 += std::pow(odometry.radius_factors()[0] - 1.0, 2) / count;
    separation2 += std::pow(odometry.separation_factor() - 1.0, 2) / count;
    mean += (odometry.separation_factor() - 1.0) / count;
  }
  // Relative standard error of a standard deviation: 1 / sqrt(2 n) = 1.1 %.
  EXPECT_NEAR(std::sqrt(radius2), 0.02, 4 * 0.011 * 0.02);
  EXPECT_NEAR(std::sqrt(separation2), 0.04, 4 * 0.011 * 0.04);
  EXPECT_NEAR(mean, 0.0, 4 * 0.04 / std::sqrt(count));
}

TEST(Odometry, SlipMakesItRunAheadOfTheTruth) {
  Reckoner a(RobotModelName::waffle_pi, without_errors(), 0.02);
  a.run({.v_mps = 0.26}, 1.0);
  // The wheels turn at 0.26 m/s after 0.104 s; the tyres give 0.02 * 0.8 * 0.85 g.
  EXPECT_NEAR(a.odometry.pose().x, 0.26 * (1.0 - 0.052), 1e-3);
  EXPECT_NEAR(a.truth().x, 0.5 * 0.02 * 0.8 * 0.85 * 9.81, 1e-3);
}

TEST(Odometry, ReportsComeAtTheirRateByTheRobotsClock) {
  OdometrySpec spec = without_errors();
  spec.rate_hz = 30.0;
  spec.clock_offset_s = 0.25;
  Reckoner a(RobotModelName::waffle_pi, spec);
  int reports = 0;
  for (int i = 0; i < 1000; ++i) {
    const Duration time = i * World::kStep;
    if (a.odometry.due(time)) {
      const OdometryReport report = a.odometry.report(time);
      EXPECT_EQ(report.at.time_since_epoch(), time + std::chrono::milliseconds(250));
      EXPECT_GE(time, from_seconds(reports / 30.0));
      EXPECT_LT(time, from_seconds(reports / 30.0) + World::kStep);
      ++reports;
      EXPECT_NEAR(report.v_mps, reports > 30 ? 0.2 : report.v_mps, 0.002);
    }
    a.run({.v_mps = 0.2}, kDt);
  }
  EXPECT_EQ(reports, 60);
}

}  // namespace
}  // namespace skylight::sim
