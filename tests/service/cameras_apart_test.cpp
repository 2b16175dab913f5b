// Several cameras over one floor, drawn by the simulator: fused, handed over, late, and one that was bumped.
#include "service/evaluation/cameras_apart.hpp"

#include <map>
#include <set>

#include <gmock/gmock.h>

#include "service/evaluation/camera_error.hpp"
#include "tests/service/simulated_room.hpp"

namespace skylight::service::test {
namespace {

// West and east of the middle; between them they overlap by 0.9 m on the floor. The robot goes to and fro
// through all of it.
std::string two_cameras(const std::string& more = {}, const std::string& east = {}) {
  const std::string camera = R"("width_px": 320, "height_px": 240, "fx_px": 250, "fy_px": 250,
    "distortion": [0, 0, 0, 0, 0], "frame_rate_hz": 30)";
  return R"({"seed": 7, "duration_s": 12, "room": {"size_m": [3, 2], "floor": {"material": "concrete"}},
    "cameras": [{"id": "west", "position_m": [-0.5, 0, 1.5], )" +
         camera + R"(}, {"id": "east", "position_m": [0.5, 0, 1.5], "first_frame_s": 0.011, )" + camera +
         east +
         R"(}],
    "robots": [{"id": "anna", "picture": {"seed": 5}, "start": {"x_m": -0.9, "y_m": -0.1},
      "program": [{"do": "waypoints", "points_m": [[0.9, -0.1], [0.9, 0.1], [-0.9, 0.1], [-0.9, -0.1]],
                   "speed_mps": 0.3, "loop": true}]}])" +
         more + "}";
}

Assembly assembly_of(const std::shared_ptr<SimulatorFrames>& simulator) {
  Config config;
  config.source = SimulatorSourceConfig{};
  return assemble(config, simulator);
}

TEST(CamerasApart, TogetherAreBetterThanTheBestAloneAndHandOverWithoutAJump) {
  const RoomFolder folder;
  const std::string scenario = folder.write("two.json", two_cameras());
  CamerasScore all;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto simulator = std::make_shared<SimulatorFrames>(scenario, seed);
    Assembly assembly = assembly_of(simulator);
    use_wrong_cameras(assembly, {.room_m = simulator->room_m(), .rms_m = 0.0015, .seed = seed});
    CamerasApart apart(*simulator, assembly);
    while (const auto frame = simulator->next()) apart.process(*frame, simulator->truth());
    seed == 1 ? void(all = apart.result()) : all.merge(apart.result());
  }
  ASSERT_GT(all.cameras.at(0).alone_m.size(), 200U);
  EXPECT_EQ(all.cameras[0].alone_m.size(), all.cameras[1].alone_m.size());
  EXPECT_LT(all.worst_ratio(), 1.1);
  EXPECT_LT(all.mean_ratio(), 1.0);
  // Every frame of both cameras but those of the grace.
  EXPECT_GT(all.steps_m.size(), 3U * 2U * 30U * 9U);
  EXPECT_LT(*std::max_element(all.steps_m.begin(), all.steps_m.end()), 0.005);
}

TEST(CamerasApart, OneThatDoesNotSeeTheRobotDoesNotTakeItsStateAway) {
  const RoomFolder folder;
  const auto simulator = std::make_shared<SimulatorFrames>(folder.write("two.json", two_cameras()), 1);
  Assembly assembly = assembly_of(simulator);
  Tracker tracker = make_tracker(assembly);
  std::set<CameraSet> contributing;
  std::size_t tracked = 0;
  for (int i = 0; const auto frame = simulator->next(); ++i) {
    const RobotReport report = tracker.process(*frame).at(0);
    if (i < 60) continue;
    EXPECT_EQ(report.state, TrackState::tracking) << i << ": " << report.reason;
    ASSERT_TRUE(report.filtered);
    EXPECT_EQ(report.filtered->at, frame->captured);
    contributing.insert(report.filtered->cameras);
    ++tracked;
  }
  EXPECT_GT(tracked, 600U);
  EXPECT_THAT(contributing, testing::UnorderedElementsAre(1U, 2U, 3U));
}

TEST(CamerasApart, OneWhoseFramesComeLateIsUsedAtItsOwnTime) {
  const RoomFolder folder;
  const auto simulator = std::make_shared<SimulatorFrames>(
      folder.write("late.json", two_cameras("", R"(, "delivery": {"latency_s": 0.08})")), 1);
  Assembly assembly = assembly_of(simulator);
  Tracker tracker = make_tracker(assembly);
  Time newest{};
  std::size_t late = 0;
  for (int i = 0; const auto frame = simulator->next(); ++i) {
    const RobotReport report = tracker.process(*frame).at(0);
    late += frame->captured < newest ? 1 : 0;
    newest = std::max(newest, frame->captured);
    if (i < 90) continue;
    ASSERT_TRUE(report.filtered) << i;
    const Pose2& truth = simulator->truth().at(0).pose;
    EXPECT_LT((report.filtered->pose.position() - truth.position()).norm(), 0.003) << i;
  }
  EXPECT_GT(late, 300U);
}

TEST(CamerasApart, ScoresArePooledByCameraAndTheWorstRatioIsTheLargest) {
  CamerasScore a{.cameras = {{"west", {1.0, 3.0}, {1.0, 1.0}}, {"east", {1.0}, {2.0}}, {"north", {}, {}}},
                 .steps_m = {0.1}};
  a.merge({.cameras = {{"west", {2.0}, {1.0}}, {"east", {3.0}, {1.0}}, {"north", {}, {}}}, .steps_m = {0.2}});
  EXPECT_DOUBLE_EQ(a.worst_ratio(), 0.75);
  EXPECT_DOUBLE_EQ(a.mean_ratio(), 0.625);
  EXPECT_THAT(a.steps_m, testing::ElementsAre(0.1, 0.2));
  EXPECT_EQ(CamerasScore{}.worst_ratio(), 0.0);
}

}  // namespace
}  // namespace skylight::service::test
