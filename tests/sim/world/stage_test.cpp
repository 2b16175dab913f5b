// The stage: events, what they do to robots, people and things, and what is told of it.
#include "sim/world/stage.hpp"

#include <cmath>
#include <functional>
#include <stdexcept>

#include <gtest/gtest.h>

namespace skylight::sim {
namespace {

using std::chrono::milliseconds;

RobotSpec robot_at(const std::string& id, double x, double y, double yaw_deg,
                   std::vector<ProgramStep> program = {}) {
  RobotSpec robot;
  robot.id = id;
  robot.start = {x, y, yaw_deg};
  robot.program = std::move(program);
  return robot;
}

EventSpec at(double time_s, const std::string& name, Action action = SignalAction{}) {
  EventSpec event;
  event.name = name;
  event.at_s = time_s;
  event.action = std::move(action);
  return event;
}

EventSpec when(Condition condition, const std::string& name, Action action = SignalAction{}) {
  EventSpec event;
  event.name = name;
  event.when = std::move(condition);
  event.action = std::move(action);
  return event;
}

ObjectSpec box(const std::string& id, double x, double y) {
  ObjectSpec thing;
  thing.id = id;
  thing.x_m = x;
  thing.y_m = y;
  return thing;
}

void advance(Stage& stage, double seconds) {
  for (const Duration until = stage.time() + from_seconds(seconds); stage.time() < until;) stage.advance();
}

BodyState state(const Stage& stage, std::size_t actor) {
  return stage.timeline().at(actor, stage.time());
}

/// "name@milliseconds" of what has happened.
std::vector<std::string> told(Stage& stage, const Scenario& scenario) {
  std::vector<std::string> result;
  for (const Happening& one : stage.take_happenings()) {
    const Duration since = one.at - Time{from_seconds(scenario.start_unix_s)};
    result.push_back(one.name + "@" + std::to_string(since / milliseconds(1)));
  }
  return result;
}

using Names = std::vector<std::string>;

TEST(Stage, EventsHappenInTheirOrderAtTheirStep) {
  Scenario scenario;
  EventSpec again = at(0.1, "again");
  again.every_s = 0.05;
  scenario.events = {when({AfterEvent{"c"}}, "d"), when({AfterEvent{"b", 0.02}}, "c"), at(0.0301, "b"),
                     at(0.004, "a"), again};
  Stage stage(scenario);
  advance(stage, 0.25);
  // A step is 2 ms; d follows c in the same step.
  EXPECT_EQ(told(stage, scenario),
            (Names{"a@4", "b@32", "c@52", "d@52", "again@100", "again@150", "again@200"}));
  advance(stage, 0.002);
  EXPECT_EQ(told(stage, scenario), (Names{"again@250"}));
}

TEST(Stage, ConditionsHoldForTheFirstTimeOnlyUnlessTheyRepeat) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 0.0, 0.0, 0.0,
                              {{DriveStep{.v_mps = 0.2, .for_s = 2.0}},
                               {TurnStep{180.0}},
                               {DriveStep{.v_mps = 0.2, .for_s = 4.0}}}),
                     robot_at("b", 0.0, 1.0, 0.0)};
  EventSpec repeats = when({RobotAt{"a", {0.2, 0.0}, 0.1}}, "reminds");
  repeats.every_s = 4.0;
  scenario.events = {when({RobotAt{"a", {0.2, 0.0}, 0.1}}, "passes"), repeats,
                     when({RobotsNear{"a", "b", 1.02}}, "near"), when({ProgramDone{"a"}}, "done")};
  Stage stage(scenario);
  Duration passed{};
  while (stage.time() < milliseconds(4000)) {
    const double x = state(stage, 0).pose.x;
    if (x >= 0.1 && passed.count() == 0) passed = stage.time();
    stage.advance();
  }
  advance(stage, 6.0);
  const std::string first = std::to_string(passed / milliseconds(1));
  const Names names = told(stage, scenario);
  ASSERT_EQ(names.size(), 6U);
  EXPECT_EQ(names[0], "near@0");
  EXPECT_EQ(names[1], "passes@" + first);
  EXPECT_EQ(names[2], "reminds@" + first);
  EXPECT_EQ(names[3], "reminds@" + std::to_string(passed / milliseconds(1) + 4000));
  EXPECT_EQ(names[4], "reminds@" + std::to_string(passed / milliseconds(1) + 8000));
  EXPECT_EQ(names[5].substr(0, 5), "done@");
}

