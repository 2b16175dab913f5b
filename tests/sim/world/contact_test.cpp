// Pushing, sliding and driving sideways against the laws that they stand for.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world/world.hpp"

namespace skylight::sim {
namespace {

constexpr double kGravity = 9.81;
constexpr double kDt = std::chrono::duration<double>(World::kStep).count();

RobotSpec robot_at(RobotModelName model, double x, double y, double yaw_deg) {
  RobotSpec robot;
  robot.id.push_back('r');
  robot.model = model;
  robot.start = {x, y, yaw_deg};
  return robot;
}
RobotSpec waffle_at(double x, double y, double yaw_deg) {
  return robot_at(RobotModelName::waffle_pi, x, y, yaw_deg);
}

RoomSpec room_with_friction(double friction) {
  RoomSpec room;
  room.floor.friction = friction;
  return room;
}

ObjectSpec box_at(double x, double y, double mass_kg, double friction) {
  ObjectSpec box;
  box.id = "box";
  box.x_m = x;
  box.y_m = y;
  box.pushable = true;
  box.mass_kg = mass_kg;
  box.friction = friction;
  return box;
}

void run(World& world, const std::vector<Command>& commands, double seconds) {
  for (int i = 0; i < std::lround(seconds / kDt); ++i) world.step(commands);
}

/// What its tyres can push with on a floor of factor 1, N.
double traction(RobotModelName name) {
  const RobotModel& model = robot_model(name);
  return model.rolling_friction * model.wheel_load * model.mass_kg * kGravity;
}

TEST(Contact, MomentumIsConservedWhenBodiesCollideOnIce) {
  World world(room_with_friction(0.0),
              {waffle_at(-0.8, 0.05, 0.0), robot_at(RobotModelName::differential, 0.0, 0.0, 0.0)});
  ObjectSpec thing = box_at(0.6, -0.1, 0.7, 0.0);
  thing.shape = BodyShape::cylinder;
  const std::size_t cylinder = world.add_thing(thing);
  const std::vector<double> mass{1.8, 3.0, 0.7};
  const auto momentum = [&] {
    Eigen::Vector2d sum(0.0, 0.0);
    for (std::size_t i = 0; i < 3; ++i) {
      const BodyState s = world.state(i);
      // Velocity of the centre of mass from that of base_link.
      const double x = i == 0 ? robot_model(RobotModelName::waffle_pi).centre_of_mass_x_m : 0.0;
      sum += mass[i] * Eigen::Vector2d(s.velocity.x - s.velocity.yaw_rate * x * std::sin(s.pose.yaw),
                                       s.velocity.y + s.velocity.yaw_rate * x * std::cos(s.pose.yaw));
    }
    return sum;
  };
  world.push(0, {0.9, 0.0});
  bool first = false;
  bool second = false;
  for (int i = 0; i < 2000; ++i) {
    world.step({{}, {}});
    first = first || std::count(world.touches().begin(), world.touches().end(), Touch{0, 1}) > 0;
    second = second || world.in_contact(cylinder);
    EXPECT_NEAR(momentum().x(), 0.9, 1e-5);
    EXPECT_NEAR(momentum().y(), 0.0, 1e-5);
  }
  EXPECT_TRUE(first);
  EXPECT_TRUE(second);
}

/// How far a robot that stands before it gets a box of 1 kg in three seconds.
double pushed(double friction) {
  World world(RoomSpec{}, {waffle_at(-0.15 - 0.084, 0.0, 0.0)});
  const std::size_t box = world.add_thing(box_at(0.0, 0.0, 1.0, friction));
  run(world, {{.v_mps = 0.1}}, 3.0);
  return world.state(box).pose.x;
}

TEST(Contact, ABoxIsPushedOnlyWhereTheTyresGiveMoreThanItsFriction) {
  const double limit = traction(RobotModelName::waffle_pi) / (1.0 * kGravity);
  ASSERT_NEAR(limit, 1.224, 1e-3);
  EXPECT_GT(pushed(0.95 * limit), 0.1);
  EXPECT_LT(pushed(1.05 * limit), 1e-3);
}

TEST(Contact, ARobotThatPushesWithinItsGripKeepsTheSpeedOfItsWheels) {
  World world(RoomSpec{}, {waffle_at(-0.4, 0.0, 0.0)});
  const std::size_t box = world.add_thing(box_at(0.0, 0.0, 1.0, 0.5));
  run(world, {{.v_mps = 0.2}}, 3.0);
  EXPECT_TRUE(world.in_contact(box));
  EXPECT_NEAR(world.state(0).velocity.x, 0.2, 1e-4);
  EXPECT_NEAR(world.state(box).velocity.x, 0.2, 1e-4);
}

TEST(Contact, AKnockedThingSlidesAsFarAsItsFrictionLetsIt) {
  for (const double friction : {0.2, 0.5}) {
    World world(RoomSpec{}, {});
    const std::size_t box = world.add_thing(box_at(-1.0, 0.5, 2.0, friction));
    world.push(box, {3.0, 0.0});  // 1.5 m/s
    run(world, {}, 2.0);
    const double way = 1.5 * 1.5 / (2.0 * friction * kGravity);
    EXPECT_NEAR(world.state(box).pose.x, -1.0 + way, 0.01 * way);
    EXPECT_NEAR(world.state(box).velocity.x, 0.0, 1e-6);
  }
}

TEST(Contact, ABoxThatIsPushedAtItsEdgeTurns) {
  World world(RoomSpec{}, {waffle_at(-0.4, -0.15, 0.0)});
  const std::size_t box = world.add_thing(box_at(0.0, 0.0, 1.0, 0.5));
  run(world, {{.v_mps = 0.2}}, 3.0);
  EXPECT_GT(world.state(box).pose.yaw, 0.1);  // its lower half is pushed on: counter-clockwise
}

TEST(Contact, OnAWetPatchARobotNeedsMoreRoomToStop) {
  RoomSpec room;
  const double factor = 0.02;
  room.floor.friction_zones = {{{-3.0, -3.0}, {3.0, 3.0}, 1.0}, {{0.0, -1.0}, {2.0, 1.0}, factor}};
  const double v = 0.26;
  const auto way = [&](double start) {
    World world(room, {waffle_at(start, 0.0, 0.0)});
    while (world.state(0).pose.x < start + 0.52) world.step({{.v_mps = v}});
    const double from = world.state(0).pose.x;
    run(world, {{}}, 5.0);
    EXPECT_NEAR(world.state(0).velocity.x, 0.0, 1e-6);
    return world.state(0).pose.x - from;
  };
  const RobotModel& model = robot_model(RobotModelName::waffle_pi);
  const double deceleration = factor * model.rolling_friction * model.wheel_load * kGravity;
  EXPECT_NEAR(way(-0.5), v * v / (2.0 * deceleration), 0.004);
  // Elsewhere the motors' own limit counts.
  EXPECT_NEAR(way(-1.5), v * v / (2.0 * model.max_acceleration_mps2), 0.001);
}

TEST(Contact, AZoneUnderOneWheelTurnsTheRobotThatBrakes) {
  RoomSpec room;
  room.floor.friction_zones = {{{-3.0, 0.0}, {3.0, 3.0}, 0.0}};  // under the left wheel
  World world(room, {waffle_at(0.0, 0.0, 0.0)});
  world.push(0, {0.4, 0.0});
  run(world, {{}}, 0.2);
  EXPECT_LT(world.state(0).pose.yaw, -0.01);  // held at its right
}

TEST(Contact, TwoRobotsThatMeetHeadOnStop) {
  World world(RoomSpec{}, {waffle_at(-0.5, 0.0, 0.0), waffle_at(0.5, 0.0, 180.0)});
  run(world, {{.v_mps = 0.2}, {.v_mps = 0.2}}, 4.0);
  const double x = world.state(0).pose.x;
  EXPECT_EQ(world.touches(), (std::vector<Touch>{{0, 1}}));
  EXPECT_NEAR(x, -0.084, 0.006);  // camera against camera
  run(world, {{.v_mps = 0.2}, {.v_mps = 0.2}}, 3.0);
  EXPECT_NEAR(world.state(0).pose.x, x, 0.001);
  EXPECT_NEAR(world.state(0).velocity.x, 0.0, 0.01);
}

TEST(Contact, ARobotStandsAgainstAWeakerOneAndGivesWayToAStrongerOne) {
  ASSERT_LT(traction(RobotModelName::burger), traction(RobotModelName::waffle_pi));
  const auto moved = [](RobotModelName stands, RobotModelName pushes) {
    World world(RoomSpec{}, {robot_at(stands, 0.0, 0.0, 180.0), robot_at(pushes, -0.5, 0.0, 0.0)});
    run(world, {{}, {.v_mps = 0.2}}, 6.0);
    EXPECT_TRUE(world.in_contact(0));
    return world.state(0).pose.x;
  };
  EXPECT_LT(moved(RobotModelName::waffle_pi, RobotModelName::burger), 0.002);
  EXPECT_GT(moved(RobotModelName::burger, RobotModelName::waffle_pi), 0.3);
}

TEST(Contact, AFixedThingStandsLikeAWall) {
  ObjectSpec post;
  post.id = "post";
  post.shape = BodyShape::cylinder;
  post.size_m = {0.2, 0.2, 1.0};
  World world(RoomSpec{}, {waffle_at(-0.6, 0.0, 0.0)});
  const std::size_t thing = world.add_thing(post);
  run(world, {{.v_mps = 0.2}}, 5.0);
  EXPECT_NEAR(world.state(0).pose.x, -0.1 - 0.084, 0.004);
  EXPECT_EQ(world.touches(), (std::vector<Touch>{{0, thing}}));
}

TEST(Contact, WhatHangsAboveTheTallestRobotBumpsIntoNothing) {
  const auto gets_to = [](double bottom_m) {
    ObjectSpec beam;
    beam.id = "beam";
    beam.size_m = {0.1, 3.0, 0.1};
    beam.bottom_m = bottom_m;
    World world(RoomSpec{}, {waffle_at(-0.6, 0.0, 0.0)});
    world.add_thing(beam);
    run(world, {{.v_mps = 0.2}}, 5.0);
    return world.state(0).pose.x;
  };
  EXPECT_GT(gets_to(0.15), 0.3);  // the lidar's top is at 0.1405 m
  EXPECT_LT(gets_to(0.12), -0.1);
}

TEST(Contact, AHolonomicRobotGoesSidewaysAtTheSpeedItIsTold) {
  World world(RoomSpec{}, {robot_at(RobotModelName::holonomic, 0.0, -1.0, 0.0)});
  run(world, {{.side_mps = 0.5}}, 1.0);
  const Pose2 from = world.state(0).pose;
  run(world, {{.side_mps = 0.5}}, 2.0);
  EXPECT_NEAR(world.state(0).pose.y - from.y, 1.0, 1e-4);
  EXPECT_NEAR(world.state(0).pose.x, from.x, 1e-5);
  EXPECT_NEAR(world.state(0).pose.yaw, 0.0, 1e-6);
  // Each wheel stands at 45 degrees to the way.
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(std::abs(world.wheel_speeds(0)[i]), 0.5 / std::numbers::sqrt2, 1e-9);
}

TEST(Contact, AHolonomicRobotTurnsAsItGoesStraight) {
  World world(RoomSpec{}, {robot_at(RobotModelName::holonomic, -1.0, 0.0, 0.0)});
  const double w = 2.0;
  for (int i = 0; i < 1000; ++i) {  // towards map x, whichever way it faces
    const double yaw = world.state(0).pose.yaw + 0.5 * w * kDt;
    world.step({{0.4 * std::cos(yaw), -0.4 * std::sin(yaw), w}});
  }
  EXPECT_NEAR(world.state(0).pose.y, 0.0, 0.01);
  EXPECT_NEAR(world.state(0).pose.x, -1.0 + 0.4 * 2.0, 0.04);
  EXPECT_NEAR(world.state(0).velocity.yaw_rate, w, 1e-3);
}

TEST(Contact, OmniWheelsTogetherPushWithFrictionTimesLoadOverRootTwo) {
  // Straight ahead each of the four stands at 45 degrees to the way: mu m g / 4 each, times cos 45.
  const double factor = 0.05;
  const RobotModel& model = robot_model(RobotModelName::holonomic);
  const double most = factor * model.rolling_friction * kGravity / std::numbers::sqrt2;
  World world(room_with_friction(factor), {robot_at(RobotModelName::holonomic, 0.0, 0.0, 0.0)});
  run(world, {{.side_mps = 1.0}}, 1.0);
  EXPECT_NEAR(world.state(0).velocity.y, most, 0.002 * most);
}

TEST(Contact, WhatIsTakenAwayIsInNobodysWayAndComesBackAtRest) {
  World world(RoomSpec{}, {waffle_at(-1.0, 0.0, 0.0), waffle_at(0.0, 0.0, 0.0)});
  run(world, {{.v_mps = 0.2}, {.v_mps = 0.1}}, 0.5);
  world.take_away(1);
  run(world, {{.v_mps = 0.2}, {.v_mps = 0.1}}, 5.0);
  EXPECT_GT(world.state(0).pose.x, 0.05);
  EXPECT_FALSE(world.in_contact(0));
  EXPECT_FALSE(world.state(1).present);
  EXPECT_EQ(world.wheel_speeds(1), Eigen::Vector4d(0.0, 0.0, 0.0, 0.0));
  world.put_down(1, {2.0, 1.0, 0.5});
  world.step({{}, {}});
  EXPECT_TRUE(world.state(1).present);
  EXPECT_TRUE(world.state(1).placed);
  EXPECT_NEAR(world.state(1).pose.x, 2.0, 1e-6);
  EXPECT_NEAR(world.state(1).pose.y, 1.0, 1e-6);
  EXPECT_NEAR(world.state(1).pose.yaw, 0.5, 1e-6);
  EXPECT_NEAR(world.state(1).velocity.x, 0.0, 1e-9);
  world.step({{}, {}});
  EXPECT_FALSE(world.state(1).placed);
}

TEST(Contact, TyresWithLessGripGiveLess) {
  World world(RoomSpec{}, {waffle_at(0.0, 0.0, 0.0)});
  world.set_grip(0, 0.05);
  run(world, {{.v_mps = 0.26}}, 0.3);
  const double most = 0.05 * traction(RobotModelName::waffle_pi) / 1.8;
  EXPECT_NEAR(world.state(0).velocity.x, 0.3 * most, 0.01 * most);
}

TEST(World, TheWayIsTheWheelsWayToAMicrometre) {
  // Box2D adds in floats, whose rounding is a thousandth of a slow motion's steps: the sums must not show it.
  World world(RoomSpec{}, {waffle_at(-2.6, 1.3, 0.0)});
  run(world, {{.v_mps = 0.037}}, 1.0);
  const double from = world.state(0).pose.x;
  run(world, {{.v_mps = 0.037}}, 60.0);
  EXPECT_NEAR(world.state(0).pose.x - from, 0.037 * 60.0, 5e-6);
  run(world, {{.w_radps = 0.1}}, 1.0);
  const double yaw = world.state(0).pose.yaw;
  run(world, {{.w_radps = 0.1}}, 50.0);
  EXPECT_NEAR(wrap_angle(world.state(0).pose.yaw - yaw - 5.0), 0.0, 5e-6);
}

}  // namespace
}  // namespace skylight::sim
