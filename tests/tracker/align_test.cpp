#include "tracker/detect/align.hpp"

#include <Eigen/LU>
#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"

namespace skylight {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

test::FlatScene scene_with(const Pose2& pose, std::uint32_t picture_seed = 11) {
  test::FlatScene scene;
  scene.floor_speckle = 2000;
  scene.pictures = {{.image = test::corner_picture(picture_seed), .pose = pose}};
  return scene;
}

std::optional<AlignResult> align(const test::FlatScene& scene, const Pose2& from,
                                 AlignMode mode = AlignMode::fine) {
  Aligner aligner(test::appearance_of(scene.pictures[0]));
  return aligner.align(scene.render(), scene.camera(), {from, scene.pictures[0].height_m}, mode);
}

double apart_px(const test::FlatScene& scene, const Pose2& a, const Pose2& b) {
  return (a.position() - b.position()).norm() / scene.metres_per_px(scene.pictures[0].height_m);
}

// 240 mm at 5.8 mm per pixel: the robot is 41 px wide.
TEST(Aligner, FindsThePoseToAFractionOfAPixelAtEveryHeading) {
  for (int step = 0; step < 24; ++step) {
    const Pose2 truth{0.4 + 0.0007 * step, -0.3 + 0.0011 * step, wrap_angle(15.0 * step * kDegree + 0.03)};
    test::FlatScene scene = scene_with(truth);
    scene.noise = 2.0;
    const Pose2 from{truth.x + 0.008, truth.y - 0.006, truth.yaw + 3 * kDegree};  // 1.7 px and 3 degrees off
    const auto result = align(scene, from);
    ASSERT_TRUE(result) << step;
    EXPECT_LT(apart_px(scene, result->pose, truth), 0.04) << step;
    EXPECT_NEAR(wrap_angle(result->pose.yaw - truth.yaw), 0.0, 0.15 * kDegree) << step;
    EXPECT_GT(result->score, 0.9) << step;
  }
}

TEST(Aligner, ReachesFurtherWithTheCoarseLevelFirst) {
  const Pose2 truth{0.2, 0.25, 0.7};
  const test::FlatScene scene = scene_with(truth);
  const Pose2 from{truth.x + 0.02, truth.y + 0.012, truth.yaw - 6 * kDegree};  // 4 px and 6 degrees off
  const auto result = align(scene, from, AlignMode::coarse);
  ASSERT_TRUE(result);
  EXPECT_LT(apart_px(scene, result->pose, truth), 0.05);
}

TEST(Aligner, DoesNotMindTheLight) {
  const Pose2 truth{-0.5, 0.3, 2.0};
  test::FlatScene scene = scene_with(truth);
  scene.gain = 0.5;
  scene.bias = 25.0;
  const auto result = align(scene, {truth.x + 0.004, truth.y, truth.yaw});
  ASSERT_TRUE(result);
  EXPECT_LT(apart_px(scene, result->pose, truth), 0.05);
  EXPECT_GT(result->score, 0.9);
}

TEST(Aligner, IsNotDraggedByWhatCoversAThirdOfTheRobot) {
  const Pose2 truth{0.0, 0.0, 0.5};
  test::FlatScene scene = scene_with(truth);
  const Pixel centre = scene.pixel(0, 0, 0.1);
  scene.covers_px = {
      cv::Rect(static_cast<int>(centre.x()) + 8, 0, 60, scene.height_px)};  // the right 12 of 41 px
  const auto result = align(scene, {truth.x + 0.003, truth.y + 0.003, truth.yaw});
  ASSERT_TRUE(result);
  EXPECT_LT(apart_px(scene, result->pose, truth), 0.1);
  EXPECT_LT(result->agreeing, 0.85);
}

TEST(Aligner, TheScoreTellsThePictureFromAnotherAndFromTheFloor) {
  const Pose2 truth{0.1, 0.1, 0.3};
  test::FlatScene other = scene_with(truth, 12);
  other.noise = 2.0;
  const test::FlatScene mine = scene_with(truth, 11);
  Aligner aligner(test::appearance_of(mine.pictures[0]));
  const Frame frame = other.render();
  for (int step = 0; step < 36; ++step) {
    const auto result = aligner.align(frame, other.camera(),
                                      {{0.1, 0.1, wrap_angle(step * 10 * kDegree)}, 0.1}, AlignMode::coarse);
    EXPECT_LT(result ? result->score : 0.0, 0.5) << "another picture, heading " << step * 10;
    const auto floor = aligner.align(frame, other.camera(),
                                     {{-0.8, -0.6, wrap_angle(step * 10 * kDegree)}, 0.1}, AlignMode::coarse);
    EXPECT_LT(floor ? floor->score : 0.0, 0.5) << "floor, heading " << step * 10;
  }
}

TEST(Aligner, GivesNothingWhereThePictureLeavesTheFrame) {
  const test::FlatScene scene = scene_with({0.0, 0.0, 0.0});
  Aligner aligner(test::appearance_of(scene.pictures[0]));
  const Frame frame = scene.render();
  const double edge = 320 * scene.metres_per_px(0.1);
  EXPECT_FALSE(aligner.align(frame, scene.camera(), {{edge + 0.05, 0.0, 0.0}, 0.1}, AlignMode::coarse));
  EXPECT_FALSE(aligner.align(frame, scene.camera(), {{30.0, 0.0, 0.0}, 0.1}, AlignMode::coarse));
}

// The stated covariance against the scatter over noise: NEES of 3 on average if it is honest. Neighbouring
// samples share noise, which the covariance must allow for; one that did not would come out near 20.
TEST(Aligner, StatesACovarianceThatItsErrorsBearOut) {
  const Pose2 truth{0.15, -0.22, 1.1};
  test::FlatScene scene = scene_with(truth);
  scene.noise = 20.0;  // so that noise, not the bias that stays, makes the error
  Aligner aligner(test::appearance_of(scene.pictures[0]));
  double nees = 0.0;
  constexpr int kRuns = 60;
  std::vector<Eigen::Vector3d> errors;
  Eigen::Matrix3d stated = Eigen::Matrix3d::Zero();
  for (int run = 0; run < kRuns; ++run) {
    scene.seed = 100 + static_cast<std::uint32_t>(run);
    scene.floor_speckle = 0;
    const auto result = aligner.align(scene.render(), scene.camera(), {truth, 0.1}, AlignMode::fine);
    ASSERT_TRUE(result);
    errors.emplace_back(result->pose.x - truth.x, result->pose.y - truth.y,
                        wrap_angle(result->pose.yaw - truth.yaw));
    stated += result->covariance / kRuns;
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& error : errors) mean += error / kRuns;
  for (const auto& error : errors) nees += (error - mean).dot(stated.inverse() * (error - mean)) / kRuns;
  EXPECT_GT(nees, 0.8);
  EXPECT_LT(nees, 4.5);
}

// base_link away from the picture's centre: the same picture, another reference point, another pose.
TEST(Aligner, GivesThePoseOfBaseLinkNotOfThePicture) {
  const Pose2 centre{0.2, -0.1, 0.8};
  const test::FlatScene scene = scene_with(centre);
  const Eigen::Vector2d reference(0.05, -0.02);
  auto appearance = std::make_shared<const Appearance>("r", Picture{.image = scene.pictures[0].image,
                                                                    .metres_per_pixel = 0.001,
                                                                    .surface_height_m = 0.1,
                                                                    .reference_point_m = reference});
  const Eigen::Vector2d base = centre.position() + Eigen::Rotation2Dd(centre.yaw) * reference;
  Aligner aligner(appearance);
  const auto result = aligner.align(scene.render(), scene.camera(),
                                    {{base.x() + 0.003, base.y(), centre.yaw}, 0.1}, AlignMode::fine);
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->pose.x, base.x(), 0.0005);
  EXPECT_NEAR(result->pose.y, base.y(), 0.0005);
}

}  // namespace
}  // namespace skylight
