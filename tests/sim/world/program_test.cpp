// Motion programs, driven through the world as the simulator does it.
#include "sim/world/program.hpp"

#include <cmath>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/scenario/scenario_file.hpp"
#include "sim/world/world.hpp"

namespace skylight::sim {
namespace {

/// A robot under a program, stepped like the simulator steps it: a command every 10 ms.
struct Drive {
  Drive(const StartSpec& start, std::vector<ProgramStep> steps, const RoomSpec& room = {})
      : world(room, {RobotSpec{.id = "a", .start = start}}), program(std::move(steps), DriveLimits{}) {}
  void run(double seconds) {
    for (const double until = time + seconds; time < until - 1e-9;) {
      const Command command = program.command({.time_s = time, .pose = pose()});
      for (int i = 0; i < 5; ++i) world.step({command});
      time += 0.01;
    }
  }
  Pose2 pose() const { return world.state(0).pose; }

  World world;
  Program program;
  double time = 0.0;
};

TEST(Program, ALineEndsAfterItsDistanceInItsDirection) {
  Drive drive({-1.0, 0.5, -40.0}, {{LineStep{.distance_m = 2.0, .speed_mps = 0.22}}});
  drive.run(12.0);
  const double yaw = -40.0 * std::numbers::pi / 180.0;
  EXPECT_TRUE(drive.program.finished());
  EXPECT_NEAR(drive.pose().x, -1.0 + 2.0 * std::cos(yaw), 0.004);
  EXPECT_NEAR(drive.pose().y, 0.5 + 2.0 * std::sin(yaw), 0.004);
  EXPECT_NEAR(drive.pose().yaw, yaw, 0.002);
}

TEST(Program, AFullArcLeadsBackToItsStartOnItsCircle) {
  Drive drive({1.25, 0.0, 90.0}, {{ArcStep{1.25, 360.0, 0.22}}});
  for (int i = 0; i < 38; ++i) {
    drive.run(1.0);
    EXPECT_NEAR(drive.pose().position().norm(), 1.25, 0.003);
  }
  EXPECT_TRUE(drive.program.finished());
  EXPECT_NEAR(drive.pose().x, 1.25, 0.006);
  EXPECT_NEAR(drive.pose().y, 0.0, 0.006);
}

TEST(Program, AnArcToTheRightTurnsRight) {
  Drive drive({0.0, 0.0, 0.0}, {{ArcStep{0.5, -90.0, 0.2}}});
  drive.run(6.0);
  EXPECT_NEAR(drive.pose().x, 0.5, 0.006);
  EXPECT_NEAR(drive.pose().y, -0.5, 0.006);
  EXPECT_NEAR(drive.pose().yaw, -0.5 * std::numbers::pi, 0.01);
}

TEST(Program, ATurnEndsAtItsAngleOnTheSpot) {
  Drive drive({0.3, -0.2, 10.0}, {{TurnStep{-270.0, 60.0}}});
  drive.run(8.0);
  EXPECT_NEAR(drive.pose().yaw, wrap_angle((10.0 - 270.0) * std::numbers::pi / 180.0), 0.01);
  EXPECT_NEAR(drive.pose().x, 0.3, 0.002);
  EXPECT_NEAR(drive.pose().y, -0.2, 0.002);
}

TEST(Program, WaypointsAreVisitedInTheirOrder) {
  const std::vector<std::array<double, 2>> points{{1.0, 0.0}, {1.0, 1.0}, {-0.5, 1.0}, {-0.5, -1.0}};
  Drive drive({0.0, 0.0, 0.0}, {{WaypointsStep{points, 0.22, false}}});
  std::size_t visited = 0;
  for (int i = 0; i < 600 && visited < points.size(); ++i) {
    drive.run(0.1);
    if ((drive.pose().position() - Eigen::Vector2d(points[visited][0], points[visited][1])).norm() < 0.15)
      ++visited;
  }
  EXPECT_EQ(visited, points.size());
  drive.run(3.0);
  EXPECT_TRUE(drive.program.finished());
  EXPECT_NEAR(drive.pose().x, -0.5, 0.01);
  EXPECT_NEAR(drive.pose().y, -1.0, 0.01);
}

TEST(Program, ALoopOfWaypointsNeverEnds) {
  Drive drive({0.0, 0.0, 0.0},
              {{WaypointsStep{{{1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}, {0.0, 0.0}}, 0.25, true}}});
  double last_lap = 0.0;
  for (int lap = 0; lap < 4; ++lap) {
    for (int i = 0; i < 400; ++i) {
      drive.run(0.1);
      if (drive.time - last_lap > 8.0 && (drive.pose().position() - Eigen::Vector2d(1.0, 0.0)).norm() < 0.15)
        break;
    }
    EXPECT_LT(drive.time - last_lap, 25.0);
    last_lap = drive.time;
  }
  EXPECT_FALSE(drive.program.finished());
}

TEST(Program, WaypointsThatLieOnOneAnotherLeaveTheRobotStanding) {
  Program program({{WaypointsStep{{{0.0, 0.0}, {0.0, 0.0}}, 0.2, true}}}, DriveLimits{});
  EXPECT_EQ(program.command({.time_s = 0.0}), Command{});
}

TEST(Program, DriveAndStopLastAsLongAsTheySay) {
  Program program({{DriveStep{.v_mps = 0.1, .w_degps = 45.0, .for_s = 0.5}},
                   {StopStep{0.25}},
                   {DriveStep{.v_mps = -0.2, .w_degps = 0.0, .for_s = 1.0}}},
                  DriveLimits{});
  for (int i = 0; i < 200; ++i) {
    const double t = 0.01 * i;
    const Command command = program.command({.time_s = t});
    const double expected = t < 0.495 ? 0.1 : (t < 0.745 ? 0.0 : (t < 1.745 ? -0.2 : 0.0));
    EXPECT_EQ(command.v_mps, expected) << t;
  }
  EXPECT_TRUE(program.finished());
}

TEST(Program, RepeatsGoThroughTheirStepsAsOftenAsTheySayAlsoWithinEachOther) {
  const RepeatStep inner{2, {{StopStep{1.0}}}};
  Program program(
      {{RepeatStep{3, {{RepeatStep{inner}}, {DriveStep{.v_mps = 0.1, .w_degps = 0.0, .for_s = 1.0}}}}}},
      DriveLimits{});
  std::string seen;
  for (int second = 0; second < 12; ++second)
    seen += program.command({.time_s = 1.0 * second}).v_mps > 0.0 ? 'd' : 's';
  EXPECT_EQ(seen, "ssdssdssdsss");  // three rounds of two stops and a drive, then standing
  EXPECT_TRUE(program.finished());
}

TEST(Program, AnEndlessRepeatOfStepsThatAreOverAtOnceDoesNotHang) {
  Program program({{RepeatStep{0, {{LineStep{.distance_m = 0.001, .speed_mps = 0.2}}}}}}, DriveLimits{});
  EXPECT_EQ(program.command({.time_s = 0.0}), Command{});
}

TEST(Program, CommandsAreCutToTheRobotsLimitsAlongTheSameCurve) {
  Program program({{DriveStep{.v_mps = 0.52, .w_degps = 60.0, .for_s = 1.0}}}, DriveLimits{});
  const Command command = program.command({.time_s = 0.0});
  EXPECT_NEAR(command.v_mps, 0.26, 1e-12);
  EXPECT_NEAR(command.w_radps, 0.5 * std::numbers::pi / 3.0, 1e-12);
}

TEST(Program, TheDemoGoesOnWithoutAnyoneTouchingAnything) {
  const Scenario demo = load_scenario(std::filesystem::path(SKYLIGHT_SOURCE_DIR) / "sim/scenarios/demo.json");
  World world(demo.room, demo.robots);
  std::vector<Program> programs;
  for (const RobotSpec& robot : demo.robots) programs.emplace_back(robot.program, DriveLimits{});
  std::vector<Command> commands(programs.size());
  std::vector<Eigen::Vector2d> before;
  for (std::size_t i = 0; i < programs.size(); ++i) before.push_back(world.state(i).pose.position());
  for (int step = 0; step < 1200 * 500; ++step) {
    for (std::size_t i = 0; step % 5 == 0 && i < programs.size(); ++i) {
      commands[i] = programs[i].command({.time_s = 0.002 * step, .pose = world.state(i).pose});
      ASSERT_FALSE(world.in_contact(i)) << demo.robots[i].id << " after " << 0.002 * step << " s";
    }
    world.step(commands);
    if (step % 2500 != 0) continue;  // every 5 s: nobody stands still for long
    for (std::size_t i = 0; i < programs.size() && step > 0; ++i) {
      const Eigen::Vector2d now = world.state(i).pose.position();
      EXPECT_GT((now - before[i]).norm(), 0.02) << demo.robots[i].id << " after " << 0.002 * step << " s";
      before[i] = now;
    }
  }
}

}  // namespace
}  // namespace skylight::sim
