// What a calibration's error does to places on the floor: against moved cameras, and against laws.
#include "tracker/camera_uncertainty.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracker/filter/route_truth.hpp"

namespace skylight {
namespace {

using test::Random;
using testing::HasSubstr;

constexpr double kHeight = 0.14;  // of a robot's picture
constexpr double kSide = 0.1;     // of that picture, m

Eigen::Isometry3d ceiling() {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translate(Eigen::Vector3d(0.2, -0.1, 3.0));
  out.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) *
             Eigen::AngleAxisd(std::numbers::pi - 0.06, Eigen::Vector3d::UnitX()) *
             Eigen::AngleAxisd(0.04, Eigen::Vector3d::UnitY()));
  return out;
}

CameraModel pinhole() {
  return {{.width_px = 1920,
           .height_px = 1080,
           .fx_px = 901.4,
           .fy_px = 903.0,
           .cx_px = 961.2,
           .cy_px = 534.6,
           .distortion = {-0.2036, 0.0497, -0.0002, 0.0005, -0.0054}},
          ceiling()};
}

CameraModel fisheye() {
  return {{.width_px = 1600,
           .height_px = 1200,
           .fx_px = 561.0,
           .fy_px = 562.7,
           .cx_px = 806.7,
           .cy_px = 593.1,
           .lens = LensModel::kannala_brandt,
           .distortion = {0.0213, -0.0068, 0.0031, -0.0009, 0.0}},
          ceiling()};
}

/// x, y and yaw by which a square picture at `at` seems moved when its pixels stay and the camera moves: the
/// corners carried through both, fitted by least squares.
Eigen::Vector3d seems_moved(const CameraModel& from, const CameraModel& to, const Eigen::Vector2d& at,
                            double height) {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  double along = 0.0;
  double across = 0.0;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector2d arm(corner % 2 == 0 ? -kSide / 2 : kSide / 2, corner < 2 ? -kSide / 2 : kSide / 2);
    const Eigen::Vector2d point = at + arm;
    const Pixel pixel = from.pixel_from_map({point.x(), point.y(), height}).value();
    const Eigen::Vector2d seen = to.plane_from_pixel(pixel, height).value();
    shift += 0.25 * (seen - point);
    along += arm.dot(seen - at);
    across += arm.x() * (seen - at).y() - arm.y() * (seen - at).x();
  }
  return {shift.x(), shift.y(), std::atan2(across, along)};
}

struct Place {
  const char* name;
  Eigen::Vector2d at;
};

class FloorCovariance : public testing::TestWithParam<bool> {
 protected:
  CameraModel camera() const { return GetParam() ? fisheye() : pinhole(); }
};
INSTANTIATE_TEST_SUITE_P(Lenses, FloorCovariance, testing::Bool(),
                         [](const auto& lens) { return lens.param ? "Fisheye" : "PinholeWithDistortion"; });

TEST_P(FloorCovariance, IsWhatManyCalibrationsScatter) {
  const CalibrationSigmas sigmas{.focal_px = 1.0,
                                 .centre_px = 0.7,
                                 .distortion = {1e-3, 8e-4, 2e-4, 2e-4, 3e-4},
                                 .position_m = 2e-3,
                                 .rotation_rad = 8e-4};
  CameraUncertainty uncertainty = camera_uncertainty(sigmas);
  // Errors go together: a longer lens from higher up.
  uncertainty.covariance(kFocalX, kCameraPosition + 2) =
      uncertainty.covariance(kCameraPosition + 2, kFocalX) = 0.8 * sigmas.focal_px * sigmas.position_m;
  if (GetParam()) uncertainty.covariance(kDistortion + 4, kDistortion + 4) = 0.0;  // has no fifth coefficient
  const Eigen::LDLT<decltype(uncertainty.covariance)> ldlt(uncertainty.covariance);
  const std::array places{Place{"middle", {0.2, -0.1}}, Place{"corner", {2.3, 1.1}}};
  const CameraModel known = camera();
  std::array<Covariance3, 2> scatter{Covariance3::Zero(), Covariance3::Zero()};
  Random random(4101);
  constexpr int kDraws = 2000;
  for (int draw = 0; draw < kDraws; ++draw) {
    CameraParameters by;
    for (double& each : by) each = random.normal();
    by = (ldlt.transpositionsP().transpose() *
          (ldlt.matrixL() * (ldlt.vectorD().cwiseMax(0.0).cwiseSqrt().cwiseProduct(by))))
             .eval();
    const CameraModel other = moved(known, by);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector3d off = seems_moved(known, other, places[i].at, kHeight);
      scatter[i] += off * off.transpose() / kDraws;
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Covariance3 claimed = floor_covariance(known, uncertainty, places[i].at, kHeight).value();
    // In whatever direction of (x, y, yaw): the scatter as the claim sees it is the identity.
    const Covariance3 whitening = Eigen::LLT<Covariance3>(claimed).matrixL().solve(Covariance3::Identity());
    const Covariance3 seen = whitening * scatter[i] * whitening.transpose();
    EXPECT_LT((seen - Covariance3::Identity()).cwiseAbs().maxCoeff(), 0.10) << places[i].name << "\n" << seen;
  }
}

