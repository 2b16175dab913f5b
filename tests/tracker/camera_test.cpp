#include "tracker/camera.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <ostream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

namespace skylight {
namespace {

using testing::HasSubstr;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Lens {
  const char* name;
  Intrinsics intrinsics;
};
void PrintTo(const Lens& lens, std::ostream* out) {
  *out << lens.name;
}

Intrinsics brown(int width, int height, double f, double cx, double cy, std::array<double, 5> distortion) {
  return {.width_px = width,
          .height_px = height,
          .fx_px = f,
          .fy_px = f * 1.003,
          .cx_px = cx,
          .cy_px = cy,
          .lens = LensModel::brown_conrady,
          .distortion = distortion};
}

Intrinsics fisheye(int width, int height, double f, double cx, double cy, std::array<double, 5> distortion) {
  Intrinsics out = brown(width, height, f, cx, cy, distortion);
  out.lens = LensModel::kannala_brandt;
  return out;
}

/// Coefficients of the size that calibrations of such lenses give; every picture lies within its model's
/// range.
std::vector<Lens> lenses() {
  return {
      {"ideal_pinhole", brown(1920, 1080, 1400, 959.5, 539.5, {})},
      {"webcam_1080p", brown(1920, 1080, 1391.2, 968.3, 541.7, {0.0912, -0.1874, 0.0007, -0.0011, 0.0631})},
      {"industrial_6mm",
       brown(1280, 1024, 1162.4, 641.9, 507.2, {-0.2283, 0.1467, 0.0003, -0.0004, -0.0432})},
      {"wide_barrel", brown(1280, 720, 698.0, 634.1, 365.8, {-0.3012, 0.1214, 0.0006, -0.0002, -0.0181})},
      {"action_camera_rectilinear",
       brown(1920, 1080, 901.4, 961.2, 534.6, {-0.2036, 0.0497, -0.0002, 0.0005, -0.0054})},
      {"tele_pincushion", brown(2048, 1536, 3120.5, 1011.4, 779.3, {0.1412, 0.3725, -0.0004, 0.0009, 0.0})},
      {"decentred", brown(640, 480, 525.0, 331.0, 231.0, {-0.11, 0.03, 0.018, -0.021, 0.0})},
      {"fisheye_150_degrees",
       fisheye(1600, 1200, 561.0, 806.7, 593.1, {0.0213, -0.0068, 0.0031, -0.0009, 0.0})},
      {"fisheye_185_degrees",
       fisheye(1280, 1280, 391.0, 641.2, 637.4, {-0.0148, 0.0042, -0.0036, 0.00055, 0.0})},
      {"fisheye_strong", fisheye(1280, 800, 285.7, 642.0, 399.8, {-0.0071, 0.0437, -0.0417, 0.0081, 0.0})},
  };
}

/// A ceiling camera: 3 m up, looking down, leant and turned a little so that no axis is special.
Eigen::Isometry3d ceiling() {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translate(Eigen::Vector3d(0.4, -0.3, 3.0));
  out.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) *
             Eigen::AngleAxisd(std::numbers::pi - 0.21, Eigen::Vector3d::UnitX()) *
             Eigen::AngleAxisd(0.12, Eigen::Vector3d::UnitY()));
  return out;
}

cv::Matx33d camera_matrix(const Intrinsics& in) {
  return {in.fx_px, 0, in.cx_px, 0, in.fy_px, in.cy_px, 0, 0, 1};
}

std::vector<Pixel> grid(const Intrinsics& in, int columns = 33, int rows = 25) {
  std::vector<Pixel> out;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      out.emplace_back(-0.5 + in.width_px * (static_cast<double>(c) / (columns - 1)),
                       -0.5 + in.height_px * (static_cast<double>(r) / (rows - 1)));
    }
  }
  out.emplace_back(in.cx_px, in.cy_px);
  out.emplace_back(in.cx_px + 1e-9, in.cy_px);
  return out;
}

class EveryLens : public testing::TestWithParam<Lens> {
 protected:
  const Intrinsics intrinsics_ = GetParam().intrinsics;
  const CameraModel camera_{intrinsics_, ceiling()};
};

