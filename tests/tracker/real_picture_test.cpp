// The baseline's matching on photographs of a painted wall, whose homographies were measured by others
// (Mikolajczyk et al., "A Comparison of Affine Region Detectors", IJCV 2005): the middle of the first picture
// and its upward direction have to come out where the measured homography puts them.
#include <fstream>
#include <iostream>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/shared_data.hpp"
#include "tracker/detect/homography.hpp"

namespace skylight {
namespace {

constexpr double kMetresPerPx = 0.001;

// Straight down, so that the floor is the picture itself: 1 mm per pixel, x to the right, y up.
CameraModel camera_over(const cv::Size& size) {
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  map_from_camera.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  map_from_camera.translation().z() = 1.0;
  return CameraModel({.width_px = size.width,
                      .height_px = size.height,
                      .fx_px = 1.0 / kMetresPerPx,
                      .fy_px = 1.0 / kMetresPerPx,
                      .cx_px = (size.width - 1) / 2.0,
                      .cy_px = (size.height - 1) / 2.0},
                     map_from_camera);
}

Pixel through(const Eigen::Matrix3d& homography, const Pixel& pixel) {
  return (homography * pixel.homogeneous()).hnormalized();
}

struct Pair {
  const char* picture;
  const char* homography;
  double within_px;
};

class GraffitiPair : public testing::TestWithParam<Pair> {};

TEST_P(GraffitiPair, IsMatchedToTheMeasuredHomography) {
  const auto folder = test::shared_data("planar/graf_full");
  if (!folder) GTEST_SKIP() << "planar/graf_full is not in the shared data";
  const cv::Mat first = cv::imread((*folder / "img1.png").string(), cv::IMREAD_GRAYSCALE);
  const cv::Mat other = cv::imread((*folder / GetParam().picture).string(), cv::IMREAD_GRAYSCALE);
  Eigen::Matrix3d truth;
  std::ifstream in(*folder / GetParam().homography);
  for (int i = 0; i < 9; ++i) in >> truth(i / 3, i % 3);
  ASSERT_FALSE(first.empty() || other.empty() || !in);

  HomographyConfig config{.features = 2000, .picture_px = first.cols, .margin_px = 0};
  config.drop = FloorDrop::ray;
  const auto appearance =
      std::make_shared<const Appearance>("wall", Picture{.image = first, .metres_per_pixel = kMetresPerPx});
  const HomographyDetector detector(appearance, config);
  const CameraModel camera = camera_over(other.size());
  const Frame frame{.image = other};
  const auto seen = detector.detect(frame, extract_homography_features(other, config.features), camera, 0.0);
  ASSERT_TRUE(seen);

  const Pixel middle((first.cols - 1) / 2.0, (first.rows - 1) / 2.0);
  const Pixel expected = through(truth, middle);
  const Pixel ahead = through(truth, middle - Pixel(0, first.cols / 4.0)) - expected;
  const double expected_yaw = std::atan2(-ahead.y(), ahead.x());
  const Pixel found = *camera.pixel_from_map({seen->pose.x, seen->pose.y, 0.0});
  const double turn = wrap_angle(seen->pose.yaw - expected_yaw) * 180 / std::numbers::pi;
  std::cout << "off by " << (found - expected).norm() << " px and " << turn << " deg, score " << seen->score
            << "\n";
  EXPECT_LT((found - expected).norm(), GetParam().within_px);
  EXPECT_NEAR(turn, 0.0, 1.0);
}

// A pixel: that is how well the published homographies themselves are known.
INSTANTIATE_TEST_SUITE_P(Graffiti, GraffitiPair,
                         testing::Values(Pair{"img2.png", "H1to2p", 1.0}, Pair{"img3.png", "H1to3p", 1.0}));

}  // namespace
}  // namespace skylight