TEST_P(FloorCovariance, ItsJacobianIsTheNumericalOne) {
  const CameraModel known = camera();
  CameraParameters step;
  step << 1e-3, 1e-3, 1e-3, 1e-3, Eigen::Matrix<double, 5, 1>::Constant(1e-6),
      Eigen::Matrix<double, 6, 1>::Constant(1e-6);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.3, 0.2), Eigen::Vector2d(-1.9, 1.0)}) {
    const PointByCamera analytic = point_by_camera(known, at, kHeight).value();
    const Pixel pixel = known.pixel_from_map({at.x(), at.y(), kHeight}).value();
    for (int i = 0; i < kCameraParameters; ++i) {
      if (GetParam() && i == kDistortion + 4) {
        EXPECT_EQ(analytic.col(i).norm(), 0.0);
        continue;
      }
      CameraParameters by = CameraParameters::Zero();
      by[i] = step[i];
      const Eigen::Vector2d numeric = (moved(known, by).plane_from_pixel(pixel, kHeight).value() -
                                       moved(known, -by).plane_from_pixel(pixel, kHeight).value()) /
                                      (2.0 * step[i]);
      EXPECT_LT((analytic.col(i) - numeric).norm(), 1e-6 * (1e-3 / step[i]) + 1e-5 * numeric.norm())
          << "parameter " << i << " at " << at.transpose();
    }
  }
}

TEST_P(FloorCovariance, ACameraShiftedAlongTheFloorShiftsEveryPlaceByExactlyThat) {
  CameraParameters by = CameraParameters::Zero();
  by[kCameraPosition] = 0.03;
  by[kCameraPosition + 1] = -0.02;
  const CameraModel other = moved(camera(), by);
  CalibrationSigmas sigmas;
  sigmas.position_m = 0.005;
  CameraUncertainty sideways = camera_uncertainty(sigmas);
  sideways.covariance(kCameraPosition + 2, kCameraPosition + 2) = 0.0;
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.3, 0.2), Eigen::Vector2d(-1.9, 1.0)}) {
    EXPECT_LT((seems_moved(camera(), other, at, kHeight) - Eigen::Vector3d(0.03, -0.02, 0.0)).norm(), 1e-9);
    const Covariance3 floor = floor_covariance(camera(), sideways, at, kHeight).value();
    EXPECT_LT((floor - Covariance3(Eigen::Vector3d(25e-6, 25e-6, 0.0).asDiagonal())).norm(), 1e-12);
  }
}

TEST_P(FloorCovariance, ACameraTurnedAboutTheVerticalTurnsEveryYawByExactlyThat) {
  constexpr double kTurn = 0.02;
  CameraParameters by = CameraParameters::Zero();
  by[kCameraRotation + 2] = kTurn;
  const CameraModel other = moved(camera(), by);
  CameraUncertainty turning;
  turning.covariance(kCameraRotation + 2, kCameraRotation + 2) = kTurn * kTurn;
  const Eigen::Vector2d foot = camera().map_from_camera().translation().head<2>();
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.3, 0.2), Eigen::Vector2d(-1.9, 1.0)}) {
    const Eigen::Vector3d off = seems_moved(camera(), other, at, kHeight);
    EXPECT_NEAR(off.z(), kTurn, 1e-9);
    EXPECT_LT((off.head<2>() - (foot + Eigen::Rotation2Dd(kTurn) * (at - foot) - at)).norm(), 1e-9);
    const Covariance3 floor = floor_covariance(camera(), turning, at, kHeight).value();
    EXPECT_NEAR(std::sqrt(floor(2, 2)), kTurn, 1e-9);
    // The point goes across its arm: the further out, the more, and always with the yaw.
    EXPECT_NEAR((floor.topLeftCorner<2, 2>().trace()), kTurn * kTurn * (at - foot).squaredNorm(), 1e-12);
    EXPECT_NEAR(floor(0, 2), -kTurn * kTurn * (at - foot).y(), 1e-12);
    EXPECT_NEAR(floor(1, 2), kTurn * kTurn * (at - foot).x(), 1e-12);
  }
}