INSTANTIATE_TEST_SUITE_P(Camera, EveryLens, testing::ValuesIn(lenses()),
                         [](const auto& param) { return std::string(param.param.name); });

TEST_P(EveryLens, ProjectsAsOpenCvDoes) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> spread(-0.45, 0.45);
  std::vector<cv::Point3d> points;
  for (int i = 0; i < 500; ++i) {
    const double z = 1.0 + 3.0 * (spread(random) + 0.45);
    points.emplace_back(spread(random) * z, spread(random) * z, z);
  }
  points.emplace_back(0, 0, 2);
  std::vector<cv::Point2d> expected;
  const auto& d = intrinsics_.distortion;
  const cv::Vec3d none(0, 0, 0);
  if (intrinsics_.lens == LensModel::kannala_brandt) {
    cv::fisheye::projectPoints(points, expected, none, none, camera_matrix(intrinsics_),
                               cv::Vec4d(d[0], d[1], d[2], d[3]));
  } else {
    cv::projectPoints(points, none, none, camera_matrix(intrinsics_),
                      cv::Vec<double, 5>(d[0], d[1], d[2], d[3], d[4]), expected);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = camera_.pixel_from_camera({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(pixel) << points[i];
    EXPECT_NEAR(pixel->x(), expected[i].x, 1e-9) << points[i];
    EXPECT_NEAR(pixel->y(), expected[i].y, 1e-9) << points[i];
  }
}

TEST_P(EveryLens, UndistortsAsOpenCvDoes) {
  const auto& d = intrinsics_.distortion;
  std::vector<Pixel> pixels = grid(intrinsics_, 9, 7);
  std::vector<cv::Point2d> in;
  for (const Pixel& p : pixels) in.emplace_back(p.x(), p.y());
  std::vector<cv::Point2d> expected;
  if (intrinsics_.lens == LensModel::kannala_brandt) {
    cv::fisheye::undistortPoints(in, expected, camera_matrix(intrinsics_), cv::Vec4d(d[0], d[1], d[2], d[3]));
  } else {
    cv::undistortPoints(in, expected, camera_matrix(intrinsics_),
                        cv::Vec<double, 5>(d[0], d[1], d[2], d[3], d[4]), cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 500, 1e-12));
  }
  int compared = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto ray = camera_.ray_from_pixel(pixels[i]);
    ASSERT_TRUE(ray) << pixels[i].transpose();
    if (ray->z() < 0.3) continue;  // OpenCV's tangents end at 90 degrees, and its iterations sooner
    ++compared;
    EXPECT_NEAR(ray->x() / ray->z(), expected[i].x, 2e-6 / ray->z()) << pixels[i].transpose();
    EXPECT_NEAR(ray->y() / ray->z(), expected[i].y, 2e-6 / ray->z()) << pixels[i].transpose();
  }
  EXPECT_GT(compared, 20);
}

TEST_P(EveryLens, PixelsSurviveTheWayOutAndBackOverTheWholePicture) {
  for (const Pixel& pixel : grid(intrinsics_)) {
    const auto ray = camera_.ray_from_pixel(pixel);
    ASSERT_TRUE(ray) << pixel.transpose();
    EXPECT_NEAR(ray->norm(), 1.0, 1e-14);
    for (const double distance : {0.01, 1.0, 250.0}) {
      const auto back = camera_.pixel_from_camera(*ray * distance);
      ASSERT_TRUE(back) << pixel.transpose();
      EXPECT_LT((*back - pixel).norm(), 1e-9) << pixel.transpose() << " -> " << back->transpose();
    }
  }
}

TEST_P(EveryLens, RaysSurviveTheWayInAndBack) {
  for (const Pixel& pixel : grid(intrinsics_, 15, 15)) {
    // A ray that did not come from the inverse: its own pixel gives it back.
    const Eigen::Vector3d ray =
        (*camera_.ray_from_pixel(pixel) + Eigen::Vector3d(1e-3, -2e-3, 3e-3)).normalized();
    const auto there = camera_.pixel_from_camera(ray);
    ASSERT_TRUE(there) << pixel.transpose();
    const auto back = camera_.ray_from_pixel(*there);
    ASSERT_TRUE(back) << pixel.transpose();
    EXPECT_LT((*back - ray).norm(), 1e-9) << pixel.transpose();
  }
}

