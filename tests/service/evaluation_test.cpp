// Labels, identity, expectations: against cases worked out by hand.
#include <numbers>

#include <gmock/gmock.h>

#include "service/assembly.hpp"
#include "service/evaluation/expectations.hpp"
#include "service/evaluation/report.hpp"
#include "tests/service/simulated_room.hpp"

namespace skylight::service::test {
namespace {

using std::nullopt;
using testing::ElementsAre;
using testing::HasSubstr;

Truth robot_at(const std::string& id, double x, bool present = true) {
  return {.id = id,
          .pose = {.x = x},
          .velocity = {},
          .present = present,
          .in_view = true,
          .touches = {},
          .box_px = {}};
}

std::vector<Truth> three(double a, double b, double c) {
  return {robot_at("a", a), robot_at("b", b), robot_at("c", c)};
}

Poses poses(std::vector<std::optional<double>> xs) {
  Poses out;
  for (const auto& x : xs) out.push_back(x ? std::optional(Pose2{.x = *x}) : nullopt);
  return out;
}

using Labels = std::vector<std::optional<std::size_t>>;

TEST(LabelBinding, AmongCopiesTheFirstPlaceOfALabelCountsAndStays) {
  LabelBinding labels({0, 0, 2});
  EXPECT_EQ(labels.update(three(0, 1, 2), poses({1.01, 0.02, 2.0})), (Labels{1, 0, 2})) << "called crosswise";
  EXPECT_EQ(labels.update(three(0, 1, 2), poses({0.0, 1.0, 2.0})), (Labels{1, 0, 2}))
      << "that they changed places is an error from now on";
}

TEST(LabelBinding, TheClosestPairGoesFirstWhereTwoWantTheSame) {
  LabelBinding labels({0, 0, 0});
  EXPECT_EQ(labels.update(three(0, 0.15, 2), poses({0.08, 0.01, nullopt})), (Labels{1, 0, nullopt}));
}

TEST(LabelBinding, ALabelFarFromEveryCopyIsCountedWithTheNearestButNotBound) {
  LabelBinding labels({0, 0, 2});
  EXPECT_EQ(labels.update(three(0, 1, 2), poses({0.7, nullopt, nullopt})), (Labels{nullopt, 0, 2}));
  EXPECT_EQ(labels.update(three(0, 1, 2), poses({0.01, nullopt, nullopt})), (Labels{0, nullopt, 2}));
  EXPECT_EQ(labels.update(three(0, 1, 2), poses({1.0, nullopt, nullopt})), (Labels{0, nullopt, 2}));
}

TEST(LabelBinding, ARobotWithoutCopiesKeepsItsOwnLabelWhereverItStands) {
  LabelBinding labels({0, 1, 2});
  EXPECT_EQ(labels.update(three(0, 1, 2), poses({1.0, 0.0, nullopt})), (Labels{0, 1, 2}));
}

TEST(IdentityTally, TwoRobotsThatExchangeTheirLabelsOnceAreTwoSwitches) {
  IdentityTally tally;
  for (int i = 0; i < 5; ++i) tally.add(three(0, 1, 2), poses({0, 1, 2}));
  EXPECT_EQ(tally.switches(), 0U);
  EXPECT_DOUBLE_EQ(tally.idf1(), 1.0);
  EXPECT_DOUBLE_EQ(tally.mota(), 1.0);
  for (int i = 0; i < 5; ++i) tally.add(three(0, 1, 2), poses({1, 0, 2}));
  EXPECT_EQ(tally.switches(), 2U);
  EXPECT_DOUBLE_EQ(tally.idf1(), 2.0 * 20 / (30 + 30));
  EXPECT_DOUBLE_EQ(tally.mota(), 1.0 - (10.0 + 10.0 + 2.0) / 30.0);
}

TEST(IdentityTally, MissesAndPosesOnNothingAreCounted) {
  IdentityTally tally;
  tally.add(three(0, 1, 2), poses({0, nullopt, 7}));
  EXPECT_EQ(tally.switches(), 0U);
  EXPECT_DOUBLE_EQ(tally.idf1(), 2.0 * 1 / (3 + 2));
  EXPECT_DOUBLE_EQ(tally.mota(), 1.0 - (2.0 + 1.0) / 3.0);
}

TEST(IdentityTally, WhoIsCarriedAwayOrWasNotYetSeenDoesNotCount) {
  IdentityTally tally;
  std::vector<Truth> truth = three(0, 1, 2);
  truth[1].present = false;
  truth[2].in_view = false;
  tally.add(truth, poses({0, 1, 5}));
  EXPECT_DOUBLE_EQ(tally.idf1(), 1.0);
  EXPECT_DOUBLE_EQ(tally.mota(), 1.0);
  IdentityTally both;
  both.add(three(0, 1, 2), poses({0, 1, nullopt}));
  both.merge(tally);
  EXPECT_DOUBLE_EQ(both.idf1(), 2.0 * 3 / (4 + 3));
}

// Two robots over ten frames a tenth of a second apart after the first second: errors 1 mm and 2 mm, one
// frame of the second without a pose.
RunScore worked_out() {
  RunScore run{
      .scenario = "worked out",
      .seeds = {1},
      .detector = "orb",
      .robots = {{"a"}, {"b"}, {"bare", false}},
      .kinds = {{.kind = PoseKind::filtered, .robots = std::vector<RobotMetrics>(3), .identity = {}}},
      .milliseconds = {}};
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 2; ++k) {
      ScoredFrame frame{.captured = Time{std::chrono::milliseconds(100 * i)},
                        .truth = {},
                        .estimate = Pose2{.x = 0.001 * (k + 1), .yaw = 0.01},
                        .covariance = {},
                        .measured = true};
      if (k == 1 && i == 19) frame.estimate.reset();
      run.kinds[0].robots[static_cast<std::size_t>(k)].add(frame);
    }
    run.kinds[0].identity.add(three(0, 1, 2), poses({0, 1, nullopt}));
  }
  return run;
}

