#include "service/evaluation/camera_error.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include <Eigen/Cholesky>

#include "service/evaluation/random.hpp"

namespace skylight::service {
namespace {

using ParameterMatrix = Eigen::Matrix<double, kCameraParameters, kCameraParameters>;

constexpr int kGrid = 13;           // points of the floor to a side
constexpr double kTapePoints = 16;  // seen in the calibration ...
constexpr double kTape = 0.003;     // ... m, each put down to this

// Of the intrinsics by a chessboard, our own estimate.
constexpr double kFocal = 1e-3;    // both focal lengths together, as a share
constexpr double kAspect = 2e-4;   // their ratio: square pixels
constexpr double kCentre = 0.5;    // px
constexpr double kRadial = 3e-3;   // k1
constexpr double kRadial2 = 1e-2;  // k2
constexpr double kTangential = 3e-4;
// Of the pose, before the floor is looked at: next to nothing.
constexpr double kPosition = 0.1;  // m
constexpr double kRotation = 0.1;  // rad

struct SeenPoint {
  Eigen::Vector2d at;
  Pixel pixel;
};

std::vector<SeenPoint> seen_floor(const CameraModel& camera, const Eigen::Vector2d& room_m) {
  std::vector<SeenPoint> out;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const Eigen::Vector2d share((column + 0.5) / kGrid - 0.5, (row + 0.5) / kGrid - 0.5);
      const Eigen::Vector2d at = share.cwiseProduct(room_m);
      const auto pixel = camera.pixel_from_map({at.x(), at.y(), 0.0});
      if (pixel && camera.sees(*pixel)) out.push_back({at, *pixel});
    }
  }
  if (out.empty()) throw std::invalid_argument("a camera sees nothing of the room's floor");
  return out;
}

double rms(const std::vector<SeenPoint>& points, const CameraModel& other) {
  double sum = 0.0;
  for (const SeenPoint& point : points) {
    const auto there = other.plane_from_pixel(point.pixel, 0.0);
    if (!there)
      throw std::invalid_argument("a camera so wrong does not see the floor that the true one sees");
    sum += (*there - point.at).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// A square root of the parameters' covariance by chessboard and by eye. Coefficients that chessboards leave
/// at zero (k3; the higher ones of a fisheye) have none.
ParameterMatrix prior_root(const Intrinsics& in) {
  ParameterMatrix out = ParameterMatrix::Zero();
  out(kFocalX, kFocalX) = kFocal * in.fx_px;
  out(kFocalY, kFocalX) = kFocal * in.fy_px;
  out(kFocalX, kFocalY) = 0.5 * kAspect * in.fx_px;
  out(kFocalY, kFocalY) = -0.5 * kAspect * in.fy_px;
  out(kCentreX, kCentreX) = out(kCentreY, kCentreY) = kCentre;
  out(kDistortion, kDistortion) = kRadial;
  out(kDistortion + 1, kDistortion + 1) = kRadial2;
  if (in.lens == LensModel::brown_conrady)
    out(kDistortion + 2, kDistortion + 2) = out(kDistortion + 3, kDistortion + 3) = kTangential;
  out.diagonal().segment<3>(kCameraPosition).setConstant(kPosition);
  out.diagonal().segment<3>(kCameraRotation).setConstant(kRotation);
  return out;
}

/// By how much the floor moves: mean over the points of J^T J.
ParameterMatrix floor_moment(const CameraModel& camera, const std::vector<SeenPoint>& points) {
  ParameterMatrix out = ParameterMatrix::Zero();
  for (const SeenPoint& point : points) {
    const auto by_camera = point_by_camera(camera, point.at, 0.0);
    if (!by_camera) continue;  // along the very edge of what its model holds for
    out += by_camera->transpose() * *by_camera / static_cast<double>(points.size());
  }
  return out;
}

}  // namespace

double floor_rms(const CameraModel& truth, const CameraModel& other, const Eigen::Vector2d& room_m) {
  return rms(seen_floor(truth, room_m), other);
}

WrongCamera wrong_camera(const CameraModel& truth, const CalibrationError& error) {
  if (!(error.rms_m >= 0.0 && error.rms_m <= 0.1))
    throw std::invalid_argument("the calibration's error is " + std::to_string(error.rms_m) +
                                " m, allowed 0 to 0.1");
  const std::vector<SeenPoint> points = seen_floor(truth, error.room_m);
  const ParameterMatrix moment = floor_moment(truth, points);
  // In units of the prior, so that what has none stays out of it.
  const ParameterMatrix root = prior_root(truth.intrinsics());
  const ParameterMatrix information =
      ParameterMatrix::Identity() + kTapePoints / (kTape * kTape) * root.transpose() * moment * root;
  const Eigen::LLT<ParameterMatrix> llt(information);
  const ParameterMatrix covariance = root * llt.solve(ParameterMatrix::Identity()) * root.transpose();

  const double share = error.rms_m * error.rms_m / (moment * covariance).trace();
  WrongCamera out{.model = truth, .told = {}};
  out.told.covariance = 0.5 * share * (covariance + covariance.transpose());
  if (error.rms_m == 0.0) return out;

  Random random(error.seed);
  CameraParameters white;
  for (double& each : white) each = random.normal();
  const CameraParameters by = root * llt.matrixU().solve(white);
  double scale = error.rms_m / std::sqrt(by.dot(moment * by));
  for (int i = 0; i < 50; ++i) {  // next to linear: the first few rounds do
    out.model = moved(truth, scale * by);
    const double now = rms(points, out.model);
    if (std::abs(now - error.rms_m) <= 1e-12 * error.rms_m) break;
    scale *= error.rms_m / now;
  }
  return out;
}

void use_wrong_cameras(Assembly& assembly, const CalibrationError& error) {
  assembly.tracker.calibration.clear();
  CalibrationError own = error;
  for (NamedCamera& camera : assembly.cameras) {
    const WrongCamera wrong = wrong_camera(camera.model, own);
    camera.model = wrong.model;
    assembly.tracker.calibration.push_back(wrong.told);
    own.seed = own.seed * 0x9E3779B97F4A7C15U + 0xD1B54A32D192ED03U;
  }
}

}  // namespace skylight::service