TEST(Stage, AProgramGoesOnInTheStepOfTheEventItWaitsFor) {
  Scenario scenario;
  scenario.robots = {
      robot_at("a", 0.0, 0.0, 0.0, {{WaitStep{.event = "go"}}, {DriveStep{.v_mps = 0.2, .for_s = 1.0}}})};
  scenario.events = {at(1.0, "go")};
  Stage stage(scenario);
  advance(stage, 1.0);
  EXPECT_EQ(state(stage, 0).velocity, Velocity2{});
  stage.advance();
  EXPECT_GT(state(stage, 0).velocity.x, 0.001);
}

TEST(Stage, TouchesAreToldByIdAlsoOfAPastInstant) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 2.0, 0.0, 0.0, {{DriveStep{.v_mps = 0.2, .for_s = 100.0}}})};
  scenario.objects = {box("shelf", 2.7, 0.0)};  // its face at 2.55
  scenario.events = {when({RobotTouches{"a"}}, "hit")};
  Stage stage(scenario);
  advance(stage, 5.0);
  EXPECT_EQ(stage.touches(0, stage.time()), (Names{"shelf"}));
  EXPECT_EQ(stage.touches(1, stage.time()), (Names{"a"}));
  EXPECT_TRUE(stage.touches(0, milliseconds(500)).empty());
  const Names names = told(stage, scenario);
  ASSERT_EQ(names.size(), 1U);
  EXPECT_EQ(names[0].substr(0, 4), "hit@");
  const double hit_s = std::stod(names[0].substr(4)) / 1000.0;
  EXPECT_NEAR(hit_s, (2.55 - 2.0 - 0.084) / 0.2 + 0.04, 0.08);  // the motors take 0.04 s of it
  stage.act(RemoveAction{"shelf"});
  advance(stage, 3.0);
  EXPECT_EQ(stage.touches(0, stage.time()), (Names{"wall"}));
}

TEST(Stage, AKidnappedRobotIsNowhereUntilItIsPutDown) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 0.0, 0.0, 0.0, {{DriveStep{.v_mps = 0.1, .for_s = 3.0}}})};
  scenario.events = {at(1.0, "grab", KidnapAction{"a", {-1.0, 2.0, 90.0}, 0.5})};
  Stage stage(scenario);
  advance(stage, 1.0);
  const double x = state(stage, 0).pose.x;
  stage.take_odometry();
  advance(stage, 0.5);
  EXPECT_TRUE(stage.timeline().at(0, milliseconds(1000)).present);
  EXPECT_FALSE(stage.timeline().at(0, milliseconds(1002)).present);
  EXPECT_FALSE(state(stage, 0).present);
  const auto reports = stage.take_odometry();
  ASSERT_GT(reports.size(), 10U);
  EXPECT_EQ(reports.back().pose, reports[1].pose);  // its wheels hang in the air
  advance(stage, 0.002);
  EXPECT_TRUE(state(stage, 0).present);
  EXPECT_NEAR(state(stage, 0).pose.x, -1.0, 1e-4);
  EXPECT_NEAR(state(stage, 0).pose.y, 2.0, 1e-4);
  advance(stage, 5.0);
  // Its program stood still meanwhile: in all it has driven for three seconds.
  EXPECT_NEAR(x + state(stage, 0).pose.y - 2.0, 0.3, 0.01);
}