Expected at_most(const std::string& figure, double bound, const std::string& robot = {}) {
  return {.figure = figure, .robot = robot, .at_most = bound, .at_least = {}};
}

TEST(Expectations, AreKeptAtTheirVeryBoundAndFailBeyond) {
  const auto judged = judge({at_most("max_error_m", 0.001, "a"),
                             at_most("max_error_m", 0.0009, "a"),
                             {.figure = "availability", .robot = "b", .at_most = {}, .at_least = 0.9},
                             {.figure = "availability", .robot = "b", .at_most = {}, .at_least = 0.95}},
                            worked_out());
  ASSERT_EQ(judged.size(), 4U);
  EXPECT_TRUE(judged[0].kept);
  EXPECT_FALSE(judged[1].kept);
  EXPECT_TRUE(judged[2].kept);
  EXPECT_DOUBLE_EQ(*judged[2].value, 0.9);
  EXPECT_FALSE(judged[3].kept);
  EXPECT_EQ(judgement_line(judged[1]), "FAILED  max_error_m of a (filtered): 0.001, at most 0.0009");
}

TEST(Expectations, OfEachRobotShowTheWorstAndLeaveOutThoseThatNobodyCanTellApart) {
  const auto judged = judge({at_most("mean_error_m", 0.0015), at_most("mean_error_m", 0.0025)}, worked_out());
  EXPECT_EQ(judged[0].robot, "b");
  EXPECT_DOUBLE_EQ(*judged[0].value, 0.002);
  EXPECT_FALSE(judged[0].kept);
  EXPECT_TRUE(judged[1].kept);
}

TEST(Expectations, AFigureWithoutAnyPoseIsNotKept) {
  const auto judged = judge({at_most("mean_error_m", 5, "bare"), at_most("nees_mean", 5, "a")}, worked_out());
  EXPECT_FALSE(judged[0].kept);
  EXPECT_FALSE(judged[0].value);
  EXPECT_THAT(judgement_line(judged[0]), HasSubstr("no pose"));
  EXPECT_FALSE(judged[1].kept) << "no covariance, so nothing to judge it by";
}

TEST(Expectations, WhoNeverGaveAPoseHasNotKeptItsCountsEither) {
  RunScore run = worked_out();
  run.kinds[0].identity = {};
  for (const char* figure : {"id_switches", "confident_wrong"}) {
    const auto judged = judge({at_most(figure, 0, "bare")}, run);
    EXPECT_FALSE(judged[0].kept) << figure;
    EXPECT_FALSE(judged[0].value) << figure;
    EXPECT_THAT(judgement_line(judged[0]), HasSubstr("no pose"));
  }
  EXPECT_TRUE(judge({at_most("confident_wrong", 0, "a")}, run)[0].kept);
}

TEST(Expectations, AWrongPoseOfTheFirstSecondIsAPoseThatCounts) {
  RunScore run = worked_out();
  run.kinds[0].robots[2].add(
      {.truth = {}, .estimate = Pose2{.x = 0.5}, .covariance = {}, .state = TrackState::tracking});
  const auto judged = judge({at_most("confident_wrong", 0, "bare")}, run);
  EXPECT_FALSE(judged[0].kept);
  EXPECT_EQ(judged[0].value, 1.0);
}

