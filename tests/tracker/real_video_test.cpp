// Real robots, 15 to 30 px wide with a few flat patches of colour, filmed from above: what users have.
// The places to judge by were read off the videos by eye; the cameras are nominal, because nobody gave their
// calibration: straight down, the same scale all over the floor, which a flat picture cannot tell from truth.
#include <cmath>
#include <iostream>
#include <map>
#include <numbers>
#include <sstream>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "tests/support/shared_data.hpp"
#include "tracker/tracker.hpp"

namespace skylight {
namespace {

constexpr double kMetresPerPx = 0.0033;

CameraModel nominal_camera(const cv::Size& size) {
  constexpr double kFocalPx = 500.0;
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  map_from_camera.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();  // straight down, image right is map x
  map_from_camera.translation().z() = kMetresPerPx * kFocalPx;
  return CameraModel({.width_px = size.width,
                      .height_px = size.height,
                      .fx_px = kFocalPx,
                      .fy_px = kFocalPx,
                      .cx_px = (size.width - 1) / 2.0,
                      .cy_px = (size.height - 1) / 2.0},
                     map_from_camera);
}

struct Cut {
  std::string id;
  Pixel middle_px;
  double side_px = 30.0;
};

// One robot in one frame, as seen in the picture.
struct Seen {
  std::size_t frame = 0;
  Pixel at_px;
  double yaw = 0.0;  ///< counter-clockwise
  TrackState state = TrackState::searching;
};
using Path = std::vector<Seen>;

struct Video {
  std::vector<cv::Mat> images;
  double rate_hz = 0.0;
};

Video load(const std::filesystem::path& file) {
  cv::VideoCapture capture(file.string());
  Video video{.images = {}, .rate_hz = capture.get(cv::CAP_PROP_FPS)};
  for (cv::Mat image; capture.read(image);) video.images.push_back(image.clone());
  return video;
}

Time frame_time(const Video& video, std::size_t i) {
  return Time{from_seconds(static_cast<double>(i) / video.rate_hz)};
}

struct Followed {
  std::map<std::string, Path> paths;                ///< frames in which a robot was measured
  std::map<std::string, Eigen::Vector2d> first_px;  ///< where it was cut
};

// Follows robots cut from the first frame; the one named `unplaced` is not told where it stands.
Followed follow(const Video& video, const std::vector<Cut>& cuts, const std::string& unplaced = "") {
  const CameraModel camera = nominal_camera(video.images.at(0).size());
  const Frame first{.captured = frame_time(video, 0), .image = video.images.at(0)};
  Tracker tracker({camera});
  Followed run;
  for (const Cut& cut : cuts) {
    const cv::Rect2d box(cut.middle_px.x() - cut.side_px / 2, cut.middle_px.y() - cut.side_px / 2,
                         cut.side_px, cut.side_px);
    Pose2 pose;
    const Picture picture = cut_from_frame(first, camera, {.box_px = box}, &pose);
    RobotSpec spec{.id = cut.id, .appearance = std::make_shared<const Appearance>(cut.id, picture)};
    if (cut.id != unplaced) spec.initial_pose = pose;
    tracker.add(spec);
    run.paths[cut.id] = {};
    run.first_px[cut.id] = cut.middle_px;
  }
  for (std::size_t i = 0; i < video.images.size(); ++i) {
    const Frame frame{.sequence = i, .captured = frame_time(video, i), .image = video.images[i]};
    for (const RobotReport& report : tracker.process(frame)) {
      if (!report.measured) continue;
      const Pose2& pose = report.measured->pose;
      run.paths[report.id].push_back({.frame = i,
                                      .at_px = *camera.pixel_from_map({pose.x, pose.y, 0.0}),
                                      .yaw = pose.yaw,
                                      .state = report.state});
    }
  }
  return run;
}

// Frames from the first one on in which a robot was not measured, for the message of a failed test.
std::string missing(const Path& path, std::size_t frames) {
  std::ostringstream text;
  text << "not measured in frames";
  std::size_t next = path.empty() ? 0 : path.front().frame;
  for (const Seen& seen : path) {
    for (; next < seen.frame; ++next) text << " " << next;
    next = seen.frame + 1;
  }
  for (; next < frames; ++next) text << " " << next;
  return text.str();
}

struct Spread {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< standard deviation per axis
  double yaw_deg = 0.0;
};

Spread spread_of(const Path& path) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  const auto values = [&](const Seen& seen) {
    return Eigen::Vector3d(seen.at_px.x(), seen.at_px.y(), wrap_angle(seen.yaw - path[0].yaw));
  };
  const auto count = static_cast<double>(path.size());
  for (const Seen& seen : path) mean += values(seen) / count;
  for (const Seen& seen : path) squares += (values(seen) - mean).cwiseAbs2() / count;
  return {.px = squares.head<2>().cwiseSqrt(), .yaw_deg = std::sqrt(squares[2]) * 180 / std::numbers::pi};
}

// Total turn from one frame to the next, counter-clockwise, degrees.
double turned_deg(const Path& path) {
  double turned = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) turned += wrap_angle(path[i].yaw - path[i - 1].yaw);
  return turned * 180.0 / std::numbers::pi;
}

