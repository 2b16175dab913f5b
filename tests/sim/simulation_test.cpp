// The simulator as its users see it: frames, truth, artwork, repeatability.
#include "sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "sim/camera/camera_model.hpp"

namespace skylight::sim {
namespace {

/// A small room with one robot that drives a circle, quick to draw.
Scenario small_scenario() {
  Scenario scenario;
  scenario.room.size_m = {3.0, 3.0};
  CameraSpec& camera = scenario.cameras.front();
  camera.width_px = 480;
  camera.height_px = 360;
  camera.fx_px = camera.fy_px = 380.0;
  camera.position_m = {0.0, 0.0, 3.0};
  camera.depth.enabled = true;
  RobotSpec robot;
  robot.id = "a";
  robot.start = {0.6, 0.0, 90.0};
  robot.program = {{ArcStep{0.6, 360.0, 0.2}}};
  scenario.robots = {robot};
  return scenario;
}

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

TEST(Simulation, GivesTheSameBytesForTheSameSeedAndOtherNoiseForAnother) {
  const Scenario scenario = small_scenario();
  Scenario reseeded = scenario;
  reseeded.seed = scenario.seed + 1;
  reseeded.room.floor.material = FloorMaterial::plain;  // the same floor: what differs is noise
  Scenario plain = scenario;
  plain.room.floor.material = FloorMaterial::plain;
  Simulation first(scenario);
  Simulation second(scenario);
  Simulation floor(plain);
  Simulation other(reseeded);
  for (int i = 0; i < 5; ++i) {
    const auto a = first.next();
    const auto b = second.next();
    const auto c = other.next();
    const auto d = floor.next();
    ASSERT_TRUE(a && b && c && d);
    EXPECT_TRUE(same_bytes(a->frame.image, b->frame.image));
    EXPECT_TRUE(same_bytes(a->frame.depth, b->frame.depth));
    EXPECT_EQ(a->truth[0].pose, b->truth[0].pose);
    EXPECT_EQ(a->truth[0].velocity, b->truth[0].velocity);
    EXPECT_EQ(a->truth[0].pose, c->truth[0].pose);
    EXPECT_FALSE(same_bytes(d->frame.image, c->frame.image));
    EXPECT_FALSE(same_bytes(d->frame.depth, c->frame.depth));
  }
}

TEST(Simulation, DoesNotDependOnTheNumberOfThreads) {
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  Simulation one(small_scenario());
  cv::setNumThreads(4);
  Simulation four(small_scenario());
  cv::setNumThreads(threads);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(same_bytes(one.next()->frame.image, four.next()->frame.image));
}

TEST(Simulation, HasFreshNoiseInEveryFrame) {
  Scenario scenario = small_scenario();
  scenario.robots[0].program = {};
  Simulation simulation(scenario);
  const auto a = simulation.next();
  const auto b = simulation.next();
  EXPECT_EQ(a->truth[0].pose, b->truth[0].pose);
  EXPECT_FALSE(same_bytes(a->frame.image, b->frame.image));
}

TEST(Simulation, StampsTheMiddleOfTheExposureAndCountsFrames) {
  Simulation simulation(small_scenario());
  for (std::uint64_t i = 0; i < 4; ++i) {
    const auto shot = simulation.next();
    ASSERT_TRUE(shot);
    EXPECT_EQ(shot->frame.sequence, i);
    EXPECT_EQ(shot->frame.image.type(), CV_8UC3);
    EXPECT_EQ(shot->frame.depth.type(), CV_16UC1);
    const double since =
        to_seconds(shot->frame.captured.time_since_epoch() - std::chrono::seconds(1700000000));
    EXPECT_NEAR(since, 0.004 + static_cast<double>(i) / 30.0, 1e-8);
  }
}

TEST(Simulation, EndsWithItsDurationAndGivesNoDepthWithoutADepthCamera) {
  Scenario scenario = small_scenario();
  scenario.duration_s = 0.5;
  scenario.cameras[0].depth.enabled = false;
  Simulation simulation(scenario);
  int frames = 0;
  while (const auto shot = simulation.next()) {
    EXPECT_TRUE(shot->frame.depth.empty());
    ++frames;
  }
  EXPECT_EQ(frames, 15);  // the 15th exposure ends at 0.4747 s, the 16th would at 0.508 s
  EXPECT_FALSE(simulation.next());
}

TEST(Simulation, SeveralCamerasTakeTheirFramesInTheOrderOfTime) {
  Scenario scenario = small_scenario();
  scenario.cameras.push_back(scenario.cameras[0]);
  scenario.cameras[1].id = "second";
  scenario.cameras[1].frame_rate_hz = 20.0;
  scenario.cameras[1].exposure_s = 0.04;
  scenario.duration_s = 0.4;
  Simulation simulation(scenario);
  Time last{};
  std::array<int, 2> frames{};
  while (const auto shot = simulation.next()) {
    EXPECT_GE(shot->frame.captured, last);
    last = shot->frame.captured;
    ++frames.at(shot->frame.camera);
  }
  EXPECT_EQ(frames[0], 12);
  EXPECT_EQ(frames[1], 8);
}

TEST(Simulation, TruthIsTheMotionThatWasAskedFor) {
  Scenario scenario = small_scenario();
  scenario.cameras[0].width_px = 64;  // the picture does not matter here
  scenario.cameras[0].height_px = 48;
  Simulation simulation(scenario);
  std::optional<Shot> before = simulation.next();
  for (int i = 0; i < 90; ++i) before = simulation.next();  // 3 s: at speed
  for (int i = 0; i < 100; ++i) {
    const auto now = simulation.next();
    const RobotTruth& a = before->truth[0];
    const RobotTruth& b = now->truth[0];
    EXPECT_NEAR(b.pose.position().norm(), 0.6, 0.002);
    EXPECT_NEAR(std::hypot(b.velocity.x, b.velocity.y), 0.2, 0.002);
    EXPECT_NEAR(b.velocity.yaw_rate, 0.2 / 0.6, 0.005);
    // Velocity is the rate of the pose: the mean of two frames' against their difference.
    EXPECT_NEAR((b.pose.x - a.pose.x) * 30.0, 0.5 * (a.velocity.x + b.velocity.x), 2e-4);
    EXPECT_NEAR((b.pose.y - a.pose.y) * 30.0, 0.5 * (a.velocity.y + b.velocity.y), 2e-4);
    EXPECT_NEAR(wrap_angle(b.pose.yaw - a.pose.yaw) * 30.0, 0.5 * (a.velocity.yaw_rate + b.velocity.yaw_rate),
                2e-3);
    before = now;
  }
}

TEST(Simulation, TellsWhetherARobotIsInView) {
  Scenario scenario = small_scenario();
  scenario.room.size_m = {12.0, 12.0};
  scenario.robots[0].start = {5.0, 5.0, 0.0};
  scenario.robots[0].program = {};
  RobotSpec visible = scenario.robots[0];
  visible.id = "b";
  visible.start = {1.0, -0.5, 0.0};
  scenario.robots.push_back(visible);
  const auto shot = Simulation(scenario).next();
  EXPECT_FALSE(shot->truth[0].in_view);
  EXPECT_TRUE(shot->truth[1].in_view);
}

/// Correlation of the artwork's grey, put into the frame at the true pose, with the frame. `mirrored`: left
/// and right exchanged.
double agreement(const Simulation& simulation, const Shot& shot, bool mirrored) {
  const RobotPicture picture = simulation.picture(0);
  const CameraModel camera = camera_model(simulation.scenario().cameras[0]);
  cv::Mat artwork;
  cv::cvtColor(picture.image, artwork, cv::COLOR_BGRA2GRAY);
  cv::GaussianBlur(artwork, artwork, {}, 4.0);  // as the camera's pixels do, about 8 mm wide
  cv::Mat frame;
  cv::cvtColor(shot.frame.image, frame, cv::COLOR_BGR2GRAY);
  frame.convertTo(frame, CV_32F);
  const Pose2 pose = shot.truth[0].pose;
  std::vector<double> a;
  std::vector<double> b;
  for (int r = 12; r < artwork.rows - 12; r += 3) {
    for (int c = 12; c < artwork.cols - 12; c += 3) {
      const Eigen::Vector2d local(
          ((artwork.rows - 1) / 2.0 - r) * picture.metres_per_pixel - picture.reference_point_m.x(),
          ((artwork.cols - 1) / 2.0 - c) * picture.metres_per_pixel - picture.reference_point_m.y());
      if ((local - Eigen::Vector2d(-0.049, 0.0)).norm() < 0.085) continue;  // the lidar, and what it hides
      const Eigen::Vector2d at = pose.position() + Eigen::Rotation2Dd(pose.yaw) * local;
      const auto pixel = camera.project_map({at.x(), at.y(), picture.surface_height_m});
      cv::Mat value;
      cv::getRectSubPix(frame, {1, 1}, {static_cast<float>(pixel->x()), static_cast<float>(pixel->y())},
                        value);
      a.push_back(artwork.at<std::uint8_t>(r, mirrored ? artwork.cols - 1 - c : c));
      b.push_back(static_cast<double>(value.at<float>(0, 0)));
    }
  }
  const cv::Mat x = cv::Mat(a) - cv::mean(a)[0];
  const cv::Mat y = cv::Mat(b) - cv::mean(b)[0];
  return x.dot(y) / std::sqrt(x.dot(x) * y.dot(y));
}

TEST(Simulation, TheArtworkLiesOnTheRobotAsRobotPictureSays) {
  for (const double yaw : {0.0, 100.0, -130.0}) {
    Scenario scenario = small_scenario();
    scenario.robots[0].program = {};
    scenario.robots[0].start = {-0.4, 0.3, yaw};
    Simulation simulation(scenario);
    const auto shot = simulation.next();
    EXPECT_GT(agreement(simulation, *shot, false), 0.95) << yaw;
    EXPECT_LT(agreement(simulation, *shot, true), 0.6) << yaw;
  }
}

TEST(Simulation, RobotsHaveDifferentPicturesUnlessAskedToBeTheSame) {
  Scenario scenario = small_scenario();
  RobotSpec second = scenario.robots[0];
  second.id = "b";
  second.start = {-0.6, 0.0, 0.0};
  scenario.robots.push_back(second);
  EXPECT_FALSE(same_bytes(Simulation(scenario).picture(0).image, Simulation(scenario).picture(1).image));
  scenario.robots[0].picture.seed = scenario.robots[1].picture.seed = 9;
  EXPECT_TRUE(same_bytes(Simulation(scenario).picture(0).image, Simulation(scenario).picture(1).image));
  const RobotPicture picture = Simulation(scenario).picture(0);
  EXPECT_EQ(picture.image.type(), CV_8UC4);
  const int lidar_row = static_cast<int>((picture.image.rows - 1) / 2.0 - 0.015 / picture.metres_per_pixel);
  EXPECT_EQ(picture.image.at<cv::Vec4b>(lidar_row, picture.image.cols / 2)[3], 0);
  EXPECT_EQ(picture.image.at<cv::Vec4b>(5, 5)[3], 255);
  EXPECT_THROW(Simulation(scenario).picture(2), std::out_of_range);
}

TEST(Simulation, AMovedSimulationGoesOn) {
  Simulation first(small_scenario());
  first.next();
  Simulation second = std::move(first);
  EXPECT_EQ(second.next()->frame.sequence, 1U);
}

EventSpec at(double time_s, Action action) {
  EventSpec event;
  event.at_s = time_s;
  event.action = std::move(action);
  return event;
}

TEST(Simulation, ACameraThatFreezesRepeatsItsPictureAndOneThatIsBlackLeavesAGap) {
  Scenario scenario = small_scenario();
  scenario.duration_s = 1.0;
  const std::string camera = scenario.cameras[0].id;
  scenario.events = {at(0.3, FreezeAction{.camera = camera, .for_s = 0.2}),
                     at(0.6, BlackoutAction{.camera = camera, .for_s = 0.2})};
  Simulation simulation(scenario);
  cv::Mat last;
  std::uint64_t expected = 0;
  bool gap = false;
  while (const auto shot = simulation.next()) {
    const double time = to_seconds(shot->truth[0].at.time_since_epoch()) - scenario.start_unix_s;
    EXPECT_FALSE(time >= 0.601 && time < 0.799) << time;
    gap = gap || shot->frame.sequence != expected;
    expected = shot->frame.sequence + 1;
    const bool same = !last.empty() && cv::norm(last, shot->frame.image, cv::NORM_INF) == 0.0;
    EXPECT_EQ(same, time >= 0.301 && time < 0.499) << time;
    last = shot->frame.image.clone();
  }
  EXPECT_TRUE(gap);
}

TEST(Simulation, TheLightGoesEvenlyToItsNewLevel) {
  Scenario scenario = small_scenario();
  scenario.duration_s = 1.0;
  scenario.light.flicker.depth = 0.0;
  scenario.events = {at(0.2, LightAction{.level = 0.5, .over_s = 0.4})};
  Simulation simulation(scenario);
  std::optional<double> full;
  while (const auto shot = simulation.next()) {
    const double time = to_seconds(shot->truth[0].at.time_since_epoch()) - scenario.start_unix_s;
    const double grey = cv::mean(shot->frame.image)[1];
    if (!full) full = grey;
    const double level = 1.0 - 0.5 * std::clamp((time - 0.2) / 0.4, 0.0, 1.0);
    EXPECT_NEAR(grey / *full, level, 0.03) << time;
  }
}

}  // namespace
}  // namespace skylight::sim
