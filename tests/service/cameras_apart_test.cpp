// Several cameras over one floor, drawn by the simulator: fused, handed over, late, and one that was bumped.
#include "service/evaluation/cameras_apart.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include <gmock/gmock.h>

#include "service/camera_agreement.hpp"
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
                   "speed_mps": 0.25, "loop": true}]}])" +
         more + "}";
}

Assembly assembly_of(const std::shared_ptr<SimulatorFrames>& simulator) {
  return assemble(Config{}, simulator);
}

TEST(CamerasApart, TogetherAreBetterThanTheBestAloneAndHandOverWithoutAJump) {
  const RoomFolder folder;
  const auto simulator = std::make_shared<SimulatorFrames>(folder.write("two.json", two_cameras()), 1);
  std::vector<CamerasApart> apart;  // over the same frames, each with other calibrations
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Assembly assembly = assembly_of(simulator);
    use_wrong_cameras(assembly, {.room_m = simulator->room_m(), .rms_m = 0.0015, .seed = seed});
    apart.emplace_back(*simulator, assembly);
  }
  // What is to be judged, counted from the truth: instants that both see, and those just after a change of
  // that.
  std::array<bool, 2> in_view{};
  std::optional<Time> first;
  Time changed{};
  int both = 0;
  int just_changed = 0;
  while (const auto frame = simulator->next()) {
    for (CamerasApart& each : apart) each.process(*frame, simulator->truth());
    if (!first) first = frame->captured;
    const bool sees = simulator->truth().at(0).in_view;
    if (std::exchange(in_view.at(frame->camera), sees) != sees) changed = frame->captured;
    if (frame->captured - *first < CamerasApart::kGrace) continue;
    both += in_view[0] && in_view[1] ? 1 : 0;
    just_changed += frame->captured - changed < std::chrono::seconds(1) ? 1 : 0;
  }
  CamerasScore all = apart.front().result();
  for (std::size_t i = 1; i < apart.size(); ++i) all.merge(apart[i].result());
  ASSERT_GT(both, 60);
  const auto judged = static_cast<double>(all.cameras.at(0).alone_m.size());
  EXPECT_LE(judged, 3.0 * both);
  EXPECT_GT(judged, 0.75 * 3.0 * both) << "but until a camera alone has found the robot that comes into view";
  EXPECT_EQ(all.cameras[0].alone_m.size(), all.cameras[1].alone_m.size());
  EXPECT_LT(all.worst_ratio(), 1.1);
  EXPECT_LT(all.mean_ratio(), 1.0);
  // Every frame of both cameras but those of the grace.
  EXPECT_GT(all.steps_m.size(), 3U * 2U * 30U * 9U);
  EXPECT_NEAR(static_cast<double>(all.hand_over_m.size()), 3.0 * just_changed, 3.0 * 2.0);
  EXPECT_LT(*std::max_element(all.hand_over_m.begin(), all.hand_over_m.end()), 0.005);
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
  struct Delivered {
    Frame frame;
    Pose2 truth;
  };
  std::multimap<Time, Delivered> waiting;  // by when they come
  Time newest{};
  std::size_t late = 0;
  std::size_t judged = 0;
  const auto take = [&](const Delivered& came) {
    const RobotReport report = tracker.process(came.frame).at(0);
    const bool was_late = came.frame.captured < newest;
    newest = std::max(newest, came.frame.captured);
    if (newest - simulator->start() < std::chrono::seconds(3)) return;
    late += was_late ? 1 : 0;
    ++judged;
    ASSERT_TRUE(report.filtered);
    EXPECT_EQ(report.filtered->at, came.frame.captured);
    // Where the other one does not see the robot it is foreseen, at corners too, until this one's frames
    // come.
    const double error = (report.filtered->pose.position() - came.truth.position()).norm();
    EXPECT_LT(error, report.measured ? 0.002 : 0.02);
  };
  while (auto frame = simulator->next()) {
    waiting.emplace(simulator->delivered(), Delivered{*frame, simulator->truth().at(0).pose});
    for (; waiting.begin()->first <= frame->captured; waiting.erase(waiting.begin()))
      take(waiting.begin()->second);
  }
  EXPECT_GT(judged, 500U);
  EXPECT_GT(late, 200U);
}

TEST(CamerasApart, OneThatWasBumpedIsNamedAndNotBelieved) {
  const RoomFolder folder;
  const std::string bump =
      R"(, "events": [{"at_s": 4, "do": "bump", "camera": "east", "by_deg": [0, 1, 0]}])";
  const auto simulator = std::make_shared<SimulatorFrames>(folder.write("bumped.json", two_cameras(bump)), 1);
  Assembly assembly = assembly_of(simulator);
  const CalibrationSigmas sigmas{.position_m = 0.001, .rotation_rad = 0.0007};
  assembly.tracker.calibration.assign(2, skylight::camera_uncertainty(sigmas));
  Tracker tracker = make_tracker(assembly);
  CameraAgreements agreements(2);
  std::vector<AgreementChange> told;
  double worst = 0.0;
  while (const auto frame = simulator->next()) {
    const RobotReport report = tracker.process(*frame).at(0);
    for (const AgreementChange& change : agreements.see(frame->captured, tracker.views()))
      told.push_back(change);
    const bool west_sees_it = frame->camera == 0 && simulator->truth().at(0).in_view;
    const double t = to_seconds(frame->captured - simulator->start());
    if (t < 3.0 || t > 5.0 || !west_sees_it) continue;  // then it drives out of that picture
    ASSERT_TRUE(report.filtered) << t;
    worst =
        std::max(worst, (report.filtered->pose.position() - simulator->truth().at(0).pose.position()).norm());
  }
  // A degree is 26 mm under the camera; where both saw the robot the other one was believed.
  EXPECT_LT(worst, 0.003);
  ASSERT_FALSE(told.empty());
  EXPECT_TRUE(told.front().disagrees);
  EXPECT_EQ(told.front().camera, 1U);
  EXPECT_TRUE(told.front().state.refused);
  EXPECT_NEAR(told.front().state.off_m, 0.026, 0.008);
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
