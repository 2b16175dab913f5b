// Acquisition: ORB, correlation where ORB finds nothing, and the baseline's homography.
#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"
#include "tracker/detect/correlate.hpp"
#include "tracker/detect/homography.hpp"
#include "tracker/detect/orb.hpp"

namespace skylight {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
const cv::Scalar kBlue(250, 160, 130);
const cv::Scalar kGreen(90, 220, 110);

test::FlatScene textured(const Pose2& pose, std::uint32_t seed = 21) {
  test::FlatScene scene;
  scene.floor_speckle = 3000;
  scene.noise = 2.0;
  scene.pictures = {{.image = test::corner_picture(seed), .pose = pose}};
  return scene;
}

double upsample_for(const OrbModel& model, const test::FlatScene& scene) {
  return model.px_per_metre * scene.metres_per_px(0.1);
}

TEST(Orb, FindsThePoseAtEveryHeadingOnATexturedFloor) {
  const OrbConfig config;
  int found = 0;
  constexpr int kHeadings = 18;
  for (int step = 0; step < kHeadings; ++step) {
    const Pose2 truth{0.3, -0.1, wrap_angle(20.0 * step * kDegree + 0.05)};
    const test::FlatScene scene = textured(truth);
    const OrbModel model = make_orb_model(*test::appearance_of(scene.pictures[0]), config);
    ASSERT_FALSE(model.thin());
    const OrbScene seen = extract_orb(scene.render(), {200, 100, 300, 300}, upsample_for(model, scene));
    const auto poses = find_orb(model, seen, scene.camera(), 0.1, config);
    if (poses.empty()) continue;
    ++found;
    EXPECT_LT((poses[0].pose.position() - truth.position()).norm(), 2 * scene.metres_per_px(0.1)) << step;
    EXPECT_NEAR(wrap_angle(poses[0].pose.yaw - truth.yaw), 0.0, 4 * kDegree) << step;
  }
  EXPECT_GE(found, kHeadings - 1);
}

TEST(Orb, FindsEveryCopyOfOnePicture) {
  test::FlatScene scene = textured({-0.4, 0.2, 0.6});
  scene.pictures.push_back({.image = scene.pictures[0].image, .pose = {0.4, -0.3, 2.2}});
  const OrbConfig config;
  const OrbModel model = make_orb_model(*test::appearance_of(scene.pictures[0]), config);
  // One copy at a time is in the part that is looked at; a search that asks for two finds no third.
  const OrbScene left = extract_orb(scene.render(), {100, 50, 220, 300}, upsample_for(model, scene));
  const auto poses = find_orb(model, left, scene.camera(), 0.1, config, 3);
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_NEAR(poses[0].pose.x, -0.4, 0.012);
}

TEST(Orb, RefusesAFloorWithoutTheRobotAndAnotherPicture) {
  const OrbConfig config;
  const test::FlatScene mine = textured({0.0, 0.0, 0.0}, 21);
  const OrbModel model = make_orb_model(*test::appearance_of(mine.pictures[0]), config);
  for (std::uint32_t seed = 31; seed < 36; ++seed) {
    const test::FlatScene other = textured({0.1, 0.1, 0.2 * seed}, seed);
    const OrbScene scene = extract_orb(other.render(), {0, 0, 640, 480}, upsample_for(model, other));
    EXPECT_TRUE(find_orb(model, scene, other.camera(), 0.1, config).empty()) << seed;
  }
}

TEST(Orb, SaysThatAFewFlatPatchesAreTooLittle) {
  const test::PlacedPicture patches{.image = test::patch_picture(kBlue, kGreen)};
  EXPECT_TRUE(make_orb_model(*test::appearance_of(patches), OrbConfig{}).thin());
}

TEST(Orb, TakesAPartThatLiesOutsideTheFrameForEmpty) {
  const test::FlatScene scene = textured({0, 0, 0});
  EXPECT_TRUE(extract_orb(scene.render(), {700, 500, 100, 100}, 2.0).places_px.empty());
  EXPECT_TRUE(extract_orb(scene.render(), {}, 2.0).places_px.empty());
}

// 75 mm at 5.8 mm per pixel: 13 px, four times smaller in area than what ORB could use.
TEST(Correlate, FindsTwoFlatPatchesAtEveryHeading) {
  const CorrelateConfig config;
  for (int step = 0; step < 12; ++step) {
    test::FlatScene scene;
    scene.noise = 2.0;
    const Pose2 truth{0.2, 0.15, wrap_angle(30.0 * step * kDegree + 0.1)};
    scene.pictures = {
        {.image = test::patch_picture(kBlue, kGreen, 75), .metres_per_pixel = 0.002, .pose = truth}};
    const auto appearance = test::appearance_of(scene.pictures[0]);
    const CorrelateModel model = make_correlate_model(*appearance, config);
    const auto found =
        find_correlate(model, *appearance, scene.render(), scene.camera(), {{0.1, 0.1}, 0.4}, 0.1, config);
    ASSERT_FALSE(found.empty()) << step;
    EXPECT_LT((found[0].pose.position() - truth.position()).norm(), 0.02) << step;
    EXPECT_NEAR(wrap_angle(found[0].pose.yaw - truth.yaw), 0.0, 10 * kDegree) << step;
  }
}

TEST(Correlate, DoesNotTakeOtherColoursForItsOwn) {
  const CorrelateConfig config;
  test::FlatScene scene;
  scene.pictures = {{.image = test::patch_picture(cv::Scalar(40, 220, 240), cv::Scalar(60, 50, 230), 75),
                     .metres_per_pixel = 0.002,
                     .pose = {0.1, 0.1, 0.5}}};
  const test::PlacedPicture mine{.image = test::patch_picture(kBlue, kGreen, 75), .metres_per_pixel = 0.002};
  const auto appearance = test::appearance_of(mine);
  const auto found = find_correlate(make_correlate_model(*appearance, config), *appearance, scene.render(),
                                    scene.camera(), {{0.1, 0.1}, 0.4}, 0.1, config);
  for (const CorrelatePose& pose : found) EXPECT_LT(pose.score, 0.8);
}

TEST(Correlate, HasNothingToSayOnAGreyFrameWhereColourIsWhatTells) {
  const CorrelateConfig config;
  test::FlatScene scene;
  scene.pictures = {{.image = test::patch_picture(kBlue, kGreen, 75), .metres_per_pixel = 0.002}};
  Frame frame = scene.render();
  cv::cvtColor(frame.image, frame.image, cv::COLOR_BGR2GRAY);
  const auto appearance = test::appearance_of(scene.pictures[0]);
  EXPECT_TRUE(find_correlate(make_correlate_model(*appearance, config), *appearance, frame, scene.camera(),
                             {{0, 0}, 0.4}, 0.1, config)
                  .empty());
}

// The baseline on a plain floor and a large robot, where it works: 350 mm at 5.8 mm per pixel.
test::FlatScene baseline_scene() {
  test::FlatScene scene;
  scene.pictures = {{.image = test::corner_picture(41, 350), .height_m = 0.2, .pose = {0.8, 0.5, 0.4}}};
  return scene;
}

TEST(HomographyDetector, CarriesTheCentreToTheFloorAsThePaperDoes) {
  const test::FlatScene scene = baseline_scene();
  Frame frame = scene.render();
  const CameraModel camera = scene.camera();
  const auto features = extract_homography_features(frame.image, 500);
  const auto appearance = test::appearance_of(scene.pictures[0]);

  // No depth: the ray is cut with the plane of the picture.
  HomographyConfig config;
  auto seen = HomographyDetector(appearance, config).detect(frame, features, camera, 0.2);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->pose.x, 0.8, 0.01);
  EXPECT_NEAR(seen->pose.y, 0.5, 0.01);
  EXPECT_NEAR(seen->pose.yaw, 0.4, 2 * kDegree);

