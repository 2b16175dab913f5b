// Lens and sensor from corners whose places the simulator's own projection worked out.
#include "service/calibration/intrinsics.hpp"

#include <algorithm>

#include <gmock/gmock.h>

#include "service/calibration/board.hpp"
#include "tests/service/calibration/cameras.hpp"

namespace skylight::calibration {
namespace {

using skylight::test::Dice;
using testing::HasSubstr;

const Board kBoard{.columns = 9, .rows = 6, .square_m = 0.03};

std::vector<BoardView> views_of(const sim::CameraParameters& parameters, int count, double sigma_px,
                                std::uint64_t seed, double distance_m = 0.45) {
  const sim::CameraModel camera(parameters);
  Dice dice(seed);
  std::vector<BoardView> views;
  for (const Eigen::Isometry3d& pose : test::held_boards(camera, count, distance_m, seed)) {
    BoardView view{.name = "view " + std::to_string(views.size())};
    for (const Eigen::Vector3d& place : board_points(kBoard)) {
      const auto pixel = camera.project(pose * place);
      if (!pixel) continue;
      view.points.push_back(place);
      view.pixels.emplace_back(*pixel + Eigen::Vector2d(dice.normal(sigma_px), dice.normal(sigma_px)));
    }
    views.push_back(view);
  }
  return views;
}

IntrinsicsOptions size_of(const sim::CameraParameters& p) {
  return {.width_px = p.width_px, .height_px = p.height_px};
}

std::string refusal(const std::vector<BoardView>& views, const IntrinsicsOptions& options) {
  try {
    calibrate_intrinsics(views, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CalibrateIntrinsics, FindsTheLensThatDrewPerfectCorners) {
  for (const auto& truth : {test::ceiling_camera(), test::fisheye_camera(), test::small_camera()}) {
    const auto result = calibrate_intrinsics(views_of(truth, 12, 0.0, 1), size_of(truth));
    EXPECT_EQ(result.intrinsics.lens, test::intrinsics_of(truth).lens) << result.lens_reason;
    EXPECT_LT(result.rms_px, 1e-4);
    EXPECT_LT(test::intrinsics_error(result.intrinsics, test::intrinsics_of(truth)).norm(), 1e-3);
  }
}

TEST(CalibrateIntrinsics, SaysHowFarItIsOff) {
  for (const bool fisheye : {false, true}) {
    const auto truth = fisheye ? test::fisheye_camera() : test::ceiling_camera();
    const int parameters = fisheye ? 8 : 9;
    IntrinsicsOptions options = size_of(truth);
    options.lens = test::intrinsics_of(truth).lens;
    constexpr int kSeeds = 10;
    double sum = 0.0;
    double rms = 0.0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      const auto result =
          calibrate_intrinsics(views_of(truth, 12, 0.1, static_cast<std::uint64_t>(seed)), options);
      sum += test::nees(test::intrinsics_error(result.intrinsics, test::intrinsics_of(truth)),
                        result.covariance);
      rms += result.rms_px / kSeeds;
    }
    // Chi-square of as many degrees of freedom: four standard deviations of its mean over the seeds.
    EXPECT_NEAR(sum / kSeeds, parameters, 4.0 * std::sqrt(2.0 * parameters / kSeeds))
        << "fisheye " << fisheye;
    EXPECT_NEAR(rms, 0.1 * std::sqrt(2.0), 0.01);
  }
}

TEST(CalibrateIntrinsics, DropsAViewThatContradictsTheOthersAndSaysWhy) {
  const auto truth = test::small_camera();
  auto views = views_of(truth, 12, 0.1, 3);
  for (std::size_t i = 0; i < views[4].pixels.size(); ++i)
    views[4].pixels[i] += Eigen::Vector2d(i % 9 < 4 ? 6.0 : -5.0, i % 2 == 0 ? 4.0 : -4.0);
  const auto result = calibrate_intrinsics(views, size_of(truth));
  EXPECT_FALSE(result.views[4].used);
  EXPECT_THAT(result.views[4].why_not, HasSubstr("px"));
  EXPECT_EQ(std::count_if(result.views.begin(), result.views.end(), [](const auto& v) { return v.used; }),
            11);
  EXPECT_LT(result.rms_px, 0.2);
  EXPECT_NEAR(result.intrinsics.fx_px, truth.fx_px, 2.0);
}

TEST(CalibrateIntrinsics, LeavesOutSingleCornersThatAreFarOff) {
  const auto truth = test::small_camera();
  auto views = views_of(truth, 12, 0.1, 4);
  views[2].pixels[10].x() += 15.0;
  views[7].pixels[0].y() -= 3.0;
  const auto result = calibrate_intrinsics(views, size_of(truth));
  EXPECT_TRUE(result.views[2].used);
  EXPECT_EQ(result.views[2].points_left_out, 1);
  EXPECT_EQ(result.views[7].points_left_out, 1);
  EXPECT_LT(result.rms_px, 0.2);
}

TEST(CalibrateIntrinsics, SaysWhichViewsAreMissing) {
  const auto truth = test::small_camera();
  std::vector<BoardView> left;
  for (const BoardView& view : views_of(truth, 24, 0.1, 5)) {
    const auto right_of = [](const Pixel& pixel) { return pixel.x() > 400.0; };
    if (std::none_of(view.pixels.begin(), view.pixels.end(), right_of)) left.push_back(view);
  }
  ASSERT_GE(left.size(), 5U);
  const auto result = calibrate_intrinsics(left, size_of(truth));
  EXPECT_THAT(result.warnings, testing::Contains(HasSubstr("the right edge")));
  const auto good = calibrate_intrinsics(views_of(truth, 24, 0.1, 5, 0.32), size_of(truth));
  EXPECT_THAT(good.warnings, testing::IsEmpty());
  EXPECT_GT(good.coverage.share(), 0.9);
  EXPECT_THAT(coverage_map(good.coverage), testing::SizeIs(Coverage::kRows));
}

TEST(CalibrateIntrinsics, RefusesWhatMakesNoCalibration) {
  const auto truth = test::small_camera();
  auto views = views_of(truth, 2, 0.1, 6);
  EXPECT_THAT(refusal(views, size_of(truth)), HasSubstr("found in 2 pictures, at least 3"));
  // Held flat before the camera at one distance, a long lens near and a short one far away look alike.
  const sim::CameraModel camera(truth);
  Dice dice(1);
  views.clear();
  for (int i = 0; i < 6; ++i) {
    BoardView view{.name = "flat"};
    const auto pose = test::camera_from_held(
        camera, {.pixel = {truth.cx_px, truth.cy_px}, .distance_m = 0.6, .turn = 0.2 * i});
    for (const Eigen::Vector3d& place : board_points(kBoard)) {
      view.points.push_back(place);
      view.pixels.emplace_back(*camera.project(pose * place) +
                               Eigen::Vector2d(dice.normal(0.2), dice.normal(0.2)));
    }
    views.push_back(view);
  }
  EXPECT_THAT(refusal(views, size_of(truth)), HasSubstr("tilted"));
  // Corners from a board with other proportions fit no lens.
  views = views_of(truth, 8, 0.1, 7);
  for (BoardView& view : views) std::reverse(view.pixels.begin(), view.pixels.begin() + 27);
  EXPECT_THAT(refusal(views, size_of(truth)), testing::AnyOf(HasSubstr("agree"), HasSubstr("fit no lens")));
}

}  // namespace
}  // namespace skylight::calibration
