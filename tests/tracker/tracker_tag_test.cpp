// Robots with tags in the tracker: alone, beside a picture, and when one of the two cannot be seen.
#include <thread>

#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"
#include "tracker/tracker.hpp"

namespace skylight {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kCellPx = 12;  // of a tag on a picture of 1 mm a pixel: 96 mm between the corners

Time at_frame(int frame) {
  return Time{} + from_seconds(1000.0 + frame / 30.0);
}

TagSpec tag_spec(int id) {
  return {.id = id, .size_m = 8 * kCellPx * 0.001, .height_m = 0.1};
}

// The tag in the middle, upright, white rim and all.
cv::Mat with_tag(cv::Mat image, int id) {
  const TagPattern pattern = tag_pattern("36h11", id);
  const int side = kCellPx * pattern.cells.cols;
  const cv::Point corner((image.cols - side) / 2, (image.rows - side) / 2);
  for (int r = 0; r < pattern.cells.rows; ++r) {
    for (int c = 0; c < pattern.cells.cols; ++c) {
      const double grey = pattern.cells.at<std::uint8_t>(r, c) != 0 ? 230 : 25;
      cv::rectangle(image, cv::Rect(corner.x + c * kCellPx, corner.y + r * kCellPx, kCellPx, kCellPx),
                    cv::Scalar(grey, grey, grey), cv::FILLED);
    }
  }
  return image;
}

cv::Mat bare(int side_px = 240) {
  return {side_px, side_px, CV_8UC3, cv::Scalar(70, 70, 70)};
}

test::FlatScene scene_of(std::vector<test::PlacedPicture> pictures) {
  test::FlatScene scene;
  scene.noise = 2.0;
  scene.seed = 5;
  scene.floor_speckle = 600;
  scene.pictures = std::move(pictures);
  return scene;
}

// A frame that was drawn once, at another time.
Frame again(Frame frame, int at) {
  frame.captured = at_frame(at);
  return frame;
}

// Driving an arc of 0.3 m/s.
Pose2 on_arc(int frame) {
  const double s = 0.01 * frame;
  return {-0.5 + 0.5 * std::sin(s), 0.5 * (1 - std::cos(s)) - 0.3, wrap_angle(s)};
}

void expect_at(const RobotReport& report, const Pose2& truth, PoseSource source) {
  ASSERT_TRUE(report.measured) << report.id << ": " << report.reason;
  EXPECT_EQ(report.measured->source, source);
  EXPECT_LT((report.measured->pose.position() - truth.position()).norm(), 0.001);
  EXPECT_NEAR(wrap_angle(report.measured->pose.yaw - truth.yaw), 0.0, 0.5 * kDegree);
}

TEST(TrackerTags, ARobotWithATagAloneIsSearchedForAndFollowed) {
  test::FlatScene scene = scene_of({{.image = with_tag(bare(), 7), .pose = on_arc(0)}});
  scene.noise = 0.0;
  Tracker tracker({scene.camera()});
  tracker.add({.id = "anna", .tag = tag_spec(7), .detector = DetectorKind::apriltag});
  int first = -1;
  for (int i = 0; i < 25; ++i) {
    scene.pictures[0].pose = on_arc(i);
    const auto reports = tracker.process(scene.render(at_frame(i)));
    if (first < 0 && reports[0].measured) first = i;
    if (first >= 0) expect_at(reports[0], on_arc(i), PoseSource::apriltag);
  }
  // 640 x 480 in tiles of 256 px: 3 x 2, three a frame while nobody is tracked.
  EXPECT_GE(first, 0);
  EXPECT_LE(first, 2);
  EXPECT_EQ(tracker.views()[0].state, TrackState::tracking);
}

TEST(TrackerTags, ATagWhereTheFloorIsMaskedIsNoRobot) {
  const test::FlatScene scene = scene_of({{.image = with_tag(bare(), 7), .pose = {0.2, -0.3, 0.7}}});
  TrackerConfig config;
  config.floor_masks = {{.name = "shelf", .corners = {{0.1, -0.4}, {0.3, -0.4}, {0.3, -0.2}, {0.1, -0.2}}}};
  Tracker tracker({scene.camera()}, config);
  tracker.add({.id = "anna", .tag = tag_spec(7), .detector = DetectorKind::apriltag});
  std::string reason;
  for (int i = 0; i < 4; ++i) {  // more than all tiles
    const auto reports = tracker.process(scene.render(at_frame(i)));
    EXPECT_FALSE(reports[0].measured) << i;
    reason += reports[0].reason;
  }
  EXPECT_THAT(reason, testing::HasSubstr("its tag lies where the floor is masked"));
}

TEST(TrackerTags, AMountedTagTellsWhereBaseLinkIs) {
  test::FlatScene scene = scene_of({{.image = with_tag(bare(), 7), .pose = {0.2, -0.3, 0.7}}});
  TagSpec tag = tag_spec(7);
  tag.mounting = {0.05, 0.02, 0.4};
  Tracker tracker({scene.camera()});
  tracker.add(
      {.id = "anna", .tag = tag, .detector = DetectorKind::apriltag, .initial_pose = Pose2{0.15, -0.3, 0.3}});
  const auto reports = tracker.process(scene.render(at_frame(0)));
  const double yaw = 0.7 - 0.4;
  const Eigen::Vector2d base =
      Eigen::Vector2d(0.2, -0.3) - Eigen::Rotation2Dd(yaw) * Eigen::Vector2d(0.05, 0.02);
  expect_at(reports[0], {base.x(), base.y(), yaw}, PoseSource::apriltag);
}

struct Covered {
  RobotSpec robot;
  Pose2 pose;
  CameraModel camera;
  Frame open, picture_covered, tag_covered, all_covered;
};

Covered covered_robot() {
  const test::PlacedPicture whole{.image = with_tag(test::corner_picture(51), 7), .pose = {0.1, 0.2, 0.5}};
  test::PlacedPicture tag_alone = whole;
  tag_alone.image = with_tag(bare(), 7);
  test::PlacedPicture without = whole;
  const int side = 10 * kCellPx;
  cv::Mat image = whole.image.clone();
  cv::rectangle(image, cv::Rect((240 - side) / 2, (240 - side) / 2, side, side), cv::Scalar(200, 200, 200),
                cv::FILLED);
  without.image = image;
  test::PlacedPicture nothing = whole;
  nothing.image = bare();
  return {{.id = "anna",
           .appearance = test::appearance_of(whole),
           .tag = tag_spec(7),
           .initial_pose = whole.pose},
          whole.pose,
          scene_of({whole}).camera(),
          scene_of({whole}).render(),
          scene_of({tag_alone}).render(),
          scene_of({without}).render(),
          scene_of({nothing}).render()};
}

TEST(TrackerTags, TheTagTakesOverWhileThePictureIsCoveredAndGivesBack) {
  const Covered covered = covered_robot();
  Tracker tracker({covered.camera});
  tracker.add(covered.robot);
  for (int i = 0; i < 60; ++i) {
    const bool is_covered = i >= 10 && i < 40;
    const auto reports = tracker.process(again(is_covered ? covered.picture_covered : covered.open, i));
    if (i < 10) expect_at(reports[0], covered.pose, PoseSource::align);
    if (is_covered) expect_at(reports[0], covered.pose, PoseSource::apriltag);
    if (i >= 50) {  // its picture had rested, a third of a second at most
      ASSERT_TRUE(reports[0].measured);
      EXPECT_NE(reports[0].measured->source, PoseSource::apriltag) << i;
    }
  }
}

TEST(TrackerTags, ThePictureCarriesOnWhileTheTagIsCovered) {
  const Covered covered = covered_robot();
  Tracker tracker({covered.camera});
  tracker.add(covered.robot);
  for (int i = 0; i < 40; ++i) {
    const auto reports = tracker.process(again(i < 10 ? covered.open : covered.tag_covered, i));
    expect_at(reports[0], covered.pose, PoseSource::align);
  }
}

TEST(TrackerTags, WithBothCoveredThereIsNoObservationAndAReason) {
  const Covered covered = covered_robot();
  Tracker tracker({covered.camera});
  tracker.add(covered.robot);
  for (int i = 0; i < 25; ++i) {
    const auto reports = tracker.process(again(i < 5 ? covered.open : covered.all_covered, i));
    EXPECT_EQ(reports[0].measured.has_value(), i < 5);
    EXPECT_EQ(reports[0].reason.empty(), i < 5);
  }
}

TEST(TrackerTags, TheTagTellsARobotFromItsLookAlike) {
  // The same picture twice but for the tags' bits. Anna is said to stand where ben does.
  const test::PlacedPicture anna{.image = with_tag(test::corner_picture(51), 7), .pose = {-0.6, 0.3, 0.4}};
  const test::PlacedPicture ben{.image = with_tag(test::corner_picture(51), 8), .pose = {0.7, -0.4, 2.0}};
  const test::FlatScene scene = scene_of({anna, ben});
  const Frame frame = scene.render();
  TrackerConfig config;
  config.tags.sweep_interval = 1;
  Tracker tracker({scene.camera()}, config);
  tracker.add(
      {.id = "anna", .appearance = test::appearance_of(anna), .tag = tag_spec(7), .initial_pose = ben.pose});
  int first = -1;
  for (int i = 0; i < 40; ++i) {
    const auto reports = tracker.process(again(frame, i));
    const bool home =
        reports[0].measured && (reports[0].measured->pose.position() - anna.pose.position()).norm() < 0.001;
    if (home && first < 0) first = i;
    EXPECT_TRUE(home || first < 0) << "and stays there, frame " << i;
    EXPECT_FALSE(home && i == 0);
  }
  EXPECT_GE(first, 1);
}

TEST(TrackerTags, ContradictionsAreThoseBeyondNoiseAndMounting) {
  Observation a{.pose = {1.0, 2.0, 3.14}, .covariance = Eigen::Vector3d(1e-8, 1e-8, 1e-6).asDiagonal()};
  Observation b = a;
  EXPECT_FALSE(contradict(a, b));
  b.pose = {1.003, 2.0, -3.14};  // 3 mm, and 0.2 degrees across the seam
  EXPECT_FALSE(contradict(a, b));
  b.pose = {1.02, 2.0, 3.14};
  EXPECT_TRUE(contradict(a, b));
  b.covariance(0, 0) = 0.01 * 0.01;
  EXPECT_FALSE(contradict(a, b));
  b.pose = {1.0, 2.0, 3.0};
  EXPECT_TRUE(contradict(a, b));
}

TEST(TrackerTags, RobotsWithoutOneAreTrackedAsIfThereWereNone) {
  const test::PlacedPicture plain{.image = test::corner_picture(51), .pose = {-0.6, 0.3, 0.4}};
  const test::PlacedPicture tagged{.image = with_tag(bare(), 8), .pose = {0.7, -0.4, 2.0}};
  const test::FlatScene scene = scene_of({plain, tagged});
  Tracker alone({scene.camera()});
  Tracker together({scene.camera()});
  const RobotSpec robot{.id = "plain", .appearance = test::appearance_of(plain)};
  alone.add(robot);
  together.add(robot);
  together.add(
      {.id = "tagged", .tag = tag_spec(8), .detector = DetectorKind::apriltag, .initial_pose = tagged.pose});
  const Frame drawn = scene.render();
  bool seen = false;
  for (int i = 0; i < 30; ++i) {
    const Frame frame = again(drawn, i);
    const auto a = alone.process(frame);
    const auto b = together.process(frame);
    EXPECT_TRUE(b[1].measured) << i;
    if (!a[0].measured || !b[0].measured) continue;
    seen = true;
    EXPECT_LT((a[0].measured->pose.position() - b[0].measured->pose.position()).norm(), 0.001);
  }
  EXPECT_TRUE(seen);
}

TEST(TrackerTags, GiveTheSameAnswersWhateverTheExecutor) {
  const Executor threads = [](std::size_t count, const std::function<void(std::size_t)>& task) {
    std::vector<std::thread> pool;
    for (std::size_t i = 0; i < count; ++i) pool.emplace_back([&, i] { task(count - 1 - i); });
    for (std::thread& thread : pool) thread.join();
  };
  std::vector<test::PlacedPicture> pictures;
  for (int i = 0; i < 4; ++i)
    pictures.push_back({.image = with_tag(bare(), i), .pose = {-0.9 + 0.6 * i, 0.2 - 0.1 * i, 0.8 * i}});
  const test::FlatScene scene = scene_of(pictures);
  Tracker one({scene.camera()});
  Tracker many({scene.camera()}, {}, threads);
  for (Tracker* tracker : {&one, &many}) {
    for (int i = 0; i < 4; ++i) {
      tracker->add({.id = std::string("r").append(std::to_string(i)),
                    .tag = tag_spec(i),
                    .detector = DetectorKind::apriltag,
                    .initial_pose = pictures[static_cast<std::size_t>(i)].pose});
    }
  }
  const Frame drawn = scene.render();
  for (int i = 0; i < 4; ++i) {
    const Frame frame = again(drawn, i);
    const auto a = one.process(frame);
    const auto b = many.process(frame);
    for (std::size_t r = 0; r < 4; ++r) {
      ASSERT_TRUE(a[r].measured && b[r].measured) << a[r].reason;
      EXPECT_EQ(a[r].measured->pose, b[r].measured->pose);
      EXPECT_EQ(a[r].measured->covariance, b[r].measured->covariance);
    }
  }
}

TEST(TrackerTags, WhatTheCalibrationLeavesUnknownStandsBesideThem) {
  const test::FlatScene scene = scene_of({{.image = with_tag(bare(), 7), .pose = {0.4, 0.3, 0.7}}});
  TrackerConfig config;
  config.calibration = {camera_uncertainty({.position_m = 0.002})};
  Tracker tracker({scene.camera()}, config);
  tracker.add({.id = "anna",
               .tag = tag_spec(7),
               .detector = DetectorKind::apriltag,
               .initial_pose = Pose2{0.4, 0.3, 0.7}});
  const auto reports = tracker.process(scene.render(at_frame(0)));
  ASSERT_TRUE(reports[0].measured);
  EXPECT_GT(reports[0].measured->correlated(0, 0), 0.9 * 0.002 * 0.002);
  EXPECT_LT(reports[0].measured->covariance(0, 0), 0.001 * 0.001);
}

TEST(TrackerTags, ThatCannotBeAreRefusedNamingTheRobot) {
  Tracker tracker({scene_of({}).camera()});
  tracker.add({.id = "anna", .tag = tag_spec(7), .detector = DetectorKind::apriltag});
  const auto refused = [&](const RobotSpec& robot) {
    try {
      tracker.add(robot);
      return std::string("accepted");
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
  };
  EXPECT_EQ(refused({.id = "ben", .tag = tag_spec(7), .detector = DetectorKind::apriltag}),
            "robot 'ben': its tag, 36h11 7, is that of robot 'anna' already");
  EXPECT_THAT(refused({.id = "ben", .detector = DetectorKind::apriltag}), testing::HasSubstr("needs a tag"));
  EXPECT_THAT(refused({.id = "ben", .tag = tag_spec(8)}), testing::HasSubstr("it has no appearance"));
  EXPECT_EQ(refused({.id = "ben", .tag = tag_spec(600), .detector = DetectorKind::apriltag}),
            "robot 'ben': tag.id is 600, allowed 0 to 586 in the family 36h11");
  RobotSpec anna = tracker.robots()[0];
  anna.tag = tag_spec(9);
  EXPECT_TRUE(tracker.change(anna));
  EXPECT_EQ(refused({.id = "ben", .tag = tag_spec(7), .detector = DetectorKind::apriltag}), "accepted");
  anna.tag = tag_spec(7);
  EXPECT_THROW(tracker.change(anna), std::invalid_argument);
  TrackerConfig config;
  config.tags.look_interval = 0;
  EXPECT_THROW(Tracker({scene_of({}).camera()}, config), std::invalid_argument);
}

}  // namespace
}  // namespace skylight