/// Columns by central differences, the step chosen against both rounding and curvature.
template <int Rows, int Columns, typename F>
Eigen::Matrix<double, Rows, Columns> numerical(const F& f, const Eigen::Matrix<double, Columns, 1>& at,
                                               double step) {
  Eigen::Matrix<double, Rows, Columns> out;
  for (int c = 0; c < Columns; ++c) {
    const Eigen::Matrix<double, Columns, 1> h = step * Eigen::Matrix<double, Columns, 1>::Unit(c);
    // Richardson: the curvature's term of the two steps cancels.
    const Eigen::Matrix<double, Rows, 1> wide = (f(at + h) - f(at - h)) / (2 * step);
    const Eigen::Matrix<double, Rows, 1> narrow = (f(at + h / 2) - f(at - h / 2)) / step;
    out.col(c) = (4 * narrow - wide) / 3;
  }
  return out;
}

TEST_P(EveryLens, PixelJacobiansAreTheNumericalOnes) {
  for (const Pixel& pixel : grid(intrinsics_, 7, 7)) {
    const Eigen::Vector3d point = 2.7 * *camera_.ray_from_pixel(pixel);
    CameraModel::PixelByPoint jacobian;
    ASSERT_TRUE(camera_.pixel_from_camera(point, &jacobian));
    const auto in_camera = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
      return *camera_.pixel_from_camera(p);
    };
    EXPECT_LT((jacobian - numerical<2, 3>(in_camera, point, 1e-3)).norm(), 1e-6 * jacobian.norm())
        << pixel.transpose();

    const Eigen::Vector3d in_map = camera_.map_from_camera() * point;
    ASSERT_TRUE(camera_.pixel_from_map(in_map, &jacobian));
    const auto from_map = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
      return *camera_.pixel_from_map(p);
    };
    EXPECT_LT((jacobian - numerical<2, 3>(from_map, in_map, 1e-3)).norm(), 1e-6 * jacobian.norm())
        << pixel.transpose();
    EXPECT_LT((*camera_.pixel_from_map(in_map) - pixel).norm(), 1e-9);
  }
}

TEST_P(EveryLens, RayAndPlaneJacobiansAreTheNumericalOnes) {
  for (const Pixel& pixel : grid(intrinsics_, 7, 7)) {
    CameraModel::RayByPixel by_pixel;
    ASSERT_TRUE(camera_.ray_from_pixel(pixel, &by_pixel));
    const auto ray = [&](const Pixel& p) -> Eigen::Vector3d { return *camera_.ray_from_pixel(p); };
    EXPECT_LT((by_pixel - numerical<3, 2>(ray, pixel, 0.1)).norm(), 1e-6 * by_pixel.norm())
        << pixel.transpose();

    Eigen::Matrix2d on_floor;
    const auto place = camera_.plane_from_pixel(pixel, 0.141, &on_floor);
    if (!place || place->norm() > 30.0) continue;  // toward the horizon of a fisheye
    const auto floor = [&](const Pixel& p) -> Eigen::Vector2d { return *camera_.plane_from_pixel(p, 0.141); };
    EXPECT_LT((on_floor - numerical<2, 2>(floor, pixel, 0.05)).norm(), 1e-6 * on_floor.norm())
        << pixel.transpose();
  }
}

TEST_P(EveryLens, APixelCarriedToAPlaneIsSeenAtThatPixel) {
  int on_plane = 0;
  for (const Pixel& pixel : grid(intrinsics_, 11, 11)) {
    for (const double height : {-0.5, 0.0, 0.141, 2.5}) {
      const auto place = camera_.plane_from_pixel(pixel, height);
      if (!place) continue;
      ++on_plane;
      const auto back = camera_.pixel_from_map({place->x(), place->y(), height});
      ASSERT_TRUE(back) << pixel.transpose();
      EXPECT_LT((*back - pixel).norm(), 1e-8) << pixel.transpose() << " at height " << height;
    }
  }
  EXPECT_GT(on_plane, 200);
}

