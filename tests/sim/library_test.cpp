// Every scenario that comes with Skylight, for its first seconds: it runs, its pictures show something and
// its truth is sane. What each is for, and how trackers fare on it, is for skylight evaluate.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "sim/scenario/scenario_file.hpp"
#include "sim/simulation.hpp"

namespace skylight::sim {
namespace {

namespace fs = std::filesystem;

constexpr double kSeconds = 3.0;
constexpr double kMostFramesPerSecond = 3.0;

fs::path library() {
  return fs::path(SKYLIGHT_SOURCE_DIR) / "sim" / "scenarios";
}

std::vector<std::string> scenario_files() {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(library())) {
    if (entry.path().extension() == ".json") files.push_back(fs::relative(entry.path(), library()).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

class Library : public ::testing::TestWithParam<std::string> {};

void expect_sane_picture(const Shot& shot, const CameraSpec& camera) {
  ASSERT_EQ(shot.frame.image.type(), CV_8UC3);
  ASSERT_EQ(shot.frame.image.size(), cv::Size(camera.width_px, camera.height_px));
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(shot.frame.image, mean, deviation);
  EXPECT_GT(mean[1], 3.0) << "the picture is black";
  EXPECT_LT(mean[1], 250.0) << "the picture is white";
  EXPECT_GT(deviation[1], 1.0) << "the picture shows nothing";
  EXPECT_EQ(shot.frame.depth.empty(), !camera.depth.enabled);
  EXPECT_GE(shot.delivered, shot.truth.empty() ? shot.delivered : shot.truth[0].at);
}

void expect_sane_truth(const RobotTruth& robot, const RoomSpec& room) {
  EXPECT_TRUE(std::isfinite(robot.pose.yaw) && std::isfinite(robot.velocity.yaw_rate)) << robot.id;
  EXPECT_LE(std::abs(robot.pose.x), 0.5 * room.size_m[0]) << robot.id;
  EXPECT_LE(std::abs(robot.pose.y), 0.5 * room.size_m[1]) << robot.id;
  EXPECT_GE(robot.visible, 0.0);
  EXPECT_LE(robot.visible, 1.0);
  EXPECT_TRUE(robot.present || robot.visible == 0.0) << robot.id;
}

TEST_P(Library, RunsForItsFirstSeconds) {
  Scenario scenario = load_scenario(library() / GetParam());
  for (CameraSpec& camera : scenario.cameras)
    camera.frame_rate_hz = std::min(camera.frame_rate_hz, kMostFramesPerSecond);
  Simulation simulation(scenario);
  const Time end = simulation.now() + from_seconds(kSeconds);
  std::vector<int> frames(scenario.cameras.size());
  double seen = 0.0;
  for (auto shot = simulation.next(); shot && simulation.now() < end; shot = simulation.next()) {
    ++frames.at(shot->frame.camera);
    expect_sane_picture(*shot, scenario.cameras[shot->frame.camera]);
    ASSERT_EQ(shot->truth.size(), simulation.robots().size());
    for (const RobotTruth& robot : shot->truth) {
      expect_sane_truth(robot, scenario.room);
      seen = std::max(seen, robot.visible);
    }
  }
  for (const int count : frames) EXPECT_GE(count, 4);
  EXPECT_GT(seen, 0.7) << "no robot was ever to be seen as a whole";
}

std::string test_name(const ::testing::TestParamInfo<std::string>& file) {
  std::string name = file.param.substr(0, file.param.size() - 5);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, Library, ::testing::ValuesIn(scenario_files()), test_name);

}  // namespace
}  // namespace skylight::sim
