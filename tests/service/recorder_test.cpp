// What simulate writes is what was simulated.
#include "service/recorder.hpp"

#include <cmath>
#include <sstream>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "service/assembly.hpp"
#include "service/mot.hpp"
#include "service/sources/video.hpp"
#include "service/time_text.hpp"
#include "service/wire.hpp"
#include "tests/service/simulated_room.hpp"

namespace skylight::service::test {
namespace {

namespace fs = std::filesystem;

struct Tracked {
  std::vector<Time> captured;
  std::vector<std::optional<Pose2>> poses;
  std::size_t depths = 0;
};

void take(const Frame& frame, Tracker& tracker, Tracked& out) {
  const auto reports = tracker.process(frame);
  out.captured.push_back(frame.captured);
  out.poses.push_back(reports.at(0).measured ? std::optional(reports[0].measured->pose) : std::nullopt);
  out.depths += frame.depth.empty() ? 0 : 1;
}

// Lockstep, and written down as it goes.
Tracked record(const std::string& scenario, const fs::path& to, RecordingFormat format) {
  const auto simulator = std::make_shared<SimulatorFrames>(scenario_run(scenario, std::nullopt));
  Tracker tracker = make_tracker(assemble(Config{}, simulator));
  Recorder recorder(to, *simulator, format);
  Tracked out;
  while (const auto frame = simulator->next()) {
    recorder.write(*frame, simulator->truth());
    take(*frame, tracker, out);
  }
  recorder.finish(*simulator);
  return out;
}

// The folder as anybody would track it.
Tracked track(const fs::path& folder) {
  const Config config = load_config({.file = folder / "config.json"});
  const Assembly assembly = assemble(config);
  Tracker tracker = make_tracker(assembly);
  Tracked out;
  while (const auto frame = assembly.source->next()) take(*frame, tracker, out);
  return out;
}

double largest_difference(const Tracked& a, const Tracked& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < std::min(a.poses.size(), b.poses.size()); ++i) {
    if (a.poses[i].has_value() != b.poses[i].has_value()) return 1e9;
    if (!a.poses[i]) continue;
    largest =
        std::max({largest, std::abs(a.poses[i]->x - b.poses[i]->x), std::abs(a.poses[i]->y - b.poses[i]->y),
                  std::abs(wrap_angle(a.poses[i]->yaw - b.poses[i]->yaw))});
  }
  return largest;
}

class Recording : public testing::TestWithParam<RecordingFormat> {};

TEST_P(Recording, TrackedFromDiskItGivesThePosesOfTheLockstepRun) {
  const RoomFolder folder;
  // A frame rate whose period is no whole number of microseconds.
  const std::string scenario =
      folder.write("room.json", small_scenario("\"duration_s\": 0.5", R"("depth": {"enabled": true})"));
  const Tracked direct = record(scenario, folder.path / "out", GetParam());
  const Tracked again = track(folder.path / "out");
  ASSERT_EQ(direct.poses.size(), 15U);
  ASSERT_EQ(again.poses.size(), direct.poses.size());
  EXPECT_EQ(again.captured, direct.captured) << "to the nanosecond";
  EXPECT_EQ(again.depths, 15U);
  EXPECT_TRUE(direct.poses.back());
  // A lossy video is for looking at: a millimetre and half a degree is what it keeps.
  const double tolerance = GetParam() == RecordingFormat::mp4 ? 1e-2 : 1e-9;
  EXPECT_LT(largest_difference(direct, again), tolerance);
}

INSTANTIATE_TEST_SUITE_P(Formats, Recording,
                         testing::Values(RecordingFormat::png, RecordingFormat::video, RecordingFormat::mp4));

TEST(Recorder, WritesTruthOncePerCameraAndRobotUnderItsHeader) {
  const RoomFolder folder;
  record(folder.write("room.json", small_scenario("\"duration_s\": 0.2")), folder.path / "out",
         RecordingFormat::png);
  std::ifstream truth(folder.path / "out/truth.csv");
  std::string line;
  std::getline(truth, line);
  EXPECT_EQ(line, "camera,robot,captured,at,x,y,yaw,vx,vy,yaw_rate,present,in_view,visible,touches");
  const auto commas = std::count(line.begin(), line.end(), ',');
  std::size_t lines = 0;
  while (std::getline(truth, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), commas) << line;
    EXPECT_TRUE(line.starts_with("ceiling,anna,17000000")) << line;
    ++lines;
  }
  EXPECT_EQ(lines, 6U);
  for (const char* file : {"odometry.csv", "events.csv", "truth.anna.tum", "ceiling/mot/gt.txt"})
    EXPECT_TRUE(fs::exists(folder.path / "out" / file)) << file;
}

