// Random wandering: what its numbers promise, over minutes.
#include "sim/world/wander.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <gtest/gtest.h>

#include "sim/world/stage.hpp"
#include "sim/world/surroundings.hpp"

namespace skylight::sim {
namespace {

Scenario wandering(const WanderStep& step, const std::vector<StartSpec>& starts, double size_m = 4.0) {
  Scenario scenario;
  scenario.seed = 5;
  scenario.room.size_m = {size_m, size_m};
  for (const StartSpec& start : starts) {
    RobotSpec robot;
    robot.id = std::to_string(scenario.robots.size());
    robot.id.insert(0, 1, 'r');
    robot.start = start;
    robot.program = {{step}};
    scenario.robots.push_back(robot);
  }
  return scenario;
}

void advance(Stage& stage, double seconds) {
  for (const Duration until = stage.time() + from_seconds(seconds); stage.time() < until;) stage.advance();
  stage.forget_before(stage.time());
}

Pose2 pose(const Stage& stage, std::size_t actor) {
  return stage.timeline().at(actor, stage.time()).pose;
}

TEST(Wander, WithNothingToAvoidItChangesAsOftenAndStopsAsMuchAsAsked) {
  const WanderStep step{.changes_per_min = 30.0, .stops = 0.2, .avoid_m = 0.0};
  const double minutes = 200.0;
  Wanderer wanderer(step, DriveLimits{}, 11, 0.0);
  Command last{-1.0};
  int changes = 0;
  int stops = 0;
  int short_waits = 0;
  double since = 0.0;
  for (int i = 0; i < static_cast<int>(minutes * 6000); ++i) {
    const double t = 0.01 * i;
    // A pose that always gets on, so that it never takes itself for stuck.
    const Command command = wanderer.next({.time_s = t, .pose = {t, 0.0, 0.0}});
    EXPECT_LE(command.v_mps, step.speed_mps);
    EXPECT_LE(std::abs(command.w_radps), step.rate_degps * 3.14160 / 180.0);
    if (command == last) continue;
    ++changes;
    if (command.v_mps == 0.0) ++stops;
    if (t - since < 1.0) ++short_waits;
    since = t;
    last = command;
  }
  // From stop to stop nothing changes to be seen: a share of 0.2 * 0.2. Counts of a Poisson process.
  const double expected = 30.0 * minutes * (1.0 - 0.2 * 0.2);
  EXPECT_NEAR(changes, expected, 4.0 * std::sqrt(expected));
  EXPECT_NEAR(1.0 * stops / changes, 0.2 * 0.8 / (1.0 - 0.04), 0.02);
  // Exponential waits: so many are shorter than half their mean of 2 s.
  EXPECT_NEAR(1.0 * short_waits / changes, 1.0 - std::exp(-0.5), 0.04);
}

TEST(Wander, KeepsClearOfWallsAndThingsForMinutesAndGetsAboutTheRoom) {
  const double avoid = 0.25;
  Scenario scenario = wandering({.avoid_m = avoid}, {{-1.0, -1.0, 0.0}});
  ObjectSpec post;
  post.id = "post";
  scenario.objects = {post};
  Stage stage(scenario);
  const Outline outline = robot_outline(robot_model(RobotModelName::waffle_pi));
  const Outline thing = sim::outline(post);
  std::map<std::pair<int, int>, int> visited;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 2400; ++i) {  // four minutes
    advance(stage, 0.1);
    for (const Eigen::Vector2d& corner : placed(outline, pose(stage, 0))) {
      nearest = std::min({nearest, 2.0 - std::abs(corner.x()), 2.0 - std::abs(corner.y())});
      nearest = std::min(nearest, distance(thing, corner));
    }
    ++visited[{static_cast<int>(std::floor(pose(stage, 0).x)),
               static_cast<int>(std::floor(pose(stage, 0).y))}];
  }
  EXPECT_GE(nearest, avoid - 0.01);
  EXPECT_GE(visited.size(), 10U);  // of 16 squares
}

TEST(Wander, RobotsKeepClearOfEachOtherWhereThereIsRoom) {
  Stage stage(wandering({.avoid_m = 0.15}, {{-1, -1, 0}, {1, -1, 90}, {-1, 1, 180}, {1, 1, 270}}));
  for (int i = 0; i < 900; ++i) {
    advance(stage, 0.1);
    for (std::size_t robot = 0; robot < 4; ++robot)
      ASSERT_TRUE(stage.touches(robot, stage.time()).empty()) << to_seconds(stage.time());
  }
}

TEST(Wander, NothingHoldsItForGood) {
  // Blind, it runs into the walls and frees itself again; in a crowd it goes on as well.
  std::vector<StartSpec> crowd;
  for (int i = 0; i < 6; ++i) crowd.push_back({-0.6 + 0.6 * (i % 3), -0.4 + 0.8 * (i / 3), 40.0 * i});
  for (const Scenario& scenario :
       {wandering({.avoid_m = 0.0}, {{0.5, 0.5, 10.0}}, 2.0), wandering({.avoid_m = 0.25}, crowd, 2.0)}) {
    Stage stage(scenario);
    std::vector<Pose2> last(scenario.robots.size());
    std::vector<int> still(scenario.robots.size());
    for (int i = 0; i < 30; ++i) {
      advance(stage, 3.0);
      for (std::size_t robot = 0; robot < last.size(); ++robot) {
        const Pose2 now = pose(stage, robot);
        const bool moved = (now.position() - last[robot].position()).norm() > 0.02 ||
                           std::abs(wrap_angle(now.yaw - last[robot].yaw)) > 0.1;
        still[robot] = moved ? 0 : still[robot] + 1;
        EXPECT_LT(still[robot], 8) << robot << " after " << 3 * i << " s";
        last[robot] = now;
      }
    }
  }
}

TEST(Wander, TheSameSeedIsTheSameToTheBitAndAnotherIsNot) {
  const auto end = [](std::uint64_t scenario_seed, std::uint64_t seed) {
    Scenario scenario = wandering({.seed = seed}, {{-1, -1, 0}, {1, 1, 90}});
    scenario.seed = scenario_seed;
    Stage stage(scenario);
    advance(stage, 8.0);
    return std::pair(pose(stage, 0), pose(stage, 1));
  };
  EXPECT_EQ(end(5, 0), end(5, 0));
  EXPECT_NE(end(5, 0), end(6, 0));
  EXPECT_NE(end(5, 1), end(5, 2));
  EXPECT_EQ(end(5, 1), end(6, 1));  // its own seed alone counts
}

TEST(Wander, EndsAfterItsTime) {
  Scenario scenario = wandering({.for_s = 4.0}, {{}});
  scenario.robots[0].program.push_back({StopStep{1.0}});
  Stage stage(scenario);
  advance(stage, 4.98);
  EXPECT_FALSE(stage.program_done(0));
  advance(stage, 0.1);
  EXPECT_TRUE(stage.program_done(0));
}

}  // namespace
}  // namespace skylight::sim
