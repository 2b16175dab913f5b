// Where a camera hangs, from points whose pixels the simulator's own projection worked out.
#include "service/calibration/extrinsics.hpp"

#include <algorithm>

#include <gmock/gmock.h>

#include "tests/service/calibration/cameras.hpp"

namespace skylight::calibration {
namespace {

using skylight::test::Dice;
using testing::HasSubstr;

sim::CameraParameters hung(const sim::CameraParameters& lens, const std::array<double, 3>& position,
                           const std::array<double, 3>& rpy_deg) {
  sim::CameraSpec spec;
  spec.position_m = position;
  spec.rpy_deg = rpy_deg;
  sim::CameraParameters out = lens;
  out.map_from_camera = sim::map_from_camera(spec);
  return out;
}

sim::CameraParameters leaning() {
  return hung(test::ceiling_camera(), {0.3, -0.2, 3.9}, {6.0, -4.0, 25.0});
}

/// The tapes' crosses of somebody with patience: 3 x 3 over the room.
std::vector<SeenPoint> crosses(const sim::CameraParameters& parameters, double sigma_px, std::uint64_t seed) {
  const sim::CameraModel camera(parameters);
  Dice dice(seed);
  std::vector<SeenPoint> points;
  for (const double x : {-2.2, 0.1, 2.3}) {
    for (const double y : {-1.9, 0.0, 2.0}) {
      const auto pixel = camera.project_map({x, y, 0.0});
      if (!pixel || !camera.contains(*pixel)) continue;
      points.push_back({.name = "point " + std::to_string(points.size() + 1),
                        .at = {x, y, 0.0},
                        .pixel = *pixel + Eigen::Vector2d(dice.normal(sigma_px), dice.normal(sigma_px)),
                        .sigma_px = std::max(sigma_px, 1e-3)});
    }
  }
  return points;
}

const Sheet kMap{.name = "points", .place = FloorPlace{}};

ExtrinsicsInput with_points(const sim::CameraParameters& lens, std::vector<SeenPoint> points) {
  return {
      .sheets = {kMap},
      .cameras = {{.name = "ceiling", .intrinsics = test::intrinsics_of(lens), .points = std::move(points)}}};
}

/// Of (position, rotation about the axes of map), estimate less truth.
Eigen::Matrix<double, 6, 1> pose_error(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(estimate.linear() * truth.linear().transpose()));
  Eigen::Matrix<double, 6, 1> out;
  out << estimate.translation() - truth.translation(), turn.angle() * turn.axis();
  return out;
}

std::string refusal(const ExtrinsicsInput& input) {
  try {
    calibrate_extrinsics(input);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CalibrateExtrinsics, FindsWhereTheCameraHangs) {
  for (const auto& truth : {leaning(), hung(test::fisheye_camera(), {-0.5, 0.4, 3.2}, {-8.0, 3.0, -140.0})}) {
    const auto result = calibrate_extrinsics(with_points(truth, crosses(truth, 0.0, 1)));
    EXPECT_LT(pose_error(result.cameras[0].map_from_camera, truth.map_from_camera).norm(), 1e-6);
    EXPECT_LT(result.cameras[0].rms_px, 1e-6);
    EXPECT_LT(result.cameras[0].rms_m, 1e-8);
  }
}

TEST(CalibrateExtrinsics, SaysHowFarThePoseIsOff) {
  const auto truth = leaning();
  constexpr int kSeeds = 40;
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto result = calibrate_extrinsics(with_points(truth, crosses(truth, 0.7, seed)));
    const auto& covariance = result.cameras[0].uncertainty.covariance;
    EXPECT_EQ(check(result.cameras[0].uncertainty), "");
    sum += test::nees(pose_error(result.cameras[0].map_from_camera, truth.map_from_camera),
                      covariance.bottomRightCorner<6, 6>());
  }
  // The noise is found anew from few residuals, so that the tails are a little heavier than chi-square's.
  EXPECT_NEAR(sum / kSeeds, 6.0, 1.2 + 4.0 * std::sqrt(12.0 / kSeeds));
}

TEST(CalibrateExtrinsics, CarriesOnWhatTheIntrinsicsLeaveOpen) {
  const auto truth = leaning();
  const Intrinsics exact = test::intrinsics_of(truth);
  constexpr int kSeeds = 40;
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Dice dice(seed + 1000);
    ExtrinsicsInput input = with_points(truth, crosses(truth, 0.3, seed));
    SeeingCamera& camera = input.cameras[0];
    camera.covariance.diagonal() << 4.0, 4.0, 2.25, 2.25, 1e-6, 1e-6, 1e-8, 1e-8, 0.0;
    camera.covariance(0, 1) = camera.covariance(1, 0) = 3.6;  // both focal lengths err together
    const double common = dice.normal(2.0);
    camera.intrinsics.fx_px += common;
    camera.intrinsics.fy_px += 0.9 * common + dice.normal(2.0 * std::sqrt(1.0 - 0.81));
    camera.intrinsics.cx_px += dice.normal(1.5);
    camera.intrinsics.cy_px += dice.normal(1.5);
    for (std::size_t i = 0; i < 4; ++i) camera.intrinsics.distortion[i] += dice.normal(i < 2 ? 1e-3 : 1e-4);
    const auto result = calibrate_extrinsics(input);
    Eigen::Matrix<double, kCameraParameters, 1> error;
    error << test::intrinsics_error(result.cameras[0].intrinsics, exact),
        pose_error(result.cameras[0].map_from_camera, truth.map_from_camera);
    sum += test::nees(error, result.cameras[0].uncertainty.covariance);
    // A long lens from higher up sees the same: neither is found, both are known to go together.
    EXPECT_GT(result.cameras[0].uncertainty.covariance(kFocalX, kCameraPosition + 2), 0.0);
  }
  EXPECT_NEAR(sum / kSeeds, 14.0, 1.5 + 4.0 * std::sqrt(28.0 / kSeeds));
}