  // The ray that goes on to the floor lands further out: by height / camera height of the offset.
  config.drop = FloorDrop::ray;
  seen = HomographyDetector(appearance, config).detect(frame, features, camera, 0.2);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->pose.x, 0.8 * 3.0 / 2.8, 0.01);
  EXPECT_NEAR(seen->pose.y, 0.5 * 3.0 / 2.8, 0.01);

  // Depth at the mapped centre, dropped straight down.
  config.drop = FloorDrop::vertical;
  frame.depth = cv::Mat(frame.image.size(), CV_16UC1, cv::Scalar(2800));
  seen = HomographyDetector(appearance, config).detect(frame, features, camera, 0.2);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->pose.x, 0.8, 0.01);
}

TEST(HomographyDetector, StatesWhatTheNoiseOfTheDepthLeavesUnknown) {
  const test::FlatScene scene = baseline_scene();
  Frame frame = scene.render();
  const auto features = extract_homography_features(frame.image, 500);
  const auto seen_at = [&](int depth_mm, const HomographyConfig& config) {
    frame.depth = cv::Mat(frame.image.size(), CV_16UC1, cv::Scalar(depth_mm));
    return *HomographyDetector(test::appearance_of(scene.pictures[0]), config)
                .detect(frame, features, scene.camera(), 0.2);
  };
  const HomographyConfig kinect;
  HomographyConfig exact;
  exact.depth_noise_floor_m = exact.depth_noise_growth = 0.0;
  // A reading that is off by one sigma, 12.144 mm at 2.8 m, moves the place so far.
  const double sigma_m = 0.0012 + 0.0019 * 2.4 * 2.4;
  const Eigen::Vector2d moved =
      (seen_at(2900, exact).pose.position() - seen_at(2800, exact).pose.position()) * sigma_m / 0.1;
  EXPECT_GT(moved.norm(), 0.003);
  const Covariance3 by_depth = seen_at(2800, kinect).covariance - seen_at(2800, exact).covariance;
  EXPECT_NEAR((by_depth.topLeftCorner<2, 2>() - moved * moved.transpose()).norm(), 0.0,
              1e-6 * moved.squaredNorm());

  HomographyConfig ray = kinect;
  ray.drop = FloorDrop::ray;
  EXPECT_EQ(seen_at(2800, ray).covariance, seen_at(2900, ray).covariance) << "does not use the depth";
}

