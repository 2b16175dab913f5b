#include "tracker/floor_mask.hpp"

#include <numbers>

#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"
#include "tracker/search.hpp"
#include "tracker/tracker.hpp"

namespace skylight {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

FloorMask mask(std::vector<Eigen::Vector2d> corners) {
  return {.name = "shelf", .corners = std::move(corners)};
}
FloorMask rectangle(double x0, double y0, double x1, double y1) {
  return mask({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}});
}

TEST(FloorMask, CoversAsTheWindingNumberSays) {
  // An L, one way round and the other; inside is where the angles to its corners add up to a full turn.
  std::vector<Eigen::Vector2d> corners{{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}};
  for (int round = 0; round < 2; ++round) {
    const FloorMask shape = mask(corners);
    ASSERT_EQ(check(shape), "");
    for (double x = -0.55; x < 3.6; x += 0.1) {
      for (double y = -0.55; y < 3.6; y += 0.1) {
        double turned = 0.0;
        for (std::size_t i = 0; i < corners.size(); ++i) {
          const Eigen::Vector2d a = corners[i] - Eigen::Vector2d(x, y);
          const Eigen::Vector2d b = corners[(i + 1) % corners.size()] - Eigen::Vector2d(x, y);
          turned += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
        }
        EXPECT_EQ(covers(shape, {x, y}), std::abs(turned) > std::numbers::pi) << x << ", " << y;
      }
    }
    std::reverse(corners.begin(), corners.end());
  }
}

TEST(FloorMask, WhatIsNoSimplePolygonIsRefusedNamingTheCorner) {
  EXPECT_THAT(check(mask({{0, 0}, {1, 0}})), HasSubstr("corners: there are 2, allowed 3 to 100"));
  EXPECT_THAT(check(mask(std::vector<Eigen::Vector2d>(101, {0, 0}))), HasSubstr("there are 101"));
  EXPECT_THAT(check(mask({{0, 0}, {1, 0}, {1, 0}, {0, 1}})), StartsWith("corners[1]: is the same place"));
  EXPECT_THAT(check(mask({{0, 0}, {1, 0}, {1, 2e4}})), StartsWith("corners[2]: is not within 10 km"));
  EXPECT_THAT(check(mask({{0, 0}, {1, NAN}, {1, 1}})), StartsWith("corners[1]: is not within 10 km"));
  EXPECT_THAT(check(mask({{0, 0}, {1, 1}, {1, 0}, {0, 1}})),
              StartsWith("corners[2]: the side from there meets the one from corners[0]"));
  EXPECT_THAT(check(mask({{0, 0}, {2, 0}, {1, 0}, {1, 1}})),
              StartsWith("corners[1]: the sides before and after"));
  EXPECT_THAT(check(mask({{0, 0}, {4, 0}, {4, 2}, {2, 0}, {0, 2}})),
              HasSubstr("meets the one from corners[0]"))
      << "a corner that touches a side";
  EXPECT_THAT(check(mask({{0, 0}, {2, 2}, {4, 0}, {4, 2}, {0, 2}})),
              StartsWith("corners[3]: the side from there meets the one from corners[0]"))
      << "a side that touches a corner";
  EXPECT_EQ(check(mask({{0, 0}, {1, 0}, {2, 0}, {2, 2}})), "") << "a corner on a straight side";
}

TEST(FloorMask, APartOfAPictureIsMaskedWhereAllOfItsEdgeIs) {
  const test::FlatScene scene;  // 640 x 480 px, 3 m high: 5.8 mm a pixel 0.1 m above the floor
  const CameraModel camera = scene.camera();
  const std::vector<FloorMask> left{rectangle(-5, -5, 0, 5)};
  EXPECT_TRUE(any_covers(left, camera, {0, 0, 300, 200}, 0.1));
  EXPECT_FALSE(any_covers(left, camera, {0, 0, 330, 200}, 0.1)) << "reaches over the middle";
  EXPECT_FALSE(any_covers(left, camera, {400, 0, 100, 100}, 0.1));
  EXPECT_FALSE(any_covers({}, camera, {0, 0, 100, 100}, 0.1));
  // A slit of 0.1 m, 17 px, reaches from one side of the mask into the part: its four corners are covered.
  const cv::Rect part(100, 100, 200, 200);
  const Eigen::Vector2d middle = camera.plane_from_pixel({200, 200}, 0.1).value();
  EXPECT_TRUE(any_covers({rectangle(-5, -5, 5, 5)}, camera, part, 0.1));
  for (int side = 0; side < 4; ++side) {
    std::vector<Eigen::Vector2d> corners{{-5, -5},    {5, -5},   {5, -0.05}, {0.2, -0.05},
                                         {0.2, 0.05}, {5, 0.05}, {5, 5},     {-5, 5}};
    for (Eigen::Vector2d& corner : corners)
      corner = middle + Eigen::Rotation2Dd(side * 0.5 * std::numbers::pi) * corner;
    ASSERT_EQ(check(mask(corners)), "");
    EXPECT_FALSE(any_covers({mask(corners)}, camera, part, 0.1)) << side;
  }
}