TEST(CalibrateExtrinsics, NamesAPointThatIsFarOffAndLeavesItOut) {
  const auto truth = leaning();
  auto points = crosses(truth, 0.5, 3);
  points[3].at.x() += 0.3;
  const auto result = calibrate_extrinsics(with_points(truth, points));
  EXPECT_FALSE(result.cameras[0].points[3].used);
  EXPECT_THAT(result.cameras[0].points[3].why_not, HasSubstr("m) from where it should be"));
  EXPECT_NEAR(result.cameras[0].points[3].residual_m.x(), -0.3, 0.02);
  EXPECT_EQ(std::count_if(result.cameras[0].points.begin(), result.cameras[0].points.end(),
                          [](const PointResult& point) { return point.used; }),
            8);
  EXPECT_LT(pose_error(result.cameras[0].map_from_camera, truth.map_from_camera).norm(), 0.02);
}

TEST(CalibrateExtrinsics, BelievesTapeMeasuresNoMoreThanTheyDeserve) {
  const auto truth = leaning();
  auto points = crosses(truth, 0.1, 5);
  for (SeenPoint& point : points) point.sigma_m = 0.004;
  const auto rough = calibrate_extrinsics(with_points(truth, points));
  for (SeenPoint& point : points) point.sigma_m = 0.0;
  const auto exact = calibrate_extrinsics(with_points(truth, points));
  // The residuals, far below 4 mm, speak against the tape's figure, but the stated one counts too.
  EXPECT_GT(rough.cameras[0].worst_floor_sigma_m, 1.5 * exact.cameras[0].worst_floor_sigma_m);
}

TEST(CalibrateExtrinsics, NamesWhatIsWrongWithTheInput) {
  const auto truth = leaning();
  const auto good = crosses(truth, 0.3, 1);
  auto points = good;
  points.resize(3);
  EXPECT_THAT(refusal(with_points(truth, points)), HasSubstr("ceiling: at least 4 points"));
  points = good;
  std::erase_if(points, [](const SeenPoint& point) { return std::abs(point.at.y()) > 0.1; });
  points.push_back(points[0]);
  EXPECT_THAT(refusal(with_points(truth, points)), HasSubstr("in one line"));
  points = good;
  for (SeenPoint& point : points) std::swap(point.at.x(), point.at.y());
  EXPECT_THAT(refusal(with_points(truth, points)), HasSubstr("mirrored"));
  points = good;
  for (SeenPoint& point : points) point.at.y() = -point.at.y();
  EXPECT_THAT(refusal(with_points(truth, points)), HasSubstr("mirrored"));
  points = good;
  points[2].pixel.x() = 1920.0;
  EXPECT_THAT(refusal(with_points(truth, points)), HasSubstr("point 3 at (1920.0, "));
  points = good;
  for (std::size_t i = 0; i < points.size(); ++i) points[i].at = good[(i * 4 + 3) % good.size()].at;
  EXPECT_THAT(refusal(with_points(truth, points)), HasSubstr("no pose of the camera agrees"));
  ExtrinsicsInput nowhere = with_points(truth, good);
  nowhere.sheets[0].place.reset();
  EXPECT_THAT(refusal(nowhere), HasSubstr("no place in map is known"));
}

