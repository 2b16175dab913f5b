// The world against the laws that it stands for.
#include "sim/world/world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace skylight::sim {
namespace {

constexpr double kGravity = 9.81;
constexpr double kDt = std::chrono::duration<double>(World::kStep).count();

RobotSpec robot_at(const std::string& id, double x, double y, double yaw_deg) {
  RobotSpec robot;
  robot.id = id;
  robot.start = {x, y, yaw_deg};
  return robot;
}

RoomSpec room_with_friction(double friction) {
  RoomSpec room;
  room.floor.friction = friction;
  return room;
}

void run(World& world, const std::vector<Command>& commands, double seconds) {
  for (int i = 0; i < std::lround(seconds / kDt); ++i) world.step(commands);
}

TEST(World, AConstantCommandCoversSpeedTimesTimeOnAStraightLine) {
  World world(RoomSpec{}, {robot_at("a", -2.0, -1.0, 30.0)});
  const Command command{.v_mps = 0.22};
  run(world, {command}, 1.0);
  const Pose2 begin = world.state(0).pose;
  run(world, {command}, 10.0);
  const Pose2 end = world.state(0).pose;
  EXPECT_NEAR((end.position() - begin.position()).norm(), 2.2, 2e-4);
  EXPECT_NEAR(std::atan2(end.y - begin.y, end.x - begin.x), std::numbers::pi / 6.0, 1e-4);
  EXPECT_NEAR(end.yaw, std::numbers::pi / 6.0, 1e-4);
}

TEST(World, AConstantTurnDrivesACircleOfRadiusSpeedOverYawRate) {
  World world(RoomSpec{}, {robot_at("a", 0.0, -0.4, 0.0)});
  const Command command{.v_mps = 0.2, .w_radps = 0.5};
  run(world, {command}, 2.0);
  // The centre from one pose and the law; every later pose must lie on the circle around it.
  const Pose2 p = world.state(0).pose;
  const Eigen::Vector2d centre = p.position() + 0.4 * Eigen::Vector2d(-std::sin(p.yaw), std::cos(p.yaw));
  for (int i = 0; i < 100; ++i) {
    run(world, {command}, 0.2);
    EXPECT_NEAR((world.state(0).pose.position() - centre).norm(), 0.4, 5e-4);
  }
  EXPECT_NEAR(std::hypot(world.state(0).velocity.x, world.state(0).velocity.y), 0.2, 1e-3);
  EXPECT_NEAR(world.state(0).velocity.yaw_rate, 0.5, 1e-3);
}

TEST(World, MotorsSpeedUpNoFasterThanTheirLimit) {
  World world(RoomSpec{}, {robot_at("a", 0.0, 0.0, 0.0)});
  const RobotModel& model = robot_model(RobotModelName::waffle_pi);
  double before = 0.0;
  for (int i = 0; i < 100; ++i) {
    world.step({{.v_mps = 0.26}});
    const double now = world.state(0).velocity.x;
    EXPECT_LE((now - before) / kDt, model.max_acceleration_mps2 * 1.001);
    before = now;
  }
  EXPECT_NEAR(before, 0.26, 1e-4);
}

TEST(World, TyresGiveNoMoreThanFrictionTimesLoadAndSlipBeyond) {
  const double factor = 0.05;
  World world(room_with_friction(factor), {robot_at("a", 0.0, 0.0, 0.0)});
  const RobotModel& model = robot_model(RobotModelName::waffle_pi);
  const double most = factor * model.rolling_friction * model.wheel_load * kGravity;
  ASSERT_LT(most, model.max_acceleration_mps2);
  double before = 0.0;
  double largest = 0.0;
  for (int i = 0; i < 200; ++i) {
    world.step({{.v_mps = 0.26}});
    const double now = world.state(0).velocity.x;
    largest = std::max(largest, (now - before) / kDt);
    before = now;
  }
  EXPECT_NEAR(largest, most, 0.002 * most);
  EXPECT_NEAR(world.wheel_speeds(0).x(), 0.26, 1e-9);  // the wheels spin at what is asked
  EXPECT_LT(before, 0.15);                             // the robot lags behind: most * 0.4 s = 0.134 m/s
}

TEST(World, LateralFrictionHoldsARobotOnItsCurveAndASlipperyFloorDoesNot) {
  const Command fast_turn{.v_mps = 0.26, .w_radps = 1.8};  // needs 0.47 m/s^2 towards the centre
  const auto radius = [&](double friction) {
    World world(room_with_friction(friction), {robot_at("a", 0.0, 0.0, 0.0)});
    run(world, {fast_turn}, 3.0);
    const BodyState state = world.state(0);
    return std::hypot(state.velocity.x, state.velocity.y) / std::abs(state.velocity.yaw_rate);
  };
  EXPECT_NEAR(radius(1.0), 0.26 / 1.8, 2e-3);
  // Sideways speed at the axle is what lateral friction takes away.
  const auto sideways = [&](double friction) {
    World world(room_with_friction(friction), {robot_at("a", 0.0, 0.0, 0.0)});
    run(world, {fast_turn}, 3.0);
    const BodyState state = world.state(0);
    return std::abs(-std::sin(state.pose.yaw) * state.velocity.x +
                    std::cos(state.pose.yaw) * state.velocity.y);
  };
  EXPECT_LT(sideways(1.0), 2e-3);
  EXPECT_GT(sideways(0.03), 0.02);
}

TEST(World, OnIceARobotKeepsItsSpeedAndDirection) {
  World world(room_with_friction(0.0), {robot_at("a", 0.0, 0.0, 0.0)});
  run(world, {{.v_mps = 0.26, .w_radps = 1.0}}, 2.0);
  EXPECT_EQ(world.state(0).pose, (Pose2{0.0, 0.0, 0.0}));
}

TEST(World, AWallStopsARobotAtItsOutline) {
  World world(RoomSpec{}, {robot_at("a", 2.5, 0.0, 0.0)});
  double furthest = 0.0;
  for (int i = 0; i < 5000; ++i) {
    world.step({{.v_mps = 0.26}});
    furthest = std::max(furthest, world.state(0).pose.x);
  }
  const double front = 0.084;  // the camera at the robot's front
  EXPECT_LE(furthest + front, 3.0 + 0.002);
  EXPECT_GE(world.state(0).pose.x + front, 3.0 - 0.01);
  EXPECT_TRUE(world.in_contact(0));
  EXPECT_NEAR(world.state(0).velocity.x, 0.0, 1e-3);
}

/// How deep two rectangles overlap by the separating axis theorem; negative: their distance along the best
/// axis.
double overlap_depth(const Rectangle& a, const Pose2& pose_a, const Rectangle& b, const Pose2& pose_b) {
  const auto corners = [](const Rectangle& r, const Pose2& p) {
    std::vector<Eigen::Vector2d> result;
    for (const double x : {r.min.x(), r.max.x()}) {
      for (const double y : {r.min.y(), r.max.y()}) {
        result.emplace_back(p.x + std::cos(p.yaw) * x - std::sin(p.yaw) * y,
                            p.y + std::sin(p.yaw) * x + std::cos(p.yaw) * y);
      }
    }
    return result;
  };
  const auto ca = corners(a, pose_a);
  const auto cb = corners(b, pose_b);
  double least = 1e9;
  for (const double angle :
       {pose_a.yaw, pose_a.yaw + std::numbers::pi / 2, pose_b.yaw, pose_b.yaw + std::numbers::pi / 2}) {
    const Eigen::Vector2d axis(std::cos(angle), std::sin(angle));
    const auto range = [&](const std::vector<Eigen::Vector2d>& points) {
      std::pair<double, double> result{1e9, -1e9};
      for (const auto& point : points)
        result = {std::min(result.first, axis.dot(point)), std::max(result.second, axis.dot(point))};
      return result;
    };
    const auto ra = range(ca);
    const auto rb = range(cb);
    least = std::min(least, std::min(ra.second - rb.first, rb.second - ra.first));
  }
  return least;
}

TEST(World, RobotsThatMeetPushButNeverOverlap) {
  World world(RoomSpec{}, {robot_at("a", -0.6, 0.03, 0.0), robot_at("b", 0.6, -0.05, 180.0),
                           robot_at("c", 0.1, -0.9, 80.0)});
  const auto& footprint = robot_model(RobotModelName::waffle_pi).footprint;
  bool touched = false;
  for (int i = 0; i < 5000; ++i) {
    world.step({{.v_mps = 0.26, .w_radps = 0.05}, {.v_mps = 0.22}, {.v_mps = 0.26}});
    touched = touched || world.in_contact(0);
    if (i % 10 != 0) continue;
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < j; ++k) {
        for (const Rectangle& a : footprint) {
          for (const Rectangle& b : footprint)
            EXPECT_LT(overlap_depth(a, world.state(j).pose, b, world.state(k).pose), 0.003);
        }
      }
    }
  }
  EXPECT_TRUE(touched);
}

TEST(World, CommandsBeyondTheRobotsLimitsAreCut) {
  World world(RoomSpec{}, {robot_at("a", -2.0, 0.0, 0.0)});
  run(world, {{.v_mps = 5.0}}, 2.0);
  EXPECT_NEAR(world.state(0).velocity.x, 0.26, 1e-4);
}

}  // namespace
}  // namespace skylight::sim