TEST(Camera, ADownwardPinholeMeetsTheFloorBySimilarTriangles) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(Eigen::Vector3d(1.0, 2.0, 3.0));
  pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));  // x stays, y and z turn over
  const CameraModel camera(brown(1000, 800, 500, 500, 400, {}), pose);
  Eigen::Matrix2d jacobian;
  const auto floor = camera.plane_from_pixel({600.0, 400.0}, 0.0, &jacobian);
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->x(), 1.0 + 3.0 * 100 / 500, 1e-12);
  EXPECT_NEAR(floor->y(), 2.0, 1e-12);
  EXPECT_NEAR(jacobian(0, 0), 3.0 / 500, 1e-12);
  EXPECT_NEAR(jacobian(1, 1), -3.0 / (500 * 1.003), 1e-12);
  EXPECT_NEAR(camera.plane_from_pixel({600.0, 400.0}, 1.0)->x(), 1.0 + 2.0 * 100 / 500, 1e-12);
  // Planes at and above the camera are behind it.
  EXPECT_FALSE(camera.plane_from_pixel({600.0, 400.0}, 3.0));
  EXPECT_FALSE(camera.plane_from_pixel({600.0, 400.0}, 3.5));
}

TEST(Camera, RaysParallelToThePlaneOrAwayFromItMeetNothing) {
  Eigen::Isometry3d level = Eigen::Isometry3d::Identity();  // looks along map x, image y down
  level.translate(Eigen::Vector3d(0.0, 0.0, 2.0));
  Eigen::Matrix3d rotation;
  rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  level.rotate(rotation);
  const CameraModel camera(brown(1000, 800, 500, 500, 400, {}), level);
  EXPECT_FALSE(camera.plane_from_pixel({500.0, 400.0}, 0.0)) << "along the horizon";
  EXPECT_FALSE(camera.plane_from_pixel({100.0, 400.0}, 0.0)) << "along the horizon, to the side";
  EXPECT_FALSE(camera.plane_from_pixel({500.0, 300.0}, 0.0)) << "upward, floor below";
  EXPECT_FALSE(camera.plane_from_pixel({500.0, 500.0}, 5.0)) << "downward, plane above";
  const auto below = camera.plane_from_pixel({500.0, 400.0 + 1.003 * 250.0}, 0.0);
  ASSERT_TRUE(below);
  EXPECT_NEAR(below->x(), 2.0 / 0.5, 1e-12);
}

TEST(Camera, NothingBehindAPinholeHasAPixelAndAFisheyeSeesPastTheSide) {
  const CameraModel pinhole(lenses()[1].intrinsics, ceiling());
  EXPECT_FALSE(pinhole.pixel_from_camera({0.1, 0.1, -1.0}));
  EXPECT_FALSE(pinhole.pixel_from_camera({0.1, 0.1, 0.0}));
  EXPECT_FALSE(pinhole.pixel_from_camera({0.0, 0.0, 0.0}));
  EXPECT_FALSE(pinhole.pixel_from_map(ceiling() * Eigen::Vector3d(0.0, 0.0, -0.5)));

  const CameraModel wide(fisheye(1280, 1280, 391, 639.5, 639.5, {}), ceiling());
  const double angle = 1.61;  // 92 degrees
  const auto pixel = wide.pixel_from_camera({std::sin(angle), 0.0, std::cos(angle)});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 639.5 + 391 * angle, 1e-9);
  EXPECT_NEAR((*wide.ray_from_pixel(*pixel)).z(), std::cos(angle), 1e-12);
  EXPECT_FALSE(wide.pixel_from_camera({0.0, 0.0, -1.0}));
  EXPECT_FALSE(wide.pixel_from_camera({0.0, 0.0, 0.0}));
}

