// Calibrations from rendered pictures with all their noise, judged against the camera that took them; ten
// seeds each, the figures are printed.
#include <cstdio>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "service/calibration/board.hpp"
#include "service/calibration/extrinsics.hpp"
#include "service/calibration/floor_fit.hpp"
#include "service/calibration/tags.hpp"
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

/// Tags of 20 cm laid over the room, and one picture of them.
CameraResult hung_by_tags(const sim::CameraParameters& parameters, const IntrinsicsResult& lens,
                          std::uint64_t seed) {
  test::BoardScene scene{.camera = parameters, .seed = seed + 500};
  ExtrinsicsInput input{
      .sheets = {{.name = "floor", .place = FloorPlace{}}},
      .cameras = {{.name = "ceiling", .intrinsics = lens.intrinsics, .covariance = lens.covariance}}};
  std::vector<FloorPlace> places;
  test::Dice dice(seed + 900);
  for (const double x : {-2.4, -0.8, 0.8, 2.4}) {
    for (const double y : {-2.4, 0.0, 2.4}) {
      places.push_back({x + dice.uniform(-0.2, 0.2), y + dice.uniform(-0.2, 0.2), dice.uniform(-3.0, 3.0)});
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translation() << places.back().x_m, places.back().y_m, 0.0;
      pose.linear() = Eigen::AngleAxisd(places.back().yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      scene.prints.push_back(test::tag_print(static_cast<int>(places.size()) - 1, 0.2, pose));
    }
  }
  const CameraModel model(lens.intrinsics, Eigen::Isometry3d::Identity());
  for (const TagSighting& tag : find_tags(scene.render(), tag_dictionary("36h11"), model)) {
    const auto corners = tag_points(0.2);
    for (std::size_t k = 0; k < 4; ++k)
      input.cameras[0].points.push_back(
          {.name = "tag " + std::to_string(tag.id) + ", corner",
           .at = in_map(places.at(static_cast<std::size_t>(tag.id)), {corners[k].x(), corners[k].y(), 0.0}),
           .pixel = tag.corners[k],
           .sigma_px = 0.1,
           .group = tag.id});
  }
  return calibrate_extrinsics(input).cameras[0];
}

struct FloorError {
  double rms_m = 0.0;
  double nees = 0.0;  ///< of x, y; its mean is 2 where the covariance is honest
};

/// Over the whole room of 6 x 6 m: where the calibrated camera has the pixels of places on the floor.
FloorError floor_error(const CameraResult& result, const sim::CameraParameters& parameters) {
  const sim::CameraModel truth(parameters);
  const CameraModel camera(result.intrinsics, result.map_from_camera);
  FloorError out;
  int count = 0;
  for (double x = -3.0; x <= 3.0; x += 0.25) {
    for (double y = -3.0; y <= 3.0; y += 0.25, ++count) {
      const auto seen = camera.plane_from_pixel(truth.project_map({x, y, 0.0}).value(), 0.0).value();
      const Eigen::Vector2d error = seen - Eigen::Vector2d(x, y);
      const Eigen::Matrix2d covariance =
          floor_covariance(camera, result.uncertainty, {x, y}, 0.0).value().topLeftCorner<2, 2>();
      out.rms_m += error.squaredNorm();
      out.nees += error.dot(covariance.inverse() * error);
    }
  }
  out.rms_m = std::sqrt(out.rms_m / count);
  out.nees /= count;
  return out;
}

TEST_P(Pictures, GiveACameraThatKnowsTheFloorOfTheWholeRoomAndHowWell) {
  auto truth = GetParam() ? test::fisheye_camera() : test::ceiling_camera();
  if (GetParam()) truth.map_from_camera.translation().z() = 3.0;
  const int parameters = GetParam() ? 8 : 9;
  double lens_nees = 0.0;
  double floor_nees = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto views = pictured_views(truth, 16, seed);
    EXPECT_GE(views.size(), 12U);
    const auto lens = calibrate_intrinsics(views, {.width_px = truth.width_px, .height_px = truth.height_px});
    EXPECT_EQ(lens.intrinsics.lens, test::intrinsics_of(truth).lens) << lens.lens_reason;
    EXPECT_LE(lens.rms_px, 0.2);
    const double ratio =
        test::nees(test::intrinsics_error(lens.intrinsics, test::intrinsics_of(truth)), lens.covariance);
    const CameraResult hung = hung_by_tags(truth, lens, seed);
    EXPECT_LE(hung.rms_px, 0.2);
    const FloorError floor = floor_error(hung, truth);
    EXPECT_LE(floor.rms_m, 0.0015);
    std::printf(
        "seed %2d: %2zu views, %.3f px RMS, NEES %4.1f; %2zu corners of tags, %.3f px RMS, floor %.2f mm "
        "RMS, NEES %.1f\n",
        static_cast<int>(seed), views.size(), lens.rms_px, ratio, hung.points.size(), hung.rms_px,
        1e3 * floor.rms_m, floor.nees);
    lens_nees += ratio / kSeeds;
    floor_nees += floor.nees / kSeeds;
  }
  std::printf("NEES %.1f of %d parameters of the lens, %.1f of 2 on the floor, means of %d seeds\n",
              lens_nees, parameters, floor_nees, kSeeds);
  EXPECT_NEAR(lens_nees, parameters, 4.0 * std::sqrt(2.0 * parameters / kSeeds));
  // Places of one calibration err together: a seed counts as a few, not as its 625 places.
  EXPECT_NEAR(floor_nees, 2.0, 2.0);
}

}  // namespace
}  // namespace skylight::calibration