// Where a point fixed to the robot, seen at `start_px` in the path's first frame, is in its last.
Pixel carried_px(const Path& path, const Pixel& start_px) {
  // The picture's y points down: a counter-clockwise yaw turns the other way in it.
  const Eigen::Rotation2Dd turn(-(path.back().yaw - path.front().yaw));
  return path.back().at_px + turn * (start_px - path.front().at_px);
}

void expect_stands_still(const Followed& run, const std::string& id, const Eigen::Vector2d& px,
                         double yaw_deg) {
  const Path& path = run.paths.at(id);
  ASSERT_FALSE(path.empty()) << id;
  const Spread spread = spread_of(path);
  std::cout << id << ": measured in " << path.size() << " frames, spread " << spread.px.transpose() << " px, "
            << spread.yaw_deg << " deg\n";
  EXPECT_LT(spread.px.x(), px.x()) << id;
  EXPECT_LT(spread.px.y(), px.y()) << id;
  EXPECT_LT(spread.yaw_deg, yaw_deg) << id;
  for (const Seen& seen : path) {
    EXPECT_LT((seen.at_px - run.first_px.at(id)).norm(), 3.0) << id << " in frame " << seen.frame;
  }
}

void expect_apart(const Followed& run, double least_px) {
  for (const auto& [a, path_a] : run.paths) {
    for (const auto& [b, path_b] : run.paths) {
      if (a >= b) continue;
      std::map<std::size_t, Pixel> places;
      for (const Seen& seen : path_a) places[seen.frame] = seen.at_px;
      for (const Seen& seen : path_b) {
        const auto at = places.find(seen.frame);
        if (at == places.end()) continue;
        EXPECT_GT((at->second - seen.at_px).norm(), least_px) << a << ", " << b << ", frame " << seen.frame;
      }
    }
  }
}

const std::vector<Cut> kMoveCuts = {{"blue_green", {208, 111}, 30},
                                    {"yellow_red", {462, 48}, 30},
                                    {"yellow_pink", {524, 210}, 34},
                                    {"blue_pink", {222, 368}, 34},
                                    {"blue_magenta", {120, 225}, 34}};

void expect_the_journey(const Path& path) {
  const Pixel blue = carried_px(path, {203, 106});
  std::cout << "blue_green ends at " << path.back().at_px.transpose() << ", blue patch at "
            << blue.transpose() << ", turned by " << turned_deg(path) << " deg\n";
  EXPECT_LT((path.back().at_px - Pixel(331, 117)).norm(), 3.0);
  EXPECT_LT((blue - Pixel(336, 112)).norm(), 3.0);
  EXPECT_NEAR(turned_deg(path), -82.0, 3.0);  // clockwise: the blue patch goes from the left to the right
}

TEST(RealVideo, ARobotThatDrivesIsHeldInEveryFrameAndThoseThatStandStandStill) {
  const auto file = test::shared_data("overhead/vss_sdk/videos/robot_move.mp4");
  if (!file) GTEST_SKIP() << "overhead/vss_sdk is not in the shared data";
  const Video video = load(*file);
  ASSERT_EQ(video.images.size(), 502U);
  const Followed run = follow(video, kMoveCuts);
  const Path& path = run.paths.at("blue_green");
  EXPECT_EQ(path.size(), 502U) << missing(path, video.images.size());
  ASSERT_FALSE(path.empty());
  expect_the_journey(path);
  for (const char* id : {"yellow_red", "yellow_pink", "blue_pink", "blue_magenta"})
    expect_stands_still(run, id, {0.3, 0.3}, 0.3);
  expect_apart(run, 10.0);
}