TEST(Camera, EndsAtTheRadiusWhereTheDistortionFoldsBack) {
  // d/dr (r - 0.25 r^3) = 0 at r = sqrt(4/3), whose image is 2/3 of that.
  const CameraModel camera(brown(1400, 1000, 500, 699.5, 499.5, {-0.25, 0, 0, 0, 0}), ceiling());
  const double fold = std::sqrt(4.0 / 3.0);
  EXPECT_TRUE(camera.pixel_from_camera({fold - 1e-6, 0.0, 1.0}));
  EXPECT_FALSE(camera.pixel_from_camera({fold + 1e-6, 0.0, 1.0}))
      << "shares its pixel with a nearer direction";
  EXPECT_FALSE(camera.pixel_from_camera({1.9, 0.0, 1.0}));
  const double edge = 699.5 + 500 * fold * 2.0 / 3.0;
  ASSERT_LT(edge, 1399.0);
  EXPECT_TRUE(camera.ray_from_pixel({edge - 0.01, 499.5}));
  EXPECT_FALSE(camera.ray_from_pixel({edge + 0.01, 499.5}));
  EXPECT_FALSE(camera.ray_from_pixel({1399.0, 0.0}));
  const auto near_fold = camera.ray_from_pixel({edge - 1e-3, 499.5});
  ASSERT_TRUE(near_fold);
  EXPECT_NEAR(camera.pixel_from_camera(*near_fold)->x(), edge - 1e-3, 1e-9);
}

TEST(Camera, AFisheyeEndsAtTheAngleWhereItsPolynomialFoldsBack) {
  // d/dtheta (theta - theta^3 / 12) = 0 at theta = 2.
  const CameraModel camera(fisheye(1400, 1400, 400, 699.5, 699.5, {-1.0 / 12, 0, 0, 0, 0}), ceiling());
  const auto at = [&](double theta) {
    return camera.pixel_from_camera({0.0, std::sin(theta), std::cos(theta)});
  };
  EXPECT_TRUE(at(2.0 - 1e-6));
  EXPECT_FALSE(at(2.0 + 1e-6));
  const double edge = 699.5 + 400 * 1.003 * (2.0 - 8.0 / 12);
  EXPECT_TRUE(camera.ray_from_pixel({699.5, edge - 0.01}));
  EXPECT_FALSE(camera.ray_from_pixel({699.5, edge + 0.01}));
}

TEST(Camera, NoTwoDirectionsShareAPixelUnderStrongTangentialTerms) {
  const CameraModel camera(brown(640, 480, 300, 319.5, 239.5, {-0.2, 0.02, 0.06, -0.05, 0.0}), ceiling());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> spread(-2.5, 2.5);
  int inside = 0;
  int outside = 0;
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector3d direction = Eigen::Vector3d(spread(random), spread(random), 1.0).normalized();
    CameraModel::PixelByPoint jacobian;
    const auto pixel = camera.pixel_from_camera(direction, &jacobian);
    if (!pixel) {
      ++outside;
      continue;
    }
    ++inside;
    EXPECT_GT(jacobian.leftCols<2>().determinant(), 0.0) << direction.transpose();
    const auto back = camera.ray_from_pixel(*pixel);
    ASSERT_TRUE(back) << direction.transpose();
    // Where the model folds, a direction is known only to the square root of the pixel's rounding.
    EXPECT_LT((*back - direction).norm(), 1e-6)
        << direction.transpose() << " came back as " << back->transpose();
    EXPECT_LT((*camera.pixel_from_camera(*back) - *pixel).norm(), 1e-9);
  }
  EXPECT_GT(inside, 300);
  EXPECT_GT(outside, 300);
}

