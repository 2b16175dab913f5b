// How a search uses depth: things of the robot's height first, but neither them alone nor without measure.
#include <gtest/gtest.h>

#include "tests/tracker/depth_room.hpp"

namespace skylight {
namespace {

using test::at_frame;
using test::DepthBox;
using test::kHeight;
using test::kSide;
using test::quick;
using test::Room;

RobotSpec somewhere(const Room& room) {
  RobotSpec robot = room.robot();
  robot.initial_pose.reset();
  return robot;
}

DepthBox box(double x, double y) {
  return {.x = x, .y = y, .length = kSide, .width = kSide, .height = kHeight};
}

// No readings where the robot stands.
Frame with_hole(Frame frame, const Room& room, const Pose2& pose) {
  const Pixel middle = room.picture.pixel(pose.x, pose.y, kHeight);
  frame.depth(cv::Rect(static_cast<int>(middle.x()) - 40, static_cast<int>(middle.y()) - 40, 80, 80))
      .setTo(0);
  return frame;
}

// Frames until it is measured, from frame `at` on; `most` where it is not.
int frames_until(Tracker& tracker, Frame frame, std::size_t robot, int at, int most) {
  for (int i = 0; i < most; ++i) {
    frame.captured = at_frame(at + i);
    if (tracker.process(frame).at(robot).measured) return i;
  }
  return most;
}

TEST(DepthSearch, ARobotInAHoleOfTheDepthIsFoundThoughThereAreThingsOfItsHeight) {
  Room room({0.7, -0.5, 1.0});
  room.depth.boxes = {box(-0.6, 0.4)};  // as high as the robot, and nothing else
  Tracker tracker({room.picture.camera()}, quick());
  tracker.add(somewhere(room));
  const Frame frame = with_hole(room.frame(0), room, {0.7, -0.5, 1.0});
  EXPECT_LT(frames_until(tracker, frame, 0, 0, 30), 25) << "every third step is a tile, of six";
}

TEST(DepthSearch, ThingsOnWhichARobotIsSeenAreNotSearched) {
  Room room({-0.6, 0.4, 0.0});
  test::PlacedPicture other = room.picture.pictures[0];
  other.image = test::corner_picture(77);
  other.pose = {0.7, -0.5, 1.0};
  room.picture.pictures.push_back(other);
  Tracker tracker({room.picture.camera()}, quick());
  tracker.add(room.robot());
  tracker.add({.id = "ben", .appearance = test::appearance_of(other)});
  const Frame frame = with_hole(room.frame(0), room, other.pose);
  EXPECT_LE(frames_until(tracker, frame, 1, 0, 30), 6) << "nothing but tiles is left";
}

TEST(DepthSearch, WhatLiesUnderAMaskIsNoRobotThoughItIsAsHigh) {
  const Room room({0.7, -0.5, 1.0});
  TrackerConfig config = quick();
  config.floor_masks = {{.name = "store", .corners = {{0.4, -0.9}, {1.2, -0.9}, {1.2, -0.2}, {0.4, -0.2}}}};
  Tracker tracker({room.picture.camera()}, config);
  tracker.add(somewhere(room));
  EXPECT_EQ(frames_until(tracker, room.frame(0), 0, 0, 8), 8);
}

// Room for one thing in a step: each has its turn.
TEST(DepthSearch, LooksAtFewThingsInAStepAndAtEachInItsTurn) {
  Room room({0.7, -0.5, 1.0});
  room.depth.boxes = {box(-0.8, 0.6), box(-0.2, 0.6), box(0.4, 0.6), room.depth.boxes[0]};
  TrackerConfig config = quick();
  config.search.tile_px = 64;
  Tracker tracker({room.picture.camera()}, config);
  tracker.add(somewhere(room));
  const int frames = frames_until(tracker, room.frame(0), 0, 0, 30);
  EXPECT_GE(frames, 2);
  EXPECT_LE(frames, 8);
}

// A tag of 8 cm on a bare robot.
Room with_tag(Room room) {
  const TagPattern pattern = tag_pattern("36h11", 7);
  cv::Mat& image = room.picture.pictures[0].image;
  image = cv::Mat(240, 240, CV_8UC3, cv::Scalar(70, 70, 70));
  const int corner = (240 - 12 * pattern.cells.cols) / 2;
  for (int r = 0; r < pattern.cells.rows; ++r) {
    for (int c = 0; c < pattern.cells.cols; ++c) {
      cv::rectangle(image, cv::Rect(corner + 12 * c, corner + 12 * r, 12, 12),
                    cv::Scalar::all(pattern.cells.at<std::uint8_t>(r, c) != 0 ? 230 : 25), cv::FILLED);
    }
  }
  return room;
}

RobotSpec tagged() {
  return {.id = "anna",
          .tag = TagSpec{.id = 7, .size_m = 0.096, .height_m = kHeight},
          .detector = DetectorKind::apriltag};
}

TEST(DepthSearch, TagsAreSearchedForOnThingsOfTheirHeight) {
  const Room room = with_tag(Room({0.9, -0.7, 0.3}));
  Tracker tracker({room.picture.camera()}, quick());
  tracker.add(tagged());
  const RobotReport report = tracker.process(room.frame(0)).at(0);
  ASSERT_TRUE(report.measured) << report.reason;
  EXPECT_LT((report.measured->pose.position() - Eigen::Vector2d(0.9, -0.7)).norm(), 0.003);
}

TEST(DepthSearch, ATagInAHoleOfTheDepthIsFoundThoughThereAreThingsOfItsHeight) {
  Room room = with_tag(Room({0.7, -0.5, 1.0}));
  room.depth.boxes = {box(-0.6, 0.4)};
  Tracker tracker({room.picture.camera()}, quick());
  tracker.add(tagged());
  const Frame frame = with_hole(room.frame(0), room, {0.7, -0.5, 1.0});
  EXPECT_LT(frames_until(tracker, frame, 0, 0, 40), 30);
}

}  // namespace
}  // namespace skylight