TEST(HomographyDetector, TakesTheDetectedPointForBaseLinkOrBaseScanAsTold) {
  const test::FlatScene scene = baseline_scene();
  const Frame frame = scene.render();
  const auto features = extract_homography_features(frame.image, 500);
  HomographyConfig config;
  config.reference_m = {-0.064, 0.0};  // the point that was found stands 64 mm behind base_link
  const auto seen = HomographyDetector(test::appearance_of(scene.pictures[0]), config)
                        .detect(frame, features, scene.camera(), 0.2);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->pose.x, 0.8 + 0.064 * std::cos(0.4), 0.01);
  EXPECT_NEAR(seen->pose.y, 0.5 + 0.064 * std::sin(0.4), 0.01);
}

TEST(HomographyDetector, RefusesAnEmptyFloorAndSettingsOutOfRange) {
  test::FlatScene scene = baseline_scene();
  const auto appearance = test::appearance_of(scene.pictures[0]);
  scene.pictures.clear();
  scene.floor_speckle = 1000;
  const Frame frame = scene.render();
  EXPECT_FALSE(HomographyDetector(appearance, {})
                   .detect(frame, extract_homography_features(frame.image, 500), scene.camera(), 0.2));
  HomographyConfig config;
  config.min_inliers = 3;
  EXPECT_THAT(check(config), testing::HasSubstr("homography.min_inliers is 3, allowed 4 to 1000"));
}

}  // namespace
}  // namespace skylight