// Where a camera model of the tracker's own puts the middle of the robot's box, minus where the truth has it.
Eigen::Vector2d off_the_box(const SimulatorFrames& simulator, const Eigen::Isometry3d& map_from_camera) {
  const Truth& truth = simulator.truth().at(0);
  const CameraModel camera(simulator.cameras().at(0).model.intrinsics(), map_from_camera);
  const auto pixel = camera.pixel_from_map({truth.pose.x, truth.pose.y, 0.1});
  const cv::Point2d middle = (truth.box_px->tl() + truth.box_px->br()) / 2.0;
  return *pixel - Eigen::Vector2d(middle.x, middle.y);
}

TEST(Recorder, ABumpedCameraMovesTheBoxesAndIsNotedWhileTheTrackerIsToldNothing) {
  const RoomFolder folder;
  const std::string bump = R"("duration_s": 0.5, "events": [
      {"at_s": 0.2, "do": "bump", "camera": "ceiling", "by_mm": [100, 0, 0], "by_deg": [0, 0, 2]}])";
  SimulatorFrames simulator(scenario_run(folder.write("room.json", small_scenario(bump)), std::nullopt));
  const Eigen::Isometry3d hung = simulator.cameras().at(0).model.map_from_camera();
  Recorder recorder(folder.path / "out", simulator, RecordingFormat::png);
  ASSERT_TRUE(simulator.next());
  const Eigen::Vector2d before = off_the_box(simulator, hung);
  while (simulator.next()) continue;
  const Eigen::Isometry3d hangs = simulator.map_from_camera(0);
  EXPECT_LT((off_the_box(simulator, hangs) - before).norm(), 3.0) << "the body's rim turns with the view";
  EXPECT_GT((off_the_box(simulator, hung) - before).norm(), 15.0) << "250 px * 0.1 m / 1.5 m";
  EXPECT_LT((hangs.translation() - hung.translation() - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-9);

  recorder.finish(simulator);
  std::ifstream file(folder.path / "out/ceiling/moved.json");
  const Json moved = Json::parse(file);
  EXPECT_NEAR(moved["map_from_camera"]["position_m"][0].get<double>(), 0.1, 1e-9);
  const Config told = load_config({.file = folder.path / "out/config.json"});
  EXPECT_TRUE(camera_model(told.cameras.at(0)).map_from_camera().isApprox(hung, 1e-12));
}

TEST(Recorder, ARunIsCutOffWhereAnEventIsStillToCome) {
  const RoomFolder folder;
  const std::string late = R"("duration_s": 5, "events": [{"at_s": 3, "do": "light", "level": 0.5}])";
  ScenarioRun run = scenario_run(folder.write("late.json", small_scenario(late)), std::nullopt);
  run.cut(0.5);
  EXPECT_EQ(run.duration_s(), 0.5);
  SimulatorFrames cut(run);
  SimulatorFrames whole(
      scenario_run(folder.write("short.json", small_scenario("\"duration_s\": 0.5")), std::nullopt));
  EXPECT_EQ(cut.duration_s(), 0.5);
  while (const auto frame = whole.next()) {
    const auto same = cut.next();
    ASSERT_TRUE(same);
    EXPECT_EQ(same->captured, frame->captured);
    EXPECT_EQ(cv::norm(same->image, frame->image, cv::NORM_INF), 0.0);
  }
  EXPECT_FALSE(cut.next()) << "as many frames as a scenario of that length";
}

