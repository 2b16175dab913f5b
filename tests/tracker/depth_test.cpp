// Heights from depth: against boxes of known height under a sensor that errs in known ways.
#include <numbers>

#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

#include "tests/tracker/learnt_floor.hpp"
#include "tracker/depth/blobs.hpp"

namespace skylight {
namespace {

using test::camera_of;
using test::DepthScene;
using test::erring;
using test::learnt;
using test::square;
using testing::HasSubstr;
using testing::SizeIs;

constexpr double kDegree = std::numbers::pi / 180.0;

TEST(FloorDepth, TellsHeightsThoughTheSensorErrsByHalfARobot) {
  DepthScene scene = erring();
  scene.boxes = {
      {.x = -0.8, .y = 0.4}, {.x = 0.9, .y = -0.5, .height = 0.4}, {.x = 0.2, .y = 0.6, .height = 0.14}};
  const FloorDepth floor = learnt(scene, camera_of(scene));
  ASSERT_TRUE(floor.fit().known);
  scene.seed = 7;
  const cv::Mat depth = scene.render();
  for (const test::DepthBox& box : scene.boxes) {
    const SurfaceLook look = look_at(floor, depth, square(0.28, box.height), {box.x, box.y, 0.0});
    EXPECT_NEAR(look.height_m, box.height, 4 * look.sigma_m + 0.001) << box.x;
    EXPECT_LT(look.sigma_m, 0.002);
    EXPECT_GT(look.level, 0.95);
  }
  const SurfaceLook bare = look_at(floor, depth, square(0.28, 0.0), {-0.2, -0.6, 0.0});
  EXPECT_NEAR(bare.height_m, 0.0, 0.003);
}

TEST(FloorDepth, IsNotMisledByWhatStandsOnAThirdOfTheFloor) {
  DepthScene scene = erring();
  scene.boxes = {{.x = -1.2, .y = 0.0, .length = 1.2, .width = 4.0, .height = 0.75}};
  const FloorDepth floor = learnt(scene, camera_of(scene));
  ASSERT_TRUE(floor.fit().known);
  EXPECT_LT(floor.fit().share, 0.8);
  const cv::Mat depth = scene.render();
  EXPECT_NEAR(look_at(floor, depth, square(0.28, 0.0), {0.6, 0.4, 0.0}).height_m, 0.0, 0.004);
}

TEST(FloorDepth, ReportsACameraThatHangsOtherwiseThanCalibrated) {
  DepthScene scene;
  scene.noise_m = 0.01;
  const double tilt = 0.6 * kDegree;
  const FloorDepth floor = learnt(scene, camera_of(scene, tilt));
  EXPECT_NEAR(floor.fit().tilt_rad, tilt, 0.03 * kDegree);
  EXPECT_NEAR(floor.fit().offset_m, 0.0, 0.002);

  DepthScene higher = scene;
  higher.camera_height_m = 3.02;
  const FloorDepth low = learnt(higher, camera_of(scene));
  EXPECT_NEAR(low.fit().offset_m, -0.02, 0.001) << "the floor is 2 cm farther down";
  EXPECT_NEAR(low.fit().tilt_rad, 0.0, 0.03 * kDegree);
}

TEST(FloorDepth, MeasuresItsOwnNoiseAndWhatLasts) {
  DepthScene scene;
  scene.noise_m = 0.012;
  const FloorDepth even = learnt(scene, camera_of(scene), 10);
  EXPECT_NEAR(even.fit().noise_m, 0.012 / 2, 0.0006) << "four readings";
  EXPECT_LT(even.fit().uneven_m, 0.001);
  EXPECT_NEAR(even.sigma_m(1.5), 0.006 / 4, 0.0003) << "half as far: a quarter";
  // Ripples of 6 mm RMS, shorter than the correction can follow.
  scene.error = [](double, double x, double) {
    return 0.006 * std::numbers::sqrt2 * std::sin(2 * std::numbers::pi * x);
  };
  const FloorDepth rippled = learnt(scene, camera_of(scene), 10);
  EXPECT_NEAR(rippled.fit().uneven_m, 0.006, 0.002);
}

// What parts of the floor have in common by chance is noise, which says nothing of what lasts.
TEST(FloorDepth, NoiseIsNotTakenForWhatLasts) {
  DepthScene scene;
  scene.noise_m = 0.08;
  const FloorDepth floor = learnt(scene, camera_of(scene));
  const double by_chance = floor.fit().noise_m / std::sqrt(8000.0 / 64.0);
  EXPECT_NEAR(floor.fit().noise_m, 0.04, 0.004);
  EXPECT_LT(floor.fit().uneven_m, 0.6 * by_chance);
}

TEST(FloorDepth, ACellNeedsTwoOfItsFourReadings) {
  DepthScene scene;
  const FloorDepth floor = learnt(scene, camera_of(scene));
  cv::Mat depth = scene.render();
  for (int row = 2; row < depth.rows; row += 4) depth.row(row).setTo(0);
  EXPECT_NEAR(floor.height(depth, 80, 60), 0.0F, 0.002F);
  for (int column = 2; column < depth.cols; column += 4) depth.col(column).setTo(0);
  EXPECT_TRUE(std::isnan(floor.height(depth, 80, 60)));
}

TEST(FloorDepth, FollowsASensorThatDrifts) {
  DepthScene scene = erring();
  scene.width_px = 320;
  scene.height_px = 240;
  scene.focal_px = 250;
  DepthConfig config;
  config.follow_interval = 1;
  config.follow_frames = 10;
  FloorDepth floor(camera_of(scene), config);
  for (int i = 0; i < 60; ++i) {
    scene.seed = static_cast<std::uint32_t>(i);
    const double by = 0.0002 * i;  // in 60 frames 36 mm, four times a cell's noise
    scene.error = [by](double z, double, double) { return 1.0 / (1.0 / z - by / 3) - z; };
    floor.learn(scene.render());
  }
  ASSERT_TRUE(floor.fit().known);
  EXPECT_NEAR(look_at(floor, scene.render(), square(0.28, 0.0), {0.3, 0.3, 0.0}).height_m, 0.0, 0.008);
}

TEST(FloorDepth, BelievesNothingBeforeItHasSeenTheFloor) {
  DepthScene scene;
  FloorDepth floor(camera_of(scene), {});
  EXPECT_FALSE(floor.fit().known);
  const cv::Mat nothing = cv::Mat::zeros(scene.height_px, scene.width_px, CV_16UC1);
  for (int i = 0; i < 20; ++i) floor.learn(nothing);
  EXPECT_FALSE(floor.fit().known);
  EXPECT_TRUE(std::isnan(floor.height(nothing, 5, 5)));
  EXPECT_TRUE(std::isnan(floor.height(nothing, Pixel(-10.0, 5.0))));
  // A lid on the lens is flat too, but no floor.
  const cv::Mat lid(scene.height_px, scene.width_px, CV_16UC1, cv::Scalar(900));
  for (int i = 0; i < 20; ++i) floor.learn(lid);
  EXPECT_FALSE(floor.fit().known);
  for (int i = 0; i < 5; ++i) floor.learn(scene.render());
  for (int i = 0; i < 10; ++i) floor.learn(scene.render());
  EXPECT_TRUE(floor.fit().known) << "and it is learnt when it comes";
}

TEST(FloorDepth, NamesASettingOutOfRange) {
  DepthConfig config;
  config.cell_px = 1;
  EXPECT_THAT(check(config), testing::AllOf(HasSubstr("depth.cell_px is 1"), HasSubstr("2 to 32")));
  EXPECT_THROW(FloorDepth(camera_of({}), config), std::invalid_argument);
  config = {};
  config.covered_share = std::nan("");
  EXPECT_THAT(check(config), HasSubstr("depth.covered_share"));
}

TEST(SurfaceLook, TellsWhatCoversARobotFromWhatDoesNot) {
  DepthScene scene = erring();
  scene.boxes = {{.x = 0.2, .y = 0.1}};
  const FloorDepth floor = learnt(scene, camera_of(scene));
  const Surface robot = square(0.3, 0.14);
  const auto look = [&](const std::vector<test::DepthBox>& above) {
    DepthScene now = scene;
    now.boxes.insert(now.boxes.end(), above.begin(), above.end());
    return look_at(floor, now.render(), robot, {0.2, 0.1, 0.5});
  };
  EXPECT_FALSE(covered(look({}), {}));
  EXPECT_TRUE(covered(look({{.x = 0.2, .y = 0.1, .length = 0.5, .width = 0.5, .height = 1.2}}), {}));
  EXPECT_TRUE(covered(look({{.x = 0.32, .y = 0.1, .length = 0.25, .width = 0.5, .height = 0.3}}), {}))
      << "half of it";
  EXPECT_FALSE(covered(look({{.x = 0.33, .y = 0.1, .length = 0.06, .width = 0.06, .height = 1.2}}), {}))
      << "an antenna hides little";
  EXPECT_FALSE(covered(look({{.x = 0.2, .y = 0.1, .length = 0.3, .width = 0.3, .height = 0.15}}), {}))
      << "a sheet on its top is not higher";
  EXPECT_FALSE(empty(look({})));
  scene.boxes.clear();
  EXPECT_TRUE(empty(look({})));
  EXPECT_FALSE(covered(look({}), {}));
}

TEST(SurfaceLook, SaysNothingWhereThereAreNoReadings) {
  DepthScene scene = erring();
  const FloorDepth floor = learnt(scene, camera_of(scene));
  cv::Mat depth = scene.render();
  depth(cv::Rect(200, 150, 240, 180)).setTo(0);
  const SurfaceLook hole = look_at(floor, depth, square(0.3, 0.14), {0.0, 0.0, 0.0});
  EXPECT_GT(hole.cells, 50);
  EXPECT_EQ(hole.readings, 0);
  EXPECT_FALSE(tells(hole) || covered(hole, {}) || empty(hole) || at_wrong_height(hole, 0.14, {}));
  const SurfaceLook outside = look_at(floor, depth, square(0.3, 0.14), {9.0, 0.0, 0.0});
  EXPECT_FALSE(tells(outside));
}

// The lower half of the picture, which is the robot's back, is no part of it.
TEST(Surface, IsMadeOfThePlacesThatBelongToThePicture) {
  cv::Mat image = test::corner_picture(51);
  cv::cvtColor(image, image, cv::COLOR_BGR2BGRA);
  image.rowRange(image.rows / 2, image.rows).setTo(cv::Scalar(0, 0, 0, 0));
  const Appearance front("front", {.image = image, .metres_per_pixel = 0.001, .surface_height_m = 0.1});
  const Surface surface = surface_of(front, 0.1);
  EXPECT_THAT(surface.places_m, SizeIs(72)) << "half of twelve by twelve";
  for (const Eigen::Vector2d& place : surface.places_m) EXPECT_GT(place.x(), front.centre_m().x());
}

TEST(SurfaceLook, ALookAlikeOnABoxIsAtTheWrongHeight) {
  DepthScene scene = erring();
  scene.boxes = {{.x = 0.2, .y = 0.1, .height = 0.25}};
  const FloorDepth floor = learnt(scene, camera_of(scene));
  const SurfaceLook look = look_at(floor, scene.render(), square(0.28, 0.14), {0.2, 0.1, 0.0});
  EXPECT_TRUE(at_wrong_height(look, 0.14, {}));
  EXPECT_FALSE(at_wrong_height(look, 0.25, {}));
}

// A camera a few millimetres off, so that something lasts; what is claimed must hold over many rooms.
TEST(SurfaceHeight, ClaimsNoMoreThanItKnows) {
  double squares = 0.0;
  constexpr int kRooms = 20;
  for (std::uint32_t room = 0; room < kRooms; ++room) {
    DepthScene scene;
    scene.width_px = 320;
    scene.height_px = 240;
    scene.focal_px = 250;
    scene.noise_m = 0.012;
    std::mt19937 random(room);
    std::uniform_real_distribution<double> phase(0.0, 2 * std::numbers::pi);
    const double px = phase(random);
    const double py = phase(random);
    scene.error = [=](double, double x, double y) {
      return 0.004 * std::sin(8 * x + px) + 0.004 * std::sin(8 * y + py);
    };
    scene.boxes = {{.x = 0.3, .y = -0.2, .height = 0.12}};
    const FloorDepth floor = learnt(scene, camera_of(scene));
    SurfaceHeight height;
    for (std::uint32_t i = 0; i < 5; ++i) {
      scene.seed = 1000 * room + i;
      height.add(look_at(floor, scene.render(), square(0.28, 0.12), {0.3, -0.2, 0.0}), floor.fit().uneven_m);
    }
    EXPECT_EQ(height.looks(), 5);
    squares += std::pow((height.height_m() - 0.12) / height.sigma_m(), 2);
  }
  EXPECT_LT(squares / kRooms, 2.0);
  EXPECT_GT(squares / kRooms, 0.2);
}

TEST(Blobs, AreThingsOfARobotsHeightAndSize) {
  DepthScene scene = erring();
  scene.boxes = {{.x = -0.8, .y = 0.4},                                                // a robot
                 {.x = 0.9, .y = -0.5, .height = 0.5},                                 // a bin
                 {.x = 0.3, .y = 0.3, .length = 0.07, .width = 0.07},                  // a cup
                 {.x = -0.3, .y = -1.0, .length = 1.5, .width = 0.6, .height = 0.14},  // a pallet
                 {.x = -0.3, .y = -0.35, .length = 1.3, .width = 0.1},                 // a plank
                 {.x = 1.0, .y = 0.8, .length = 0.3, .width = 0.3},  // two robots that touch
                 {.x = 1.3, .y = 0.8, .length = 0.3, .width = 0.3}};
  const FloorDepth floor = learnt(scene, camera_of(scene));
  const cv::Mat heights = height_map(floor, scene.render());
  const auto blobs = find_blobs(floor, heights, {.height_m = 0.14, .size_m = {0.3, 0.3}});
  ASSERT_THAT(blobs, SizeIs(2));
  EXPECT_NEAR(blobs[0].place_m.x(), 1.15, 0.03) << "from the top down: the pair first";
  EXPECT_NEAR(blobs[0].area_m2, 0.18, 0.04);
  EXPECT_LT((blobs[1].place_m - Eigen::Vector2d(-0.8, 0.4)).norm(), 0.02);
  const Pixel robot((640 - 1) / 2.0 - 0.8 / 2.86 * 500, (480 - 1) / 2.0 - 0.4 / 2.86 * 500);
  const double half = 0.5 * 0.3 * std::numbers::sqrt2 / 2.86 * 500;
  const cv::Rect2d turned(robot.x() - half, robot.y() - half, 2 * half, 2 * half);
  EXPECT_EQ(cv::Rect2d(blobs[1].part_px) & turned, turned) << "however it is turned, it lies inside";
  EXPECT_THAT(find_blobs(floor, heights, {.height_m = 0.5, .size_m = {0.3, 0.3}}), SizeIs(1));
}

TEST(Blobs, AFlatRobotIsNotToldFromTheFloor) {
  DepthScene scene = erring();
  const FloorDepth floor = learnt(scene, camera_of(scene));
  EXPECT_THAT(find_blobs(floor, height_map(floor, scene.render()), {.height_m = 0.01, .size_m = {0.3, 0.3}}),
              SizeIs(0));
}

}  // namespace
}  // namespace skylight