/// Four corners of square tags, 0.2 m, on a sheet.
std::vector<SeenPoint> tags(const sim::CameraParameters& parameters, const std::vector<FloorPlace>& places,
                            double stated_m, std::size_t sheet, const FloorPlace& true_sheet,
                            std::uint64_t seed) {
  const sim::CameraModel camera(parameters);
  Dice dice(seed);
  std::vector<SeenPoint> out;
  for (std::size_t tag = 0; tag < places.size(); ++tag) {
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector2d unit(corner == 0 || corner == 3 ? -0.5 : 0.5, corner < 2 ? 0.5 : -0.5);
      const auto at = [&](double size) {
        const Eigen::Vector2d turned = Eigen::Rotation2Dd(places[tag].yaw_rad) * (size * unit);
        return Eigen::Vector3d(places[tag].x_m + turned.x(), places[tag].y_m + turned.y(), 0.0);
      };
      const Eigen::Vector3d on_sheet = at(0.2);
      const Eigen::Vector2d turned = Eigen::Rotation2Dd(true_sheet.yaw_rad) * on_sheet.head<2>();
      const auto pixel = camera.project_map({true_sheet.x_m + turned.x(), true_sheet.y_m + turned.y(), 0.0});
      if (!pixel || !camera.contains(*pixel)) continue;
      out.push_back({.name = "tag " + std::to_string(tag) + ", corner " + std::to_string(corner),
                     .sheet = sheet,
                     .at = at(stated_m),
                     .pixel = *pixel + Eigen::Vector2d(dice.normal(0.1), dice.normal(0.1)),
                     .sigma_px = 0.1,
                     .group = static_cast<int>(100 * sheet + tag)});
    }
  }
  return out;
}

const std::vector<FloorPlace> kTags{
    {-1.8, -1.2, 0.3}, {1.7, -1.1, 0.0}, {1.6, 1.3, 2.0}, {-1.9, 1.2, -1.0}, {0.1, 0.2, 0.5}};

TEST(CalibrateExtrinsics, RecognisesTagsOfAnotherSizeThanStated) {
  const auto truth = leaning();
  EXPECT_THAT(refusal(with_points(truth, tags(truth, kTags, 0.25, 0, {}, 1))),
              testing::ContainsRegex("8[01]\\.. % of the stated size"));
  auto points = tags(truth, kTags, 0.2, 0, {}, 1);
  for (SeenPoint& point : points) {
    if (point.name.starts_with("tag 2"))
      point.at.head<2>() += 0.3 * (point.at.head<2>() - Eigen::Vector2d(1.6, 1.3));
  }
  const auto result = calibrate_extrinsics(with_points(truth, points));
  EXPECT_THAT(result.cameras[0].points[8].why_not,
              testing::ContainsRegex("tag 2 measures 7[67]\\.. % of its stated size"));
  EXPECT_EQ(std::count_if(result.cameras[0].points.begin(), result.cameras[0].points.end(),
                          [](const PointResult& point) { return !point.used; }),
            4);
}

TEST(CalibrateExtrinsics, LeavesAMisplacedTagOutWhole) {
  const auto truth = leaning();
  auto points = tags(truth, kTags, 0.2, 0, {}, 2);
  for (SeenPoint& point : points) {
    if (point.name.starts_with("tag 1")) point.at.y() += 0.1;
  }
  const auto result = calibrate_extrinsics(with_points(truth, points));
  for (const PointResult& point : result.cameras[0].points)
    EXPECT_EQ(point.used, !point.name.starts_with("tag 1")) << point.name << " " << point.why_not;
  EXPECT_LT(pose_error(result.cameras[0].map_from_camera, truth.map_from_camera).norm(), 3e-3);
}

