// The simulator's projection against OpenCV's, which shares no code with it.
#include "sim/camera/camera_model.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

namespace skylight::sim {
namespace {

CameraParameters ceiling() {
  CameraParameters p;
  p.width_px = 1920;
  p.height_px = 1080;
  p.fx_px = 700.0;
  p.fy_px = 710.0;
  p.cx_px = 955.0;
  p.cy_px = 543.0;
  p.distortion = {-0.045, 0.010, 0.0004, -0.0003, 0.001};
  return p;
}

CameraParameters fisheye() {
  CameraParameters p = ceiling();
  p.lens = Lens::kannala_brandt;
  p.fx_px = p.fy_px = 700.0;
  p.distortion = {0.02, -0.006, 0.001, -0.0002, 0.0};
  return p;
}

cv::Matx33d matrix(const CameraParameters& p) {
  return {p.fx_px, 0, p.cx_px, 0, p.fy_px, p.cy_px, 0, 0, 1};
}

std::vector<cv::Point3d> points_in_view() {
  std::vector<cv::Point3d> points;
  for (double x = -4.0; x <= 4.0; x += 0.5) {
    for (double y = -2.5; y <= 2.5; y += 0.5) points.emplace_back(x, y, 3.0 + 0.1 * x);
  }
  return points;
}

TEST(SimCameraModel, ProjectsAsOpenCvDoesThroughABrownConradyLens) {
  const CameraModel camera(ceiling());
  const auto points = points_in_view();
  std::vector<cv::Point2d> expected;
  const auto d = ceiling().distortion;
  const cv::Vec<double, 5> coefficients(d.data());
  cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix(ceiling()), coefficients, expected);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = camera.project({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), expected[i].x, 1e-9);
    EXPECT_NEAR(pixel->y(), expected[i].y, 1e-9);
  }
}

TEST(SimCameraModel, ProjectsAsOpenCvDoesThroughAFisheye) {
  const CameraModel camera(fisheye());
  const auto points = points_in_view();
  std::vector<cv::Point2d> expected;
  const auto d = fisheye().distortion;
  cv::fisheye::projectPoints(points, expected, cv::Affine3d::Identity(), matrix(fisheye()),
                             cv::Vec4d(d[0], d[1], d[2], d[3]));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = camera.project({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), expected[i].x, 1e-9);
    EXPECT_NEAR(pixel->y(), expected[i].y, 1e-9);
  }
}

TEST(SimCameraModel, DirectionsLeadBackToTheirPixels) {
  for (const CameraParameters& parameters : {ceiling(), fisheye()}) {
    const CameraModel camera(parameters);
    for (double x = 0.0; x < 1920.0; x += 160.0) {
      for (double y = 0.0; y < 1080.0; y += 120.0) {
        const auto direction = camera.direction({x, y});
        ASSERT_TRUE(direction);
        const auto pixel = camera.project(2.7 * *direction);
        ASSERT_TRUE(pixel);
        EXPECT_NEAR(pixel->x(), x, 1e-9);
        EXPECT_NEAR(pixel->y(), y, 1e-9);
      }
    }
  }
}

TEST(SimCameraModel, SeesNothingBehindAPinholeOrWhereTheLensFoldsBack) {
  EXPECT_FALSE(CameraModel(ceiling()).project({0.1, 0.1, -1.0}));
  CameraParameters barrel = ceiling();
  barrel.distortion = {-0.3, 0.0, 0.0, 0.0, 0.0};  // r (1 - 0.3 r^2) turns back at r = 1.054
  const CameraModel camera(barrel);
  EXPECT_NEAR(camera.range(), 1.054, 0.01);
  EXPECT_FALSE(camera.project({1.2, 0.0, 1.0}));
  EXPECT_TRUE(camera.project({1.0, 0.0, 1.0}));
  EXPECT_FALSE(camera.direction({955.0 + 700.0 * 0.8, 543.0}));  // the largest distorted radius is 0.703
}

TEST(SimCameraModel, SeesSidewaysAndBackThroughAWideFisheye) {
  CameraParameters wide = fisheye();
  wide.distortion = {};
  const auto pixel = CameraModel(wide).project({1.0, 0.0, -0.1});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 955.0 + 700.0 * std::atan2(1.0, -0.1), 1e-9);
}

TEST(SimCameraModel, HoldsThePixelsWhoseAreaLiesInThePicture) {
  const CameraModel camera(ceiling());
  EXPECT_TRUE(camera.contains({-0.5, -0.5}));
  EXPECT_FALSE(camera.contains({-0.51, 0.0}));
  EXPECT_TRUE(camera.contains({1919.49, 1079.49}));
  EXPECT_FALSE(camera.contains({1919.5, 0.0}));
}

}  // namespace
}  // namespace skylight::sim