TEST(Stage, AKidnapAtOnceLeavesNoTraceBetweenThePlaces) {
  Scenario scenario;
  scenario.robots = {robot_at("a", -2.0, 0.0, 0.0)};
  Stage stage(scenario);
  advance(stage, 0.1);
  stage.act(KidnapAction{"a", {2.0, 0.0, 0.0}, 0.0});
  stage.advance();
  EXPECT_NEAR(stage.timeline().at(0, std::chrono::microseconds(101999)).pose.x, -2.0, 1e-6);
  EXPECT_NEAR(stage.timeline().at(0, milliseconds(102)).pose.x, 2.0, 1e-6);
}

TEST(Stage, ARobotIsPutDownOnlyWhereThereIsRoom) {
  Scenario scenario;
  scenario.robots = {
      robot_at("a", -2.0, 0.0, 0.0),
      robot_at("b", 0.0, 0.0, 0.0, {{StopStep{2.0}}, {DriveStep{.v_mps = 0.2, .for_s = 4.0}}})};
  scenario.events = {at(0.5, "grab", KidnapAction{"a", {0.1, 0.05, 0.0}, 0.2})};
  Stage stage(scenario);
  while (!state(stage, 0).present || stage.time() < milliseconds(600)) {
    stage.advance();
    ASSERT_LT(stage.time(), std::chrono::seconds(8));
  }
  // b, 0.281 m long, has just left the place; it is looked for every 0.1 s.
  EXPECT_NEAR(state(stage, 1).pose.x, 0.1 + 0.281, 0.03);
  EXPECT_EQ((stage.time() - World::kStep - milliseconds(700)) % milliseconds(100), Duration{});
  advance(stage, 1.0);
  EXPECT_NEAR(state(stage, 0).pose.x, 0.1, 0.001);
}

TEST(Stage, ARobotThatIsOffStandsAndSaysNothingAndGoesOnLater) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 0.0, 0.0, 0.0, {{DriveStep{.v_mps = 0.2, .for_s = 2.0}}})};
  scenario.events = {at(1.0, "off", PowerAction{"a", false}), at(3.0, "on", PowerAction{"a", true})};
  Stage stage(scenario);
  advance(stage, 1.2);
  const double x = state(stage, 0).pose.x;
  stage.take_odometry();
  advance(stage, 1.8);
  EXPECT_FALSE(stage.powered(0));
  EXPECT_NEAR(state(stage, 0).pose.x, x, 1e-6);
  EXPECT_TRUE(stage.take_odometry().empty());
  advance(stage, 0.1);
  EXPECT_FALSE(stage.take_odometry().empty());
  EXPECT_FALSE(stage.program_done(0));
  advance(stage, 2.0);
  EXPECT_TRUE(stage.program_done(0));
  EXPECT_NEAR(state(stage, 0).pose.x, 0.4, 0.01);
}

TEST(Stage, SomebodyWhoDrivesARobotLetsItsProgramWait) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 0.0, 0.0, 0.0, {{DriveStep{.v_mps = 0.2, .for_s = 2.0}}})};
  Stage stage(scenario);
  advance(stage, 1.0);
  stage.act(DriveAction{.robot = "a", .v_mps = -0.1, .for_s = 1.0});
  advance(stage, 1.0);
  EXPECT_NEAR(state(stage, 0).velocity.x, -0.1, 1e-3);
  EXPECT_NEAR(state(stage, 0).pose.x, 0.2 - 0.1, 0.03);
  advance(stage, 3.0);
  EXPECT_NEAR(state(stage, 0).pose.x, 0.4 - 0.1, 0.01);
}

TEST(Stage, SlipLastsAsLongAsItSaysAndLetsOdometryRunAhead) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 0.0, 0.0, 0.0, {{DriveStep{.v_mps = 0.2, .for_s = 100.0}}})};
  scenario.robots[0].odometry.wheel_radius_error = 0.0;
  scenario.robots[0].odometry.separation_error = 0.0;
  scenario.events = {at(0.0, "oil", SlipAction{"a", 0.0, 2.0})};
  Stage stage(scenario);
  advance(stage, 2.0);
  EXPECT_NEAR(state(stage, 0).pose.x, 0.0, 1e-9);
  EXPECT_NEAR(stage.take_odometry().back().pose.x, 0.2 * 1.96, 0.01);
  advance(stage, 0.5);
  EXPECT_NEAR(state(stage, 0).velocity.x, 0.2, 1e-4);
}