TEST(FloorMask, TheSweepSkipsItsShareOfTheTiles) {
  const test::FlatScene scene;
  const CameraModel camera = scene.camera();
  const cv::Size size(640, 480);
  const auto in_a_round = [&](const std::vector<FloorMask>& masks) {
    std::vector<cv::Rect> seen;
    for (Sweep sweep;;) {
      const auto tile = sweep.next(
          size, 128, 32, [&](const cv::Rect& part) { return any_covers(masks, camera, part, 0.1); });
      if (!tile || (!seen.empty() && *tile == seen.front())) return seen;
      seen.push_back(*tile);
    }
  };
  const auto all = in_a_round({});
  const std::vector<FloorMask> left{rectangle(-5, -5, 0, 5)};
  const auto some = in_a_round(left);
  // 7 columns of tiles; those of which all lies in the left half of 640 px are skipped.
  const auto skipped =
      std::count_if(all.begin(), all.end(), [](const cv::Rect& t) { return t.br().x <= 320; });
  EXPECT_GT(skipped, 0);
  EXPECT_EQ(some.size(), all.size() - static_cast<std::size_t>(skipped));
  EXPECT_TRUE(in_a_round({rectangle(-9, -9, 9, 9)}).empty());
}

/// Frames until the robot is tracked, at most `limit`.
int frames_until_found(const test::FlatScene& scene, std::vector<FloorMask> masks, int limit,
                       std::string* reason = nullptr) {
  TrackerConfig config;
  config.floor_masks = std::move(masks);
  config.search = {.tile_px = 256, .steps_per_frame = 1, .first_steps_per_frame = 1};
  Tracker tracker({scene.camera()}, config);
  tracker.add({.id = "anna", .appearance = test::appearance_of(scene.pictures[0])});
  Frame frame = scene.render();
  for (int i = 1; i <= limit; ++i) {
    frame.captured = Time{} + from_seconds(1000.0 + i / 30.0);
    const RobotReport report = tracker.process(frame).at(0);
    if (reason != nullptr) *reason = report.reason;
    if (report.measured) return i;
  }
  return limit + 1;
}

TEST(FloorMask, APosterOfTheRobotNeverBecomesAPose) {
  test::FlatScene scene;
  scene.floor_speckle = 300;
  scene.pictures = {{.image = test::corner_picture(51), .pose = {0.8, 0.6, 0.7}}};
  const int all_tiles = 9;  // 3 x 3, overlapping by a robot
  EXPECT_LE(frames_until_found(scene, {}, all_tiles), all_tiles) << "where nothing is masked it does";
  EXPECT_GT(frames_until_found(scene, {rectangle(0.7, 0.5, 0.9, 0.7)}, all_tiles), all_tiles)
      << "a mask smaller than a tile: what is found there is refused";
  EXPECT_GT(frames_until_found(scene, {rectangle(-1, -1, 1.5, 1.2)}, all_tiles), all_tiles);
}

TEST(FloorMask, NorDoesItWhereTheWholePictureIsMatchedAtOnce) {
  test::FlatScene scene;
  scene.pictures = {{.image = test::corner_picture(41, 350), .height_m = 0.2, .pose = {0.8, 0.5, 0.4}}};
  for (const bool masked : {false, true}) {
    TrackerConfig config;
    if (masked) config.floor_masks = {rectangle(0.7, 0.4, 0.9, 0.6)};
    Tracker tracker({scene.camera()}, config);
    tracker.add({.id = "anna",
                 .appearance = test::appearance_of(scene.pictures[0]),
                 .detector = DetectorKind::homography});
    const RobotReport report = tracker.process(scene.render()).at(0);
    EXPECT_EQ(report.measured.has_value(), !masked) << report.reason;
    EXPECT_EQ(report.reason.find("where the floor is masked") != std::string::npos, masked) << report.reason;
  }
}

TEST(FloorMask, TheRobotItselfIsFoundBesideItsPosterAndSooner) {
  test::FlatScene scene;
  scene.floor_speckle = 300;
  const cv::Mat picture = test::corner_picture(51);
  scene.pictures = {{.image = picture, .pose = {0.9, -1.05, 0.7}}};
  const int alone = frames_until_found(scene, {}, 9);
  const int masked = frames_until_found(scene, {rectangle(-5, -5, 0, 5)}, 9);
  EXPECT_EQ(alone, 9) << "in the last tile";
  EXPECT_EQ(masked, 6) << "a column of three tiles is skipped";
  scene.pictures.push_back({.image = picture, .pose = {-0.9, 0.7, 0.2}});  // the poster
  EXPECT_EQ(frames_until_found(scene, {rectangle(-5, -5, 0, 5)}, 9), masked);
}

TEST(FloorMask, ARobotThatIsTrackedDrivesThrough) {
  test::FlatScene scene;
  scene.pictures = {{.image = test::corner_picture(51), .pose = {-0.5, 0.1, 0.0}}};
  TrackerConfig config;
  config.floor_masks = {rectangle(-0.2, -1, 0.2, 1)};
  Tracker tracker({scene.camera()}, config);
  tracker.add({.id = "anna",
               .appearance = test::appearance_of(scene.pictures[0]),
               .initial_pose = scene.pictures[0].pose});
  for (int i = 0; i < 40; ++i) {
    scene.pictures[0].pose.x = -0.5 + 0.025 * i;
    const auto report = tracker.process(scene.render(Time{} + from_seconds(1000.0 + i / 30.0))).at(0);
    ASSERT_TRUE(report.measured) << i << ": " << report.reason;
    EXPECT_NEAR(report.measured->pose.x, scene.pictures[0].pose.x, 0.001);
  }
}

TEST(FloorMask, ATrackerRefusesOneThatIsNone) {
  const test::FlatScene scene;
  TrackerConfig config;
  config.floor_masks = {mask({{0, 0}, {1, 0}})};
  EXPECT_THAT(
      [&] { Tracker({scene.camera()}, config); },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("floor mask 'shelf': corners: there are 2")));
}

}  // namespace
}  // namespace skylight