TEST(CalibrateExtrinsics, PlacesCamerasByASheetThatTheyShare) {
  const auto first = hung(test::ceiling_camera(), {-1.5, 0.0, 4.0}, {3.0, 2.0, 10.0});
  const auto second = hung(test::ceiling_camera(), {1.8, 0.3, 3.8}, {-2.0, 4.0, 170.0});
  // Where the first sheet lies was measured, the second was laid down between the cameras.
  const FloorPlace middle{0.4, -0.3, 0.7};
  const std::vector<FloorPlace> on_sheet{{-0.4, -0.3, 0}, {0.4, -0.3, 0}, {0.4, 0.3, 0}, {-0.4, 0.3, 0}};
  ExtrinsicsInput input{
      .sheets = {{.name = "measured", .place = FloorPlace{-2.5, 0.5, 0.2}}, {.name = "middle"}},
      .cameras = {{.name = "a", .intrinsics = test::intrinsics_of(first)},
                  {.name = "b", .intrinsics = test::intrinsics_of(second)}}};
  input.cameras[0].points = tags(first, on_sheet, 0.2, 0, {-2.5, 0.5, 0.2}, 1);
  for (const auto& point : tags(first, on_sheet, 0.2, 1, middle, 2)) input.cameras[0].points.push_back(point);
  input.cameras[1].points = tags(second, on_sheet, 0.2, 1, middle, 3);
  ASSERT_GT(input.cameras[0].points.size(), 20U);
  const auto result = calibrate_extrinsics(input);
  EXPECT_NEAR(result.sheets[1].x_m, middle.x_m, 3e-3);
  EXPECT_NEAR(result.sheets[1].yaw_rad, middle.yaw_rad, 3e-3);
  EXPECT_LT(pose_error(result.cameras[0].map_from_camera, first.map_from_camera).norm(), 0.02);
  EXPECT_LT(pose_error(result.cameras[1].map_from_camera, second.map_from_camera).norm(), 0.03);
  // What the first camera does not know of the sheet, the second does not know either.
  const auto turns = [&result](std::size_t camera) {
    const auto& covariance = result.cameras[camera].uncertainty.covariance;
    return covariance.diagonal().tail(3).sum();
  };
  EXPECT_GT(turns(1), turns(0));
  input.cameras[1].points.clear();
  EXPECT_THAT(refusal(input), HasSubstr("b: at least 4 points"));
  input.cameras[1].points = tags(second, on_sheet, 0.2, 1, middle, 3);
  std::erase_if(input.cameras[0].points, [](const SeenPoint& point) { return point.sheet == 1; });
  EXPECT_THAT(refusal(input),
              HasSubstr("b: it sees fewer than 4 points whose place is known, and shares no sheet"));
}

TEST(CalibrateExtrinsics, FindsALensFromManyPointsOfTheFloor) {
  const auto truth = hung(test::small_camera(), {0.2, 0.1, 2.0}, {25.0, 5.0, 40.0});
  const sim::CameraModel camera(truth);
  Dice dice(4);
  std::vector<SeenPoint> points;
  for (double x = -3.0; x <= 3.0; x += 0.2) {
    for (double y = -3.0; y <= 3.0; y += 0.2) {
      const auto pixel = camera.project_map({x, y, 0.0});
      if (!pixel || !camera.contains(*pixel)) continue;
      points.push_back({.name = "point",
                        .at = {x, y, 0.0},
                        .pixel = *pixel + Eigen::Vector2d(dice.normal(0.05), dice.normal(0.05)),
                        .sigma_px = 0.1});
    }
  }
  ExtrinsicsInput input = with_points(truth, points);
  input.cameras[0].unknown_intrinsics = true;
  input.cameras[0].intrinsics.fx_px = 1.0;
  const auto result = calibrate_extrinsics(input);
  EXPECT_NEAR(result.cameras[0].intrinsics.fx_px, truth.fx_px,
              4.0 * std::sqrt(result.cameras[0].uncertainty.covariance(0, 0)));
  EXPECT_NEAR(result.cameras[0].rms_px, 0.05 * std::sqrt(2.0), 0.005);
  EXPECT_LT(result.cameras[0].best_floor_sigma_m, 1e-4);
}

TEST(CalibrateExtrinsics, TellsHeightFromFocalLengthByTheTape) {
  const auto truth = hung(test::small_camera(), {0.2, 0.1, 2.5}, {0.3, -0.2, 40.0});
  ExtrinsicsInput input = with_points(truth, {});
  Dice dice(4);
  const sim::CameraModel camera(truth);
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d at(dice.uniform(-1.2, 1.2), dice.uniform(-1.2, 1.2), 0.0);
    const auto pixel = camera.project_map(at);
    if (!pixel || !camera.contains(*pixel + Eigen::Vector2d(2, 2)) ||
        !camera.contains(*pixel - Eigen::Vector2d(2, 2)))
      continue;
    input.cameras[0].points.push_back(
        {.name = "point", .at = at, .pixel = *pixel + Eigen::Vector2d(dice.normal(0.2), dice.normal(0.2))});
  }
  input.cameras[0].unknown_intrinsics = true;
  EXPECT_THAT(calibrate_extrinsics(input).warnings, testing::Contains(HasSubstr("its height of")));
  input.cameras[0].height_m = 2.5;
  const auto result = calibrate_extrinsics(input);
  EXPECT_THAT(result.warnings, testing::Not(testing::Contains(HasSubstr("its height of"))));
  EXPECT_NEAR(result.cameras[0].intrinsics.fx_px, truth.fx_px, 10.0);
}

}  // namespace
}  // namespace skylight::calibration
