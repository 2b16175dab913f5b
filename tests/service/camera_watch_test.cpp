// The watch over a camera's hold, on rendered rooms with all picture effects: what happens is known.
#include "tracker/camera_watch.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "service/sources/simulator.hpp"

namespace skylight::service::test {
namespace {

struct Watched {
  CameraWatch watch;
  SimulatorFrames room;
  Time start;
  std::optional<Time> moved, blind;  ///< when first told

  Watched(const std::string& scenario, double seconds, std::vector<std::string> changes)
      : room(run_of(scenario, seconds, std::move(changes))), start(room.start()) {}

  static ScenarioRun run_of(const std::string& scenario, double seconds, std::vector<std::string> changes) {
    changes.insert(changes.end(), {"cameras[0].frame_rate_hz=2", "cameras[0].depth.enabled=false"});
    ScenarioRun run = scenario_run(scenario, std::nullopt, changes);
    run.cut(seconds);
    return run;
  }
  bool step() {
    const auto frame = room.next();
    if (!frame) return false;
    const CameraHold hold = watch.look(*frame).hold;
    if (hold == CameraHold::moved && !moved) moved = frame->captured;
    if (hold == CameraHold::blind && !blind) blind = frame->captured;
    return true;
  }
  void play() {
    while (step()) {
    }
  }
  double seconds(Time at) const { return to_seconds(at - start); }
};

/// Between what the mean way of features lies, px, truth against calibration: of each part of the picture
/// that shows the room's floor one feature counts, wherever in that part it is; not what has left the
/// picture.
struct TrueShift {
  double least = 0.0, most = 0.0;
};

TrueShift true_shift(const SimulatorFrames& room) {
  constexpr int kSide = 8;    // parts, as the watch has them by default: 64 features
  constexpr int kSteps = 15;  // places looked at in a part
  const CameraModel& before = room.cameras().at(0).model;
  const CameraModel after(before.intrinsics(), room.map_from_camera(0));
  const Eigen::Array2d picture(before.intrinsics().width_px, before.intrinsics().height_px);
  const Eigen::Array2d part = picture / kSide;
  TrueShift sum;
  int parts = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int column = i % kSide;
    const int row = i / kSide;
    std::vector<double> ways;
    for (int k = 0; k < kSteps * kSteps; ++k) {
      const int x = k % kSteps;
      const int y = k / kSteps;
      const Pixel was = part * (Eigen::Array2d(column, row) + Eigen::Array2d(x + 0.5, y + 0.5) / kSteps);
      const auto floor = before.plane_from_pixel(was, 0.0);
      if (!floor || (floor->array().abs() > 0.5 * room.room_m().array()).any()) continue;
      const auto is = after.pixel_from_map({floor->x(), floor->y(), 0.0});
      if (is && after.sees(*is)) ways.push_back((*is - was).norm());
    }
    if (ways.size() < kSteps * kSteps / 10) continue;
    const auto [least, most] = std::minmax_element(ways.begin(), ways.end());
    sum.least += *least;
    sum.most += *most;
    ++parts;
  }
  return {sum.least / parts, sum.most / parts};
}

TEST(CameraWatch, ABumpIsNoticedWithinFiveSecondsWithItsSize) {
  for (const char* degrees : {"[0.2, 0.2, 0.1]", "[0.06, 0, 0]", "[0.7, 0.7, 0.2]", "[-3, 2, 0]"}) {
    Watched room("hard/bumped", 10.0, {"events[0].at_s=4", std::string("events[0].by_deg=") + degrees});
    room.play();
    ASSERT_TRUE(room.moved) << degrees;
    EXPECT_GT(room.seconds(*room.moved), 4.0) << degrees;
    EXPECT_LT(room.seconds(*room.moved), 9.0) << degrees;
    const TrueShift truth = true_shift(room.room);
    EXPECT_LT(truth.most, 1.27 * truth.least) << "else it tells little";
    EXPECT_GT(room.watch.report().shift_px, truth.least) << degrees;
    EXPECT_LT(room.watch.report().shift_px, truth.most) << degrees;
    EXPECT_LE(room.watch.report().since, *room.moved);
  }
}

TEST(CameraWatch, PeopleRobotsLightAndNoiseAreNoBump) {
  for (const char* scenario : {"hard/visitor", "hard/low-light", "hard/crossing", "hard/texture", "demo"}) {
    Watched room(scenario, 15.0, {});
    room.play();
    EXPECT_FALSE(room.moved) << scenario << ": told of " << room.watch.report().shift_px << " px";
  }
}

TEST(CameraWatch, AfterALearntCalibrationTheNewPlaceIsTheRightOne) {
  Watched room("hard/bumped", 12.0, {"events[0].at_s=3"});
  while (room.step() && !room.moved) {
  }
  ASSERT_TRUE(room.moved);
  room.watch.relearn();
  EXPECT_EQ(room.watch.report().hold, CameraHold::learning);
  room.play();
  EXPECT_EQ(room.watch.report().hold, CameraHold::steady);
  EXPECT_LT(room.watch.report().shift_px, 0.2);
}

Frame flat(const cv::Mat& image, double at_s) {
  Frame frame;
  frame.captured = Time{from_seconds(1000.0 + at_s)};
  frame.image = image;
  return frame;
}

TEST(CameraWatch, AFloorOfOneColourGivesNothingToHoldOnTo) {
  CameraWatch watch;
  const cv::Mat plain(480, 640, CV_8UC3, cv::Scalar(120, 120, 120));
  for (int i = 0; i < 20; ++i) watch.look(flat(plain, i));
  EXPECT_EQ(watch.report().hold, CameraHold::learning);
  EXPECT_EQ(watch.report().features, 0U);
}

TEST(CameraWatch, ACoveredLensIsBlindNotMovedAndAFlashIsForgotten) {
  cv::Mat floor(480, 640, CV_8UC1);
  cv::RNG noise(7);
  noise.fill(floor, cv::RNG::UNIFORM, 0, 255);
  cv::blur(floor, floor, {5, 5});
  const cv::Mat dark(floor.size(), CV_8UC1, cv::Scalar(3));
  CameraWatch watch;
  double t = 0.0;
  for (; t < 3.0; t += 0.5) watch.look(flat(floor, t));
  ASSERT_EQ(watch.report().hold, CameraHold::steady);
  EXPECT_EQ(watch.look(flat(dark, t += 0.5)).hold, CameraHold::steady) << "one dark frame";
  for (int i = 0; i < 4; ++i)
    EXPECT_EQ(watch.look(flat(floor, t += 0.5)).hold, CameraHold::steady) << "and after it";
  for (int i = 0; i < 5; ++i) watch.look(flat(dark, t += 0.5));
  EXPECT_EQ(watch.report().hold, CameraHold::blind);
  for (int i = 0; i < 5; ++i) watch.look(flat(floor, t += 0.5));
  EXPECT_EQ(watch.report().hold, CameraHold::steady);
}

TEST(CameraWatch, LooksNoMoreOftenThanItIsToldAndRefusesSettingsOutOfRange) {
  const cv::Mat empty;
  CameraWatch watch;
  const cv::Mat plain(48, 64, CV_8UC1, cv::Scalar(9));
  watch.look(flat(plain, 0.0));
  watch.look(flat(empty, 0.4));  // would throw if it were looked at
  EXPECT_THAT(check(CameraWatchConfig{.features = 4}),
              testing::HasSubstr("features is 4, allowed 9 to 1024"));
  EXPECT_THROW(CameraWatch({.least_share = 2.0}), std::invalid_argument);
}

}  // namespace
}  // namespace skylight::service::test