TEST(Stage, PeopleWalkTheirWayAndAreThereOnlyMeanwhile) {
  Scenario scenario;
  PersonSpec person;
  person.id = "eva";
  person.path_m = {{{-1.0, 0.0}, {1.0, 0.0}, {1.0, 0.5}}};
  person.speed_mps = 1.0;
  person.start_s = 1.0;
  scenario.people = {person};
  scenario.robots = {robot_at("a", 0.5, 0.0, 90.0)};
  Stage stage(scenario);
  ASSERT_EQ(stage.actor(1).kind, ActorKind::person);
  advance(stage, 0.9);
  EXPECT_FALSE(state(stage, 1).present);
  advance(stage, 0.6);
  EXPECT_NEAR(state(stage, 1).pose.x, -0.5, 1e-6);
  EXPECT_NEAR(state(stage, 1).velocity.x, 1.0, 1e-3);
  advance(stage, 1.2);  // now at 0.7: she has pushed the robot before her feet
  EXPECT_NEAR(state(stage, 1).pose.x, 0.7, 1e-6);
  EXPECT_GT(state(stage, 0).pose.x, 0.8);
  EXPECT_EQ(stage.touches(0, stage.time()), (Names{"eva"}));
  advance(stage, 0.4);
  EXPECT_NEAR(state(stage, 1).pose.y, 0.1, 1e-6);
  EXPECT_NEAR(state(stage, 1).pose.yaw, 1.5708, 1e-4);
  advance(stage, 0.5);
  EXPECT_FALSE(state(stage, 1).present);
}

TEST(Stage, ThingsComeAndGoAndKeepTheirPlaceInTheRow) {
  Scenario scenario;
  scenario.robots = {robot_at("a", -2.0, 0.0, 0.0)};
  scenario.objects = {box("one", 1.0, 1.0)};
  scenario.events = {at(0.1, "", PutAction{box("two", 0.0, -1.0)}), at(0.2, "", RemoveAction{"one"}),
                     at(0.3, "", PutAction{box("one", 1.0, 1.0)})};
  Stage stage(scenario);
  EXPECT_EQ(stage.actor_count(), 2U);
  advance(stage, 0.5);
  ASSERT_EQ(stage.actor_count(), 4U);
  EXPECT_EQ(stage.id(2), "two");
  EXPECT_EQ(stage.id(3), "one");
  EXPECT_EQ(stage.actor(3).index, 2U);
  EXPECT_FALSE(state(stage, 1).present);
  EXPECT_FALSE(stage.timeline().at(2, milliseconds(100)).present);
  EXPECT_TRUE(stage.timeline().at(2, milliseconds(102)).present);
  EXPECT_TRUE(state(stage, 3).present);
  const auto effects = stage.take_effects();
  ASSERT_EQ(effects.size(), 3U);
  EXPECT_EQ(effects[0].at, milliseconds(100));
  EXPECT_EQ(std::get<RemoveAction>(effects[1].action).object, "one");
  EXPECT_TRUE(stage.take_effects().empty());
}

TEST(Stage, AnEventWhoseThingFindsNoRoomTriesAgain) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 0.0, 0.0, 0.0, {{DriveStep{.v_mps = 0.2, .for_s = 4.0}}})};
  scenario.events = {at(0.0, "put", PutAction{box("b", 0.0, 0.0)})};
  Stage stage(scenario);
  advance(stage, 0.5);
  EXPECT_EQ(stage.actor_count(), 1U);
  advance(stage, 3.5);
  EXPECT_EQ(stage.actor_count(), 2U);
  const Names names = told(stage, scenario);
  ASSERT_EQ(names.size(), 1U);
  // Free once its back, 0.197 m behind base_link, is past the box's front at 0.15 m.
  EXPECT_NEAR(std::stod(names[0].substr(4)), 1000.0 * (0.347 / 0.2 + 0.04), 110.0);
}