TEST(RealVideo, ARobotWhosePlaceNobodyToldIsFoundWithinThreeSeconds) {
  const auto file = test::shared_data("overhead/vss_sdk/videos/robot_move.mp4");
  if (!file) GTEST_SKIP() << "overhead/vss_sdk is not in the shared data";
  const Video video = load(*file);
  for (const char* id : {"blue_green", "yellow_red"}) {
    SCOPED_TRACE(id);
    const Followed run = follow(video, kMoveCuts, id);
    const Path& path = run.paths.at(id);
    ASSERT_FALSE(path.empty());
    std::cout << id << " found in frame " << path.front().frame << "\n";
    EXPECT_LT(path.front().frame, 90U);
    EXPECT_EQ(path.size(), video.images.size() - path.front().frame) << missing(path, video.images.size());
    if (std::string(id) == "blue_green") {
      EXPECT_LT((path.back().at_px - Pixel(331, 117)).norm(), 3.0);
    } else {
      expect_stands_still(run, id, {0.3, 0.3}, 0.3);
    }
    expect_apart(run, 10.0);
  }
}

// What noise alone must leave of a place in the picture, pixels: the least standard deviation that any
// unbiased estimator has (Cramer-Rao), from the noise over time of each pixel in the box and the slopes of
// their mean. Slopes are central differences; x, y and the turn are taken as one problem.
Eigen::Vector3d least_spread(const Video& video, const Cut& cut) {
  const int side = static_cast<int>(cut.side_px);
  const cv::Rect box(static_cast<int>(cut.middle_px.x()) - side / 2,
                     static_cast<int>(cut.middle_px.y()) - side / 2, side, side);
  cv::Mat sum(box.size(), CV_64FC3, cv::Scalar::all(0));
  cv::Mat squares = sum.clone();
  for (const cv::Mat& image : video.images) {
    cv::accumulate(image(box), sum);
    cv::accumulateSquare(image(box), squares);
  }
  const cv::Mat mean = sum / static_cast<double>(video.images.size());
  const cv::Mat variance = squares / static_cast<double>(video.images.size()) - mean.mul(mean);
  const cv::Scalar noise = cv::mean(variance);
  const double noise_variance = (noise[0] + noise[1] + noise[2]) / 3.0;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (int v = 1; v + 1 < side; ++v) {
    for (int u = 1; u + 1 < side; ++u) {
      for (int c = 0; c < 3; ++c) {
        const double slope_u = (mean.at<cv::Vec3d>(v, u + 1)[c] - mean.at<cv::Vec3d>(v, u - 1)[c]) / 2;
        const double slope_v = (mean.at<cv::Vec3d>(v + 1, u)[c] - mean.at<cv::Vec3d>(v - 1, u)[c]) / 2;
        const double turn = (u - side / 2.0) * slope_v - (v - side / 2.0) * slope_u;
        const Eigen::Vector3d slope(slope_u, slope_v, turn);
        information += slope * slope.transpose() / noise_variance;
      }
    }
  }
  return information.inverse().diagonal().cwiseSqrt();
}

TEST(RealVideo, RobotsThatStandMoveNoMoreThanTheNoiseOfThePictureMakesThem) {
  const auto file = test::shared_data("overhead/robocin_vss/static.mp4");
  if (!file) GTEST_SKIP() << "overhead/robocin_vss is not in the shared data";
  const Video video = load(*file);
  ASSERT_EQ(video.images.size(), 375U);
  const std::vector<Cut> cuts = {{"navy_blue", {250, 211}, 30}, {"green_lime", {428, 178}, 32},
                                 {"red_lime", {447, 358}, 30},  {"orange_navy", {50, 280}, 32},
                                 {"navy_green", {75, 380}, 28}, {"blue_lime", {70, 412}, 30}};
  const Followed run = follow(video, cuts);
  for (const Cut& cut : cuts) {
    SCOPED_TRACE(cut.id);
    EXPECT_EQ(run.paths.at(cut.id).size(), video.images.size());
    // A video's noise is no white one: its coder works on blocks of 8 x 8, so that in the worst case 64
    // pixels tell no more than one, and the spread is 8 times that of as many independent ones.
    const Eigen::Vector3d bound = 8.0 * least_spread(video, cut);
    std::cout << "bounds " << bound.head<2>().transpose() << " px, " << bound[2] * 180 / std::numbers::pi
              << " deg; ";
    expect_stands_still(run, cut.id, bound.head<2>(), bound[2] * 180 / std::numbers::pi);
  }
  expect_apart(run, 10.0);
}

}  // namespace
}  // namespace skylight