// Seen from the first instant; found after 0.2 s and, once it was hidden for four frames, after 0.3 s more.
RunScore of_a_robot_that_was_hidden() {
  RunScore run = worked_out();
  RobotMetrics metrics;
  for (int i = 0; i < 20; ++i) {
    const bool hidden = i >= 10 && i < 14;
    const bool tracked = (i >= 2 && i < 10) || i >= 17;
    ScoredFrame frame{.captured = Time{std::chrono::milliseconds(100 * i)}, .truth = {}, .covariance = {}};
    frame.visible = hidden ? 0.0 : 1.0;
    if (tracked) frame.estimate = Pose2{};
    frame.state = tracked ? TrackState::tracking : TrackState::predicting;
    if (hidden && i > 10) frame.state = TrackState::occluded;
    metrics.add(frame);
  }
  run.kinds[0].robots[0] = metrics;
  return run;
}

TEST(Expectations, TellHowLongARobotWasLookedForAndWhetherItWasSaidToBeHidden) {
  const auto judged = judge({at_most("find_mean_s", 0.25, "a"),
                             at_most("find_worst_s", 0.3, "a"),
                             at_most("find_worst_s", 0.29, "a"),
                             {.figure = "hidden_told", .robot = "a", .at_most = {}, .at_least = 0.75},
                             {.figure = "hidden_told", .robot = "b", .at_most = {}, .at_least = 0.0}},
                            of_a_robot_that_was_hidden());
  EXPECT_TRUE(judged[0].kept);
  EXPECT_NEAR(*judged[0].value, 0.25, 1e-9);
  EXPECT_TRUE(judged[1].kept);
  EXPECT_NEAR(*judged[1].value, 0.3, 1e-9);
  EXPECT_FALSE(judged[2].kept);
  EXPECT_TRUE(judged[3].kept);
  EXPECT_DOUBLE_EQ(*judged[3].value, 0.75);
  EXPECT_FALSE(judged[4].kept) << "nothing to say it of";
  EXPECT_THAT(judgement_line(judged[4]), HasSubstr("never hidden"));
}

TEST(Expectations, WhoOnceWasNotFoundTookForEver) {
  RunScore run = of_a_robot_that_was_hidden();
  run.kinds[0].robots[0].add(
      {.captured = Time{std::chrono::seconds(3)}, .truth = {.x = 2.0}, .covariance = {}});  // carried there
  for (const char* figure : {"find_mean_s", "find_worst_s"}) {
    const auto judged = judge({at_most(figure, 1e6, "a")}, run);
    EXPECT_FALSE(judged[0].kept) << figure;
    EXPECT_THAT(judgement_line(judged[0]), HasSubstr(": inf, at most")) << figure;
  }
}

TEST(Expectations, AnglesAreInDegreesAndCommonFiguresOfAll) {
  const auto judged = judge({at_most("max_yaw_error_deg", 1), at_most("id_switches", 0)}, worked_out());
  EXPECT_NEAR(*judged[0].value, 0.01 * 180 / std::numbers::pi, 1e-12);
  EXPECT_TRUE(judged[1].kept);
  EXPECT_EQ(judged[1].robot, "");
}

TEST(Expectations, OfAKindThatWasNotScoredOrARobotThatIsNotThereAreRefused) {
  Expected predicted = at_most("mean_error_m", 1);
  predicted.kind = PoseKind::predicted;
  EXPECT_THROW(judge({predicted}, worked_out()), std::invalid_argument);
  EXPECT_THROW(judge({at_most("mean_error_m", 1, "nobody")}, worked_out()), std::invalid_argument);
}

TEST(Evaluation, PoolingTakesTheFramesOfAllRunsAndNamesTheWorstSeed) {
  RunScore pooled = worked_out();
  pooled.kinds[0].worst_seed = 1;
  pooled.kinds[0].worst_error_m = 0.002;
  RunScore other = worked_out();
  other.seeds = {2};
  other.kinds[0].worst_seed = 2;
  other.kinds[0].worst_error_m = 0.004;
  pooled.merge(other);
  EXPECT_THAT(pooled.seeds, ElementsAre(1, 2));
  EXPECT_EQ(pooled.kinds[0].robots[0].score().frames, 20U);
  const Json json = to_json(pooled, "window");
  EXPECT_EQ(json[0]["worst_seed"], 2);
  EXPECT_EQ(json[0]["all"]["frames"], 40) << "every robot's";
}

