// Calibrations from rendered pictures with all their noise, judged against the camera that took them; ten
// seeds each, the figures are printed.
#include <cstdio>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/intrinsics.hpp"
#include "tests/service/calibration/cameras.hpp"
#include "tests/support/shared_data.hpp"

namespace skylight::calibration {
namespace {

const Board kChess{.columns = 9, .rows = 6, .square_m = 0.06};
constexpr int kSeeds = 10;

std::vector<BoardView> pictured_views(const sim::CameraParameters& parameters, int count,
                                      std::uint64_t seed) {
  const sim::CameraModel camera(parameters);
  std::vector<BoardView> views;
  const auto points = board_points(kChess);
  std::uint64_t frame = 0;
  for (const Eigen::Isometry3d& pose : test::held_boards(camera, count, 0.95, seed)) {
    const test::BoardScene scene{
        .camera = parameters,
        .motion_px = 0.8,
        .seed = seed,
        .frame = ++frame,
        .prints = {test::chessboard_print(9, 6, 0.06, parameters.map_from_camera * pose)}};
    std::string why;
    const auto seen = find_board(scene.render(), kChess, why);
    if (!seen) continue;
    BoardView view{.name = "view " + std::to_string(frame), .pixels = seen->pixels};
    for (const int corner : seen->corners) view.points.push_back(points[static_cast<std::size_t>(corner)]);
    views.push_back(view);
  }
  return views;
}

class Pictures : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Lenses, Pictures, testing::Bool(),
                         [](const auto& lens) { return lens.param ? "Fisheye" : "Pinhole"; });

TEST_P(Pictures, GiveALensWithinAFifthOfAPixelThatSaysHowFarItIsOff) {
  const auto truth = GetParam() ? test::fisheye_camera() : test::ceiling_camera();
  const int parameters = GetParam() ? 8 : 9;
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto views = pictured_views(truth, 24, seed);
    const auto result =
        calibrate_intrinsics(views, {.width_px = truth.width_px, .height_px = truth.height_px});
    EXPECT_EQ(result.intrinsics.lens, test::intrinsics_of(truth).lens) << result.lens_reason;
    const double ratio =
        test::nees(test::intrinsics_error(result.intrinsics, test::intrinsics_of(truth)), result.covariance);
    sum += ratio;
    std::printf("seed %2d: %2zu views, %.3f px RMS, fx off by %+.3f px (sigma %.3f), NEES %.1f\n",
                static_cast<int>(seed), views.size(), result.rms_px, result.intrinsics.fx_px - truth.fx_px,
                std::sqrt(result.covariance(kFocalX, kFocalX)), ratio);
    EXPECT_LE(result.rms_px, 0.2);
    EXPECT_GE(views.size(), 20U);
  }
  std::printf("NEES %.1f of %d parameters, mean of %d seeds\n", sum / kSeeds, parameters, kSeeds);
  EXPECT_NEAR(sum / kSeeds, parameters, 4.0 * std::sqrt(2.0 * parameters / kSeeds));
}

}  // namespace
}  // namespace skylight::calibration