TEST(Stage, ActionsThatAreThePicturesAreHandedOnWithTheirTime) {
  Scenario scenario;
  scenario.events = {at(0.25, "dusk", LightAction{0.2, 3.0})};
  Stage stage(scenario);
  advance(stage, 0.3);
  stage.act(FreezeAction{"ceiling", 1.0});
  const auto effects = stage.take_effects();
  ASSERT_EQ(effects.size(), 2U);
  EXPECT_EQ(effects[0].at, milliseconds(250));
  EXPECT_EQ(std::get<LightAction>(effects[0].action).level, 0.2);
  EXPECT_EQ(effects[1].at, milliseconds(300));
  EXPECT_EQ(told(stage, scenario), (Names{"dusk@250", "@300"}));
}

/// What is said to an action that cannot be done; empty where it can.
std::string refusal(Stage& stage, const Action& action) {
  try {
    stage.act(action);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST(Stage, AnImpossibleActionIsRefusedWithItsReason) {
  Scenario scenario;
  scenario.robots = {robot_at("a", 0.0, 0.0, 0.0)};
  scenario.objects = {box("crate", 1.0, 1.0)};
  Stage stage(scenario);
  const auto says = [&](const Action& action, const std::string& words) {
    const std::string text = refusal(stage, action);
    EXPECT_NE(text.find(words), std::string::npos) << "\"" << text << "\" lacks \"" << words << "\"";
  };
  says(PowerAction{"nobody", true}, "nobody");
  says(KidnapAction{"a", {5.0, 0.0, 0.0}, 0.0}, "outside the room");
  says(BumpAction{"none", {}, {}}, "none");
  says(DriveAction{.robot = "a", .side_mps = 0.1}, "sideways");
  says(RemoveAction{"chair"}, "chair");
  says(PutAction{box("crate", -1.0, 1.0)}, "taken");
  says(PutAction{box("a", -1.0, 1.0)}, "taken");
  says(PutAction{box("new", 2.95, 0.0)}, "outside the room");
  says(PutAction{box("new", 1.2, 1.0)}, "occupied by crate");
  says(PutAction{box("new", 0.1, 0.0)}, "occupied by a");
  EXPECT_TRUE(stage.take_happenings().empty());
  EXPECT_EQ(refusal(stage, PutAction{box("new", -1.0, 1.0)}), "");
  EXPECT_EQ(refusal(stage, RemoveAction{"new"}), "");
  EXPECT_NE(refusal(stage, RemoveAction{"new"}), "");
  EXPECT_EQ(refusal(stage, PutAction{box("new", -1.0, 1.0)}), "");
}

TEST(Stage, TheSameScenarioIsTheSameToTheBit) {
  const auto run = [] {
    Scenario scenario;
    scenario.robots = {robot_at("a", -1.5, 0.0, 0.0, {{WanderStep{}}}), robot_at("b", 0.0, 0.0, 0.0)};
    scenario.robots[0].copies = {4, 2, {0.8, 0.8}};
    scenario.robots[1].start = {0.5, 1.0, 0.0};
    scenario.robots[1].program = {{WanderStep{.avoid_m = 0.0}}};
    ObjectSpec pushable = box("box", 1.5, 1.0);
    pushable.pushable = true;
    scenario.objects = {pushable};
    scenario.events = {at(3.0, "", KidnapAction{"b", {0.0, -1.0, 45.0}, 1.0}), at(5.0, "", PushAction{"a"})};
    Stage stage(scenario);
    advance(stage, 20.0);
    std::vector<double> values;
    for (std::size_t i = 0; i < stage.actor_count(); ++i) {
      const BodyState s = state(stage, i);
      values.insert(values.end(), {s.pose.x, s.pose.y, s.pose.yaw, s.velocity.x, s.velocity.yaw_rate});
    }
    for (const OdometryReport& report : stage.take_odometry()) values.push_back(report.pose.x);
    return values;
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace skylight::sim