TEST(Evaluation, EveryRobotHasItsRowAlsoTheOneThatNothingTellsApart) {
  const RoomFolder folder;
  const std::string bare = R"("duration_s": 0.2, "robots": [
      {"id": "bare", "picture": {"enabled": false}, "start": {"x_m": 0.4, "y_m": 0.3}},
      {"id": "anna", "picture": {"seed": 5}, "start": {"x_m": -0.4, "y_m": -0.2}}])";
  std::string scenario = small_scenario("");
  scenario = scenario.substr(0, scenario.find("\"robots\"")) + bare + "}";
  const auto simulator =
      std::make_shared<SimulatorFrames>(scenario_run(folder.write("room.json", scenario), std::nullopt));
  const Assembly assembly = assemble(Config{}, simulator);
  ASSERT_EQ(assembly.robots.size(), 1U);
  Contestant contestant(*simulator, make_tracker(assembly), "orb", {PoseKind::measured}, {});
  while (const auto frame = assembly.source->next()) contestant.process(*frame, simulator->truth());
  const RunScore run = contestant.result();
  ASSERT_EQ(run.robots.size(), 2U);
  EXPECT_FALSE(run.robots[0].registered);
  EXPECT_EQ(run.kinds[0].robots[0].score().measured, 0.0);
  EXPECT_TRUE(run.robots[1].registered);
}

// Contestants over the same frames of a room of 1.7 s, of which the first second is not scored.
std::vector<RunScore> run_contest(const RoomFolder& folder, const std::vector<bool>& hears,
                                  const std::vector<PoseKind>& kinds,
                                  const std::vector<std::string>& changes = {}) {
  const auto simulator = std::make_shared<SimulatorFrames>(
      scenario_run(folder.write("room.json", small_scenario(R"("duration_s": 1.7)")), std::nullopt, changes));
  std::vector<Contestant> contestants;
  std::shared_ptr<FrameSource> source;
  for (std::size_t i = 0; i < hears.size(); ++i) {
    Assembly assembly = assemble(Config{}, simulator);
    assembly.robots.at(0).initial_pose = simulator->robots().at(0).start;
    contestants.emplace_back(*simulator, make_tracker(assembly), "orb", kinds,
                             std::chrono::milliseconds(200));
    source = std::move(assembly.source);
  }
  while (const auto frame = source->next()) {
    const auto odometry = simulator->take_odometry();
    for (std::size_t i = 0; i < hears.size(); ++i) {
      if (hears[i]) contestants[i].hear(odometry, simulator->now());
      contestants[i].process(*frame, simulator->truth());
    }
  }
  std::vector<RunScore> scores;
  for (Contestant& contestant : contestants) scores.push_back(contestant.result());
  return scores;
}

TEST(Evaluation, SmoothedIsScoredForEveryFrameThoseOfTheLastSecondToo) {
  const RoomFolder folder;
  const RunScore run = run_contest(folder, {false}, {PoseKind::filtered, PoseKind::smoothed}).at(0);
  const RobotScore filtered = run.kind(PoseKind::filtered)->robots[0].score();
  const RobotScore smoothed = run.kind(PoseKind::smoothed)->robots[0].score();
  EXPECT_GE(filtered.frames, 20U);
  EXPECT_EQ(smoothed.frames, filtered.frames);
  EXPECT_EQ(smoothed.availability, 1.0) << "also where nothing is final";
  EXPECT_LT(smoothed.position_error_m.max, 0.003);
  EXPECT_EQ(run.kind(PoseKind::smoothed)->identity.mota(), 1.0);
}

TEST(Evaluation, OdometryReachesTheTrackerThatIsToHearIt) {
  const RoomFolder folder;
  const auto runs = run_contest(folder, {false, true, true}, {PoseKind::measured, PoseKind::predicted});
  const auto error = [&](std::size_t i, PoseKind kind) {
    return runs.at(i).kind(kind)->robots[0].score().position_error_m.mean;
  };
  EXPECT_EQ(error(0, PoseKind::measured), error(1, PoseKind::measured)) << "what is seen is the same";
  EXPECT_NE(error(0, PoseKind::predicted), error(1, PoseKind::predicted));
  EXPECT_EQ(error(1, PoseKind::predicted), error(2, PoseKind::predicted)) << "and it can be repeated";
  EXPECT_LT(error(1, PoseKind::predicted), 0.02);
}

TEST(Evaluation, ARobotsOwnClockIsEstimated) {
  const RoomFolder folder;
  const auto error = [&](const std::string& offset) {
    const auto runs =
        run_contest(folder, {true}, {PoseKind::predicted}, {"robots[0].odometry.clock_offset_s=" + offset});
    return runs.at(0).kind(PoseKind::predicted)->robots[0].score().position_error_m.mean;
  };
  EXPECT_NEAR(error("-1.5"), error("0"), 1e-6);
  EXPECT_NEAR(error("7"), error("0"), 1e-6);
}

TEST(Evaluation, ARoomTellsTheSizeOfItsFloor) {
  const RoomFolder folder;
  const auto run =
      scenario_run(folder.write("room.json", small_scenario("")), std::nullopt, {"room.size_m=[3, 2.5]"});
  EXPECT_EQ(SimulatorFrames(run).room_m(), Eigen::Vector2d(3.0, 2.5));
}

}  // namespace
}  // namespace skylight::service::test
