// The steps of motion programs beyond lines, arcs and waypoints, driven through the world.
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "sim/world/program.hpp"
#include "sim/world/world.hpp"

namespace skylight::sim {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

/// A robot under a program, stepped like the stage steps it: a command every 10 ms.
struct Drive {
  Drive(RobotModelName name, const StartSpec& start, std::vector<ProgramStep> steps)
      : world(RoomSpec{}, {RobotSpec{.id = "a", .model = name, .start = start}}),
        program(std::move(steps), limits(robot_model(name))) {}
  static DriveLimits limits(const RobotModel& model) {
    return {model.max_speed_mps, model.max_side_speed_mps, model.max_yaw_rate_radps,
            model.max_yaw_acceleration_radps2};
  }
  void run(double seconds) {
    for (const double until = time + seconds; time < until - 1e-9;) {
      const Command command = program.command({.time_s = time, .pose = pose(), .fired = &fired});
      for (int i = 0; i < 5; ++i) world.step({command});
      time += 0.01;
    }
  }
  Pose2 pose() const { return world.state(0).pose; }

  World world;
  Program program;
  std::set<std::string> fired;
  double time = 0.0;
};

TEST(ProgramSteps, ALineToAPlaceTurnsTowardsItAndEndsThere) {
  Drive drive(RobotModelName::waffle_pi, {1.0, 1.0, 90.0}, {{LineStep{.to_m = {{-0.5, -1.0}}}}});
  drive.run(3.0);
  EXPECT_NEAR(drive.pose().x, 1.0, 0.15);  // it has turned first: three quarters of that time
  drive.run(20.0);
  EXPECT_TRUE(drive.program.finished());
  EXPECT_NEAR(drive.pose().x, -0.5, 0.004);
  EXPECT_NEAR(drive.pose().y, -1.0, 0.004);
  EXPECT_NEAR(drive.pose().yaw, std::atan2(-2.0, -1.5), 0.01);
}

TEST(ProgramSteps, ALineToWhereItStandsIsOverAtOnce) {
  Program program({{LineStep{.to_m = {{0.0, 0.0}}}}}, DriveLimits{});
  EXPECT_EQ(program.command({}), Command{});
  EXPECT_TRUE(program.finished());
}

TEST(ProgramSteps, ACircleGoesRoundAsOftenAsItSays) {
  Drive drive(RobotModelName::waffle_pi, {0.0, 0.5, 0.0},
              {{CircleStep{.radius_m = 0.5, .rounds = 2.5, .speed_mps = 0.2, .right = true}}});
  for (int i = 0; i < 39; ++i) {  // 2.5 rounds of pi m at 0.2 m/s: 39.3 s
    drive.run(1.0);
    EXPECT_NEAR(drive.pose().position().norm(), 0.5, 0.004);
    EXPECT_FALSE(drive.program.finished());
  }
  drive.run(3.0);
  EXPECT_TRUE(drive.program.finished());
  EXPECT_NEAR(drive.pose().x, 0.0, 0.006);
  EXPECT_NEAR(drive.pose().y, -0.5, 0.006);
}

TEST(ProgramSteps, AFigureEightReturnsToItsStartOverBothItsCircles) {
  const double r = 0.4;
  Drive drive(RobotModelName::waffle_pi, {0.3, -0.2, 0.0},
              {{FigureEightStep{.radius_m = r, .rounds = 3, .speed_mps = 0.2}}});
  double highest = -9.0;
  double lowest = 9.0;
  while (!drive.program.finished() && drive.time < 120.0) {
    drive.run(0.1);
    highest = std::max(highest, drive.pose().y);
    lowest = std::min(lowest, drive.pose().y);
    const double left = (drive.pose().position() - Eigen::Vector2d(0.3, -0.2 + r)).norm();
    const double right = (drive.pose().position() - Eigen::Vector2d(0.3, -0.2 - r)).norm();
    EXPECT_LT(std::min(std::abs(left - r), std::abs(right - r)), 0.03);  // its wheels turn over gradually
  }
  EXPECT_NEAR(drive.time, 3 * 4.0 * std::numbers::pi * r / 0.2, 2.0);
  EXPECT_NEAR(drive.pose().x, 0.3, 0.01);
  EXPECT_NEAR(drive.pose().y, -0.2, 0.01);
  EXPECT_NEAR(drive.pose().yaw, 0.0, 0.03);
  EXPECT_NEAR(highest, -0.2 + 2.0 * r, 0.02);
  EXPECT_NEAR(lowest, -0.2 - 2.0 * r, 0.02);
}

TEST(ProgramSteps, AnEndlessFigureEightStaysWhereItIs) {
  const double r = 0.3;
  Drive drive(RobotModelName::waffle_pi, {0.0, 0.0, 30.0},
              {{FigureEightStep{.radius_m = r, .rounds = 0, .speed_mps = 0.25}}});
  drive.run(600.0);
  EXPECT_FALSE(drive.program.finished());
  for (int i = 0; i < 200; ++i) {
    drive.run(0.1);
    const Eigen::Vector2d left = r * Eigen::Vector2d(-std::sin(30 * kRadians), std::cos(30 * kRadians));
    const double off = std::min(std::abs((drive.pose().position() - left).norm() - r),
                                std::abs((drive.pose().position() + left).norm() - r));
    EXPECT_LT(off, 0.03);
  }
}

TEST(ProgramSteps, AWaitEndsWithItsEvent) {
  Drive drive(RobotModelName::waffle_pi, {},
              {{WaitStep{.event = "go"}}, {DriveStep{.v_mps = 0.1, .for_s = 1.0}}});
  drive.run(30.0);
  EXPECT_EQ(drive.pose(), Pose2{});
  drive.fired.insert("stop");
  drive.run(1.0);
  EXPECT_EQ(drive.pose(), Pose2{});
  drive.fired.insert("go");
  drive.run(2.0);
  EXPECT_NEAR(drive.pose().x, 0.1, 0.005);
  EXPECT_TRUE(drive.program.finished());
}

TEST(ProgramSteps, AWaitEndsAfterItsTimeWhereTheEventDoesNotCome) {
  Program program({{WaitStep{.event = "never", .at_most_s = 2.5}}, {DriveStep{.v_mps = 0.1, .for_s = 1.0}}},
                  DriveLimits{});
  for (int i = 0; i < 400; ++i) {
    const double t = 0.01 * i;
    EXPECT_EQ(program.command({.time_s = t}).v_mps, t > 2.495 && t < 3.495 ? 0.1 : 0.0) << t;
  }
}

TEST(ProgramSteps, ParallelStepsAddTheirSpeedsAndAreOverWhenAllAre) {
  Program program({{ParallelStep{{{DriveStep{.v_mps = 0.1, .for_s = 1.0}},
                                  {DriveStep{.v_mps = 0.05, .w_degps = 45.0, .for_s = 2.0}}}}},
                   {DriveStep{.v_mps = -0.1, .for_s = 1.0}}},
                  DriveLimits{});
  for (int i = 0; i < 400; ++i) {
    const double t = 0.01 * i;
    const Command command = program.command({.time_s = t});
    const double v = t < 0.995 ? 0.15 : (t < 1.995 ? 0.05 : (t < 2.995 ? -0.1 : 0.0));
    EXPECT_NEAR(command.v_mps, v, 1e-12) << t;
    EXPECT_NEAR(command.w_radps, t < 1.995 ? 45.0 * kRadians : 0.0, 1e-12) << t;
  }
  EXPECT_TRUE(program.finished());
}

TEST(ProgramSteps, AHolonomicRobotTurnsWhileItGoesAlongALine) {
  Drive drive(RobotModelName::holonomic, {-1.0, 0.2, 0.0},
              {{ParallelStep{{{LineStep{.distance_m = 2.0, .speed_mps = 0.4}},
                              {TurnStep{.angle_deg = 270.0, .rate_degps = 60.0}}}}}});
  while (!drive.program.finished() && drive.time < 20.0) {
    drive.run(0.05);
    EXPECT_NEAR(drive.pose().y, 0.2, 0.02);
  }
  EXPECT_NEAR(drive.pose().x, 1.0, 0.01);
  EXPECT_NEAR(drive.pose().yaw, -90.0 * kRadians, 0.02);
  EXPECT_LT(drive.time, 8.0);
}

TEST(ProgramSteps, DriveAndTurnTogetherDriveAnArcOnAnyRobot) {
  Drive drive(RobotModelName::differential, {0.0, 0.0, 0.0},
              {{ParallelStep{
                  {{DriveStep{.v_mps = 0.3, .for_s = 3.0}}, {DriveStep{.w_degps = 30.0, .for_s = 3.0}}}}}});
  drive.run(5.0);
  const double r = 0.3 / (30.0 * kRadians);
  EXPECT_NEAR(drive.pose().x, r, 0.05);  // its motors take a moment to get there and back
  EXPECT_NEAR(drive.pose().y, r, 0.05);
  EXPECT_NEAR(drive.pose().yaw, 90.0 * kRadians, 0.03);
}

TEST(ProgramSteps, ADriveToTheSideIsForHolonomicRobotsOnly) {
  const std::vector<ProgramStep> steps{{DriveStep{.v_mps = 0.1, .side_mps = 0.3, .for_s = 1.0}}};
  EXPECT_EQ(Program(steps, DriveLimits{.max_speed_mps = 2.0, .max_side_mps = 2.0, .max_yaw_rate_radps = 6.0})
                .command({}),
            (Command{0.1, 0.3, 0.0}));
  EXPECT_EQ(Program(steps, DriveLimits{}).command({}), (Command{0.1, 0.0, 0.0}));
}

TEST(ProgramSteps, NamedProgramsAreRunWhereTheyAreCalled) {
  const NamedPrograms named{
      {"hop", {{DriveStep{.v_mps = 0.1, .for_s = 1.0}}}},
      {"hops", {{RepeatStep{2, {{RunStep{"hop"}}, {StopStep{1.0}}}}}}},
      {"both", {{ParallelStep{{{RunStep{"hops"}}, {DriveStep{.w_degps = 10.0, .for_s = 1.0}}}}}}}};
  Program program(with_runs_inlined({{StopStep{1.0}}, {RunStep{"hops"}}, {RunStep{"both"}}}, named),
                  DriveLimits{});
  std::string seen;
  for (int second = 0; second < 11; ++second) {
    const Command command = program.command({.time_s = 1.0 * second});
    seen += command.v_mps > 0.0 ? (command.w_radps > 0.0 ? 'D' : 'd') : 's';
  }
  EXPECT_EQ(seen, "sdsdsDsdsss");
  EXPECT_TRUE(program.finished());
}

TEST(ProgramSteps, ARobotThatWasPutElsewhereGoesOnToWhereItWasGoing) {
  Drive drive(RobotModelName::waffle_pi, {-2.0, 0.0, 0.0},
              {{WaypointsStep{{{1.0, 0.0}, {1.0, 1.5}}, 0.25, false}}});
  drive.run(4.0);
  drive.world.put_down(0, {2.0, 1.2, -1.0});
  drive.program.moved_to({2.0, 1.2, -1.0});
  double nearest = 9.0;
  while (!drive.program.finished() && drive.time < 60.0) {
    drive.run(0.1);
    nearest = std::min(nearest, (drive.pose().position() - Eigen::Vector2d(1.0, 0.0)).norm());
  }
  EXPECT_LT(nearest, 0.2);
  EXPECT_NEAR(drive.pose().x, 1.0, 0.02);
  EXPECT_NEAR(drive.pose().y, 1.5, 0.02);
}

TEST(ProgramSteps, ARobotFarFromItsLineComesBackToIt) {
  Drive drive(RobotModelName::waffle_pi, {-2.5, 0.0, 0.0},
              {{LineStep{.distance_m = 4.5, .speed_mps = 0.25}}});
  drive.run(1.0);
  drive.world.put_down(0, {-2.2, 1.5, 2.0});
  drive.run(60.0);
  EXPECT_TRUE(drive.program.finished());
  EXPECT_NEAR(drive.pose().x, 2.0, 0.01);
  EXPECT_NEAR(drive.pose().y, 0.0, 0.03);
}

}  // namespace
}  // namespace skylight::sim