TEST_P(FloorCovariance, OfACameraThatIsKnownExactlyIsZero) {
  const Covariance3 floor = floor_covariance(camera(), {}, {1.0, 0.5}, kHeight).value();
  EXPECT_EQ(floor, Covariance3(Covariance3::Zero()));
}

TEST_P(FloorCovariance, IsNoneWhereTheCameraCannotLook) {
  CalibrationSigmas sigmas{.position_m = 0.001};
  const CameraUncertainty uncertainty = camera_uncertainty(sigmas);
  EXPECT_FALSE(floor_covariance(camera(), uncertainty, {0.0, 0.0}, 5.0));  // above and behind it
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(floor_covariance(camera(), uncertainty, {kNan, 0.0}, kHeight));
}

TEST(CameraUncertainty, ALongerLensFromHigherUpIsHardlySeenOnTheFloor) {
  // Straight down: f and height in proportion change nothing of the floor itself.
  Eigen::Isometry3d down = Eigen::Isometry3d::Identity();
  down.translate(Eigen::Vector3d(0.0, 0.0, 3.0));
  down.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  const CameraModel camera(
      {.width_px = 1920, .height_px = 1080, .fx_px = 900.0, .fy_px = 900.0, .cx_px = 959.5, .cy_px = 539.5},
      down);
  CameraParameters together = CameraParameters::Zero();
  together[kFocalX] = together[kFocalY] = 9.0;  // 1 %
  together[kCameraPosition + 2] = 0.03;         // 1 %
  CameraUncertainty uncertainty;
  uncertainty.covariance = together * together.transpose();
  const Eigen::Vector2d at(2.0, 1.0);
  EXPECT_LT(floor_covariance(camera, uncertainty, at, 0.0).value().cwiseAbs().maxCoeff(), 1e-18);
  // At height h the point is off by r (1 % of f less 1 % of H over H - h): 1 % of h / (H - h) of the radius.
  const double off = std::sqrt(floor_covariance(camera, uncertainty, at, kHeight).value().trace());
  EXPECT_NEAR(off, 0.01 * kHeight / (3.0 - kHeight) * at.norm(), 1e-9);
}

TEST(CameraUncertainty, SettingsOutsideTheirRangeAreNamed) {
  EXPECT_EQ(check(CalibrationSigmas{}), "");
  EXPECT_THAT(check(CalibrationSigmas{.focal_px = -1.0}),
              HasSubstr("focal_px is -1, must lie in [0, 100000]"));
  EXPECT_THAT(check(CalibrationSigmas{.distortion = {0, 0, 0, 2e3, 0}}), HasSubstr("distortion[3] is 2000"));
  EXPECT_THAT(check(CalibrationSigmas{.rotation_rad = std::nan("")}), HasSubstr("rotation_rad is nan"));
  EXPECT_THROW(camera_uncertainty({.position_m = 101.0}), std::invalid_argument);
}

TEST(CameraUncertainty, ThatIsNoCovarianceIsNamed) {
  CameraUncertainty uncertainty = camera_uncertainty({.focal_px = 1.0, .position_m = 1e-3});
  EXPECT_EQ(check(uncertainty), "");
  uncertainty.covariance(kFocalX, kCameraPosition) = 1e-3;
  EXPECT_THAT(check(uncertainty), HasSubstr("not symmetric"));
  uncertainty.covariance(kCameraPosition, kFocalX) = 1e-3;  // wholly together: still one
  EXPECT_EQ(check(uncertainty), "");
  uncertainty.covariance(kCameraPosition, kFocalX) = uncertainty.covariance(kFocalX, kCameraPosition) =
      1.1e-3;
  EXPECT_THAT(check(uncertainty), HasSubstr("negative variance in some direction"));
  uncertainty.covariance(kCentreX, kCentreX) = -1.0;
  EXPECT_THAT(check(uncertainty), HasSubstr("negative variance"));
  uncertainty.covariance(kCentreX, kCentreX) = std::nan("");
  EXPECT_THAT(check(uncertainty), HasSubstr("not finite"));
}

}  // namespace
}  // namespace skylight