TEST(Camera, NanAndInfinityHaveNeitherPixelNorRay) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const Lens& lens : lenses()) {
    const CameraModel camera(lens.intrinsics, ceiling());
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      EXPECT_FALSE(camera.ray_from_pixel({bad, 100.0})) << lens.name;
      EXPECT_FALSE(camera.ray_from_pixel({100.0, bad})) << lens.name;
      EXPECT_FALSE(camera.plane_from_pixel({bad, 100.0}, 0.0)) << lens.name;
      EXPECT_FALSE(camera.plane_from_pixel({100.0, 100.0}, bad)) << lens.name;
      EXPECT_FALSE(camera.pixel_from_camera({bad, 0.0, 1.0})) << lens.name;
      EXPECT_FALSE(camera.pixel_from_camera({0.0, bad, 1.0})) << lens.name;
      EXPECT_FALSE(camera.pixel_from_camera({0.1, 0.0, bad})) << lens.name;
      EXPECT_FALSE(camera.pixel_from_map({bad, 0.0, 0.0})) << lens.name;
      EXPECT_FALSE(camera.sees({bad, 100.0})) << lens.name;
    }
    EXPECT_FALSE(camera.sees({kNan, kNan})) << lens.name;
  }
}

TEST(Camera, SeesThePictureUpToItsMargin) {
  const CameraModel camera(brown(640, 480, 500, 320, 240, {}), ceiling());
  EXPECT_TRUE(camera.sees({-0.5, -0.5}));
  EXPECT_TRUE(camera.sees({639.5, 479.5}));
  EXPECT_FALSE(camera.sees({-0.51, 100.0}));
  EXPECT_FALSE(camera.sees({100.0, 479.51}));
  EXPECT_TRUE(camera.sees({9.5, 469.5}, 10.0));
  EXPECT_FALSE(camera.sees({9.49, 100.0}, 10.0));
  EXPECT_TRUE(camera.sees({-10.5, 489.5}, -10.0));
}

TEST(Camera, BadIntrinsicsAreNamedWithFieldValueAndRange) {
  const Intrinsics good = brown(640, 480, 500, 320, 240, {});
  EXPECT_EQ(check(good), "");
  const auto with = [&](auto change) {
    Intrinsics bad = good;
    change(bad);
    return check(bad);
  };
  EXPECT_THAT(with([](Intrinsics& i) { i.width_px = 0; }),
              HasSubstr("width_px is 0, must lie in [1, 65535]"));
  EXPECT_THAT(with([](Intrinsics& i) { i.height_px = -3; }), HasSubstr("height_px is -3"));
  EXPECT_THAT(with([](Intrinsics& i) { i.height_px = 70'000; }), HasSubstr("height_px is 70000"));
  EXPECT_THAT(with([](Intrinsics& i) { i.fx_px = kNan; }), HasSubstr("fx_px is nan"));
  EXPECT_THAT(with([](Intrinsics& i) { i.fy_px = -500; }), HasSubstr("fy_px is -500"));
  EXPECT_THAT(with([](Intrinsics& i) { i.cx_px = 640; }),
              HasSubstr("cx_px is 640, must lie in [-0.5, 639.5]"));
  EXPECT_THAT(with([](Intrinsics& i) { i.cy_px = -1; }), HasSubstr("cy_px is -1"));
  EXPECT_THAT(with([](Intrinsics& i) { i.distortion[3] = kNan; }), HasSubstr("distortion p2 is nan"));
  EXPECT_THAT(with([](Intrinsics& i) {
                i.lens = LensModel::kannala_brandt;
                i.distortion[4] = 0.1;
              }),
              HasSubstr("distortion[4] (unused by kannala_brandt) is 0.1"));
  Intrinsics bad = good;
  bad.fx_px = 0;
  EXPECT_THROW(CameraModel(bad, ceiling()), std::invalid_argument);
}

TEST(Camera, APoseThatIsNoRigidMotionIsRefused) {
  const Intrinsics good = brown(640, 480, 500, 320, 240, {});
  Eigen::Isometry3d scaled = ceiling();
  scaled.linear() *= 1.01;
  EXPECT_THROW(CameraModel(good, scaled), std::invalid_argument);
  Eigen::Isometry3d mirrored = ceiling();
  mirrored.linear().col(0) *= -1.0;
  EXPECT_THROW(CameraModel(good, mirrored), std::invalid_argument);
  Eigen::Isometry3d nowhere = ceiling();
  nowhere.translation().x() = kNan;
  EXPECT_THROW(CameraModel(good, nowhere), std::invalid_argument);
}

}  // namespace
}  // namespace skylight
