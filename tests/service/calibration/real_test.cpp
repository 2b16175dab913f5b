// Real cameras: pictures and pixel-floor points of others, in the shared data.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <regex>
#include <sstream>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/extrinsics.hpp"
#include "tests/support/board_scene.hpp"
#include "tests/support/shared_data.hpp"

namespace skylight::calibration {
namespace {

TEST(RealChessboards, GiveTheLensThatOpenCVsOwnCalibrationGives) {
  const auto folder = test::shared_data("planar/opencv_doc/chessboard");
  if (!folder) GTEST_SKIP() << "no shared data: planar/opencv_doc/chessboard";
  const Board board = parse_board("chessboard:9x6:0.025");
  std::vector<BoardView> views;
  for (int i = 1; i <= 14; ++i) {
    char name[16];
    std::snprintf(name, sizeof name, "left%02d.jpg", i);
    if (!std::filesystem::exists(*folder / name)) continue;  // there is no tenth
    const cv::Mat image = cv::imread((*folder / name).string());
    std::string why;
    const auto seen = find_board(image, board, why);
    ASSERT_TRUE(seen) << name << ": " << why;
    views.push_back({.name = name, .points = board_points(board), .pixels = seen->pixels});
  }
  ASSERT_EQ(views.size(), 13U);
  const auto result = calibrate_intrinsics(views, {.width_px = 640, .height_px = 480});
  const Intrinsics& in = result.intrinsics;
  std::printf("%.3f px RMS, fx %.2f +- %.2f, fy %.2f, cx %.2f +- %.2f, cy %.2f, k1 %.4f +- %.4f\n",
              result.rms_px, in.fx_px, std::sqrt(result.covariance(0, 0)), in.fy_px, in.cx_px,
              std::sqrt(result.covariance(2, 2)), in.cy_px, in.distortion[0],
              std::sqrt(result.covariance(4, 4)));
  for (const ViewResult& view : result.views)
    std::printf("%s %.2f px %s\n", view.name.c_str(), view.rms_px, view.why_not.c_str());
  EXPECT_EQ(in.lens, LensModel::brown_conrady) << result.lens_reason;
  EXPECT_LT(result.rms_px, 0.3);
  // left_intrinsics.yml beside the pictures: with one focal length, and 0.39 px in all because one view is
  // off.
  EXPECT_NEAR(in.fx_px, 535.9, 3.0);
  EXPECT_NEAR(in.fy_px, 535.9, 3.0);
  EXPECT_NEAR(in.cx_px, 342.3, 3.0);
  EXPECT_NEAR(in.cy_px, 235.6, 3.0);
  EXPECT_NEAR(in.distortion[0], -0.266, 0.03);
}

struct FloorPoint {
  Eigen::Vector2d at;
  Pixel pixel;
};

CameraResult camera_from(const std::vector<FloorPoint>& points, const Eigen::Vector2i& size, LensModel lens) {
  ExtrinsicsInput input{
      .sheets = {{.name = "points", .place = FloorPlace{}}},
      .cameras = {{.name = "camera",
                   .intrinsics = {.width_px = size.x(), .height_px = size.y(), .lens = lens},
                   .unknown_intrinsics = true}}};
  for (const FloorPoint& point : points)
    input.cameras[0].points.push_back(
        {.name = "point", .at = {point.at.x(), point.at.y(), 0.0}, .pixel = point.pixel});
  return calibrate_extrinsics(input).cameras[0];
}

/// How far the camera has the points from their places, m, sorted.
std::vector<double> errors(const CameraResult& result, const std::vector<FloorPoint>& points) {
  const CameraModel camera(result.intrinsics, result.map_from_camera);
  std::vector<double> out;
  for (const FloorPoint& point : points) {
    const auto at = camera.plane_from_pixel(point.pixel, 0.0);
    out.push_back(at ? (*at - point.at).norm() : INFINITY);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<FloorPoint> cpm_points(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<FloorPoint> points;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ';', ' ');
    std::istringstream numbers(line);
    FloorPoint point;
    if (numbers >> point.at.x() >> point.at.y() >> point.pixel.x() >> point.pixel.y())
      points.push_back(point);
  }
  return points;
}

struct Split {
  std::vector<FloorPoint> learnt;
  std::vector<FloorPoint> held_back;
};

template <class IsHeldBack>
Split split(const std::vector<FloorPoint>& points, const IsHeldBack& is_held_back) {
  Split out;
  for (const FloorPoint& point : points) (is_held_back(point) ? out.held_back : out.learnt).push_back(point);
  return out;
}

TEST(RealFloors, OfTheCpmLabAreKnownToMillimetresBetweenAndBeyondThePoints) {
  const auto file = test::shared_data("overhead/cpm_lab_ips/calibration_points.csv");
  if (!file) GTEST_SKIP() << "no shared data: overhead/cpm_lab_ips";
  const auto points = cpm_points(*file);
  ASSERT_EQ(points.size(), 1716U);
  test::Dice dice(1);
  const Split random = split(points, [&](const FloorPoint&) { return dice.uniform(0.0, 1.0) < 0.2; });
  const Split edge =
      split(points, [](const FloorPoint& point) { return point.at.x() < 1.0 && point.at.y() < 1.0; });
  for (const LensModel lens : {LensModel::brown_conrady, LensModel::kannala_brandt}) {
    const char* name = lens == LensModel::brown_conrady ? "pinhole" : "fisheye";
    double median[2];
    int i = 0;
    for (const Split& part : {random, edge}) {
      const CameraResult result = camera_from(part.learnt, {2048, 2048}, lens);
      const auto off = errors(result, part.held_back);
      median[i] = off[off.size() / 2];
      const auto left_out =
          std::count_if(result.points.begin(), result.points.end(), [](const auto& p) { return !p.used; });
      std::printf(
          "%s, %s held back: %zu points, median %.2f mm, largest %.2f mm; %.2f px RMS, fx %.1f, %td left "
          "out\n",
          name, i == 0 ? "random points" : "a block at the edge", off.size(), 1e3 * median[i],
          1e3 * off.back(), result.rms_px, result.intrinsics.fx_px, left_out);
      ++i;
    }
    EXPECT_LT(median[0], 0.003) << name;
    EXPECT_LT(median[1], 0.008) << name;
  }
}

TEST(RealFloors, OfSwistrackAreKnownBetterByALensThanByAHomography) {
  const auto folder = test::shared_data("overhead/swistrack_leurre");
  if (!folder) GTEST_SKIP() << "no shared data: overhead/swistrack_leurre";
  std::ifstream in(*folder / "calibrationPoints.xml");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::regex one(
      "<xworld>([^<]*)</xworld>\\s*<yworld>([^<]*)</yworld>\\s*<ximage>([^<]*)</ximage>\\s*<yimage>([^<]*)</"
      "yimage>");
  std::vector<FloorPoint> points;
  for (std::sregex_iterator at(text.begin(), text.end(), one), end; at != end; ++at)
    points.push_back({.at = {1e-3 * std::stod((*at)[1]), 1e-3 * std::stod((*at)[2])},
                      .pixel = {std::stod((*at)[3]), std::stod((*at)[4])}});
  const cv::Mat picture = cv::imread((*folder / "calibration.bmp").string());
  ASSERT_EQ(points.size(), 69U);
  // Their y grows downwards in the picture as x grows to the right: a left hand.
  EXPECT_THAT(
      [&] {
        camera_from(points, {picture.cols, picture.rows}, LensModel::brown_conrady);
      },
      testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("mirrored")));
  for (FloorPoint& point : points) point.at.y() = -point.at.y();
  const CameraResult result = camera_from(points, {picture.cols, picture.rows}, LensModel::brown_conrady);
  const auto off = errors(result, points);
  std::printf("median %.2f mm, largest %.2f mm, %.2f px RMS\n", 1e3 * off[34], 1e3 * off.back(),
              result.rms_px);
}

}  // namespace
}  // namespace skylight::calibration