TEST(Recorder, ACameraThatHangsAsItDidIsNotNoted) {
  const RoomFolder folder;
  record(folder.write("room.json", small_scenario("\"duration_s\": 0.1")), folder.path / "out",
         RecordingFormat::png);
  EXPECT_FALSE(fs::exists(folder.path / "out/ceiling/moved.json"));
}

TEST(Recorder, APlaceThatCannotBeWrittenIsNamed) {
  const RoomFolder folder;
  const std::string scenario = folder.write("room.json", small_scenario("\"duration_s\": 0.1"));
  const SimulatorFrames simulator(scenario_run(scenario, std::nullopt));
  try {
    const Recorder recorder(fs::path(scenario) / "out", simulator, RecordingFormat::png);
    FAIL() << "a folder in a file";
  } catch (const std::exception& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("room.json"));
  }
}

std::vector<double> numbers(const std::string& line) {
  std::vector<double> out;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) out.push_back(std::stod(field));
  return out;
}

TEST(Mot, TruthAndResultsAreBoxesThatCountFromOne) {
  const Truth truth{.id = "anna",
                    .pose = {},
                    .velocity = {},
                    .visible = 0.75,
                    .touches = {},
                    .box_px = cv::Rect2d(-0.5, 9.5, 20, 30)};
  EXPECT_EQ(mot_truth_line(0, 2, truth), "1,3,1.00,11.00,20.00,30.00,1,1,0.750\n");
}

TEST(Mot, TheResultsBoxLiesWithinTheTruthsAndTellsThePlace) {
  const RoomFolder folder;
  const auto simulator = std::make_shared<SimulatorFrames>(
      scenario_run(folder.write("room.json", small_scenario("\"duration_s\": 0.2")), std::nullopt));
  const Assembly assembly = assemble(Config{}, simulator);
  const auto frame = simulator->next();
  ASSERT_TRUE(frame);
  const Truth& truth = simulator->truth().at(0);
  ASSERT_TRUE(truth.box_px);
  const auto whole = numbers(mot_truth_line(frame->sequence, 0, truth));
  const auto top =
      numbers(mot_result_line(*frame, 0, assembly.robots.at(0), truth.pose, assembly.cameras.at(0).model));
  ASSERT_EQ(top.size(), 10U);
  EXPECT_EQ(top[0], 1);
  EXPECT_EQ(top[1], 1);
  EXPECT_GE(top[2], whole[2] - 0.02);
  EXPECT_GE(top[3], whole[3] - 0.02);
  EXPECT_LE(top[2] + top[4], whole[2] + whole[4] + 0.02);
  EXPECT_LE(top[3] + top[5], whole[3] + whole[5] + 0.02);
  EXPECT_NEAR(top[7], truth.pose.x, 1e-6);
  EXPECT_NEAR(top[8], truth.pose.y, 1e-6);
}

TEST(TimeText, IsExactToTheNanosecondBothWays) {
  for (const std::int64_t count : {0LL, 1LL, 999'999'999LL, 1'700'000'000'000'000'000LL,
                                   1'700'000'000'008'333'333LL, 1'700'000'000'000'001'000LL}) {
    const Time time{Duration{count}};
    EXPECT_EQ(time_from_text(time_text(time)), time) << time_text(time);
  }
  EXPECT_EQ(time_text(Time{Duration{1'700'000'000'008'333'333}}), "1700000000.008333333");
  EXPECT_EQ(time_text(Time{Duration{1'700'000'000'250'000'000}}), "1700000000.250000");
  EXPECT_EQ(time_text(Time{Duration{-1}}), "-1.999999999") << "floor, and what is left";
}

TEST(TimeText, RefusesEverythingElse) {
  for (const char* text :
       {"", ".", "1.", ".5", "1e3", "-1", "+1", "1.0000000001", "9999999999999", "1 ", "nan"})
    EXPECT_FALSE(time_from_text(text)) << text;
}

}  // namespace
}  // namespace skylight::service::test
