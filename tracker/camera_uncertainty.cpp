#include "tracker/camera_uncertainty.hpp"

#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace skylight {
namespace {

using TwoByThree = Eigen::Matrix<double, 2, 3>;

/// Between the places over which the motion of points is differentiated, m: small against any robot, large
/// against rounding.
constexpr double kStencil = 1e-3;
/// A negative eigenvalue of a covariance up to this share of the largest is rounding.
constexpr double kRounding = 1e-9;

/// d(pixel of a fixed point) / d(distortion); `point` in the optical frame.
Eigen::Matrix<double, 2, 5> pixel_by_distortion(const Intrinsics& in, const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 2, 5> out = Eigen::Matrix<double, 2, 5>::Zero();
  if (in.lens == LensModel::kannala_brandt) {
    // theta + k1 theta^3 + ... along the direction (Kannala and Brandt 2006, Eq. 6).
    const double r = point.head<2>().norm();
    if (!(r > 0.0)) return out;
    const double theta = std::atan2(r, point.z());
    Eigen::Vector2d column = point.head<2>() / r * theta;
    for (Eigen::Index i = 0; i < 4; ++i) out.col(i) = column *= theta * theta;
  } else {
    // Brown 1971, in OpenCV's order k1 k2 p1 p2 k3.
    const double x = point.x() / point.z();
    const double y = point.y() / point.z();
    const double s = x * x + y * y;
    out << x * s, x * s * s, 2.0 * x * y, s + 2.0 * x * x, x * s * s * s,  //
        y * s, y * s * s, s + 2.0 * y * y, 2.0 * x * y, y * s * s * s;
  }
  return Eigen::Vector2d(in.fx_px, in.fy_px).asDiagonal() * out;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d out;
  out << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return out;
}

void append_range(std::ostringstream& out, const std::string& field, double value, double high) {
  if (out.tellp() > 0 || (value >= 0.0 && value <= high)) return;
  out << field << " is " << value << ", must lie in [0, " << high << "]";
}

}  // namespace

PixelByIntrinsics pixel_by_intrinsics(const Intrinsics& in, const Pixel& pixel,
                                      const Eigen::Vector3d& point) {
  PixelByIntrinsics out = PixelByIntrinsics::Zero();
  out(0, kFocalX) = (pixel.x() - in.cx_px) / in.fx_px;
  out(1, kFocalY) = (pixel.y() - in.cy_px) / in.fy_px;
  out(0, kCentreX) = 1.0;
  out(1, kCentreY) = 1.0;
  out.middleCols<5>(kDistortion) = pixel_by_distortion(in, point);
  return out;
}

std::string check(const CalibrationSigmas& sigmas) {
  std::ostringstream out;
  append_range(out, "focal_px", sigmas.focal_px, 1e5);
  append_range(out, "centre_px", sigmas.centre_px, 1e5);
  for (std::size_t i = 0; i < sigmas.distortion.size(); ++i)
    append_range(out, "distortion[" + std::to_string(i) + "]", sigmas.distortion[i], 1e3);
  append_range(out, "position_m", sigmas.position_m, 100.0);
  append_range(out, "rotation_rad", sigmas.rotation_rad, 1.0);
  return out.str();
}

std::string check(const CameraUncertainty& uncertainty) {
  const auto& c = uncertainty.covariance;
  if (!c.allFinite()) return "a camera's covariance is not finite";
  // By correlation, so that pixels and radians count alike.
  const CameraParameters sigma = c.diagonal().cwiseMax(0.0).cwiseSqrt();
  if (c.diagonal().minCoeff() < 0.0) return "a camera's covariance has a negative variance";
  const CameraParameters scale = sigma.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 1.0; });
  const Eigen::Matrix<double, kCameraParameters, kCameraParameters> correlation =
      scale.asDiagonal() * c * scale.asDiagonal();
  if (!((correlation - correlation.transpose()).cwiseAbs().maxCoeff() <= kRounding))
    return "a camera's covariance is not symmetric";
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kCameraParameters, kCameraParameters>> solver(
      correlation, Eigen::EigenvaluesOnly);
  if (!(solver.eigenvalues().minCoeff() >= -kRounding * kCameraParameters))
    return "a camera's covariance has a negative variance in some direction";
  return {};
}

CameraUncertainty camera_uncertainty(const CalibrationSigmas& sigmas) {
  if (const std::string wrong = check(sigmas); !wrong.empty()) throw std::invalid_argument(wrong);
  CameraParameters sigma;
  sigma << Eigen::Vector2d::Constant(sigmas.focal_px), Eigen::Vector2d::Constant(sigmas.centre_px),
      Eigen::Map<const Eigen::Matrix<double, 5, 1>>(sigmas.distortion.data()),
      Eigen::Vector3d::Constant(sigmas.position_m), Eigen::Vector3d::Constant(sigmas.rotation_rad);
  CameraUncertainty out;
  out.covariance.diagonal() = sigma.cwiseAbs2();
  return out;
}

CameraModel moved(const CameraModel& camera, const CameraParameters& by) {
  Intrinsics in = camera.intrinsics();
  in.fx_px += by[kFocalX];
  in.fy_px += by[kFocalY];
  in.cx_px += by[kCentreX];
  in.cy_px += by[kCentreY];
  for (std::size_t i = 0; i < in.distortion.size(); ++i)
    in.distortion[i] += by[kDistortion + static_cast<Eigen::Index>(i)];
  Eigen::Isometry3d pose = camera.map_from_camera();
  pose.translation() += by.segment<3>(kCameraPosition);
  const Eigen::Vector3d rotation = by.segment<3>(kCameraRotation);
  const double angle = rotation.norm();
  if (angle > 0.0)
    pose.linear() = Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix() * pose.linear();
  return {in, pose};
}

std::optional<PointByCamera> point_by_camera(const CameraModel& camera, const Eigen::Vector2d& at,
                                             double height_m) {
  const Eigen::Vector3d point(at.x(), at.y(), height_m);
  CameraModel::PixelByPoint by_point;
  const std::optional<Pixel> pixel = camera.pixel_from_map(point, &by_point);
  if (!pixel) return std::nullopt;
  const Eigen::Isometry3d& pose = camera.map_from_camera();
  const Eigen::Vector3d way = point - pose.translation();
  const Eigen::Vector3d seen = pose.linear().transpose() * way;
  TwoByThree back_to_plane;
  back_to_plane << 1.0, 0.0, -way.x() / way.z(), 0.0, 1.0, -way.y() / way.z();

  PointByCamera out;
  const Eigen::Matrix2d point_by_pixel = by_point.leftCols<2>().inverse();
  out.leftCols<kCameraPosition>() = -point_by_pixel * pixel_by_intrinsics(camera.intrinsics(), *pixel, seen);
  out.middleCols<3>(kCameraPosition) = back_to_plane;
  out.middleCols<3>(kCameraRotation) = -back_to_plane * cross_matrix(way);
  if (!out.allFinite()) return std::nullopt;
  return out;
}

std::optional<PoseByCamera> pose_by_camera(const CameraModel& camera, const Eigen::Vector2d& at,
                                           double height_m) {
  const auto here = point_by_camera(camera, at, height_m);
  const Eigen::Vector2d x(0.5 * kStencil, 0.0);
  const Eigen::Vector2d y(0.0, 0.5 * kStencil);
  const auto ahead_x = point_by_camera(camera, at + x, height_m);
  const auto behind_x = point_by_camera(camera, at - x, height_m);
  const auto ahead_y = point_by_camera(camera, at + y, height_m);
  const auto behind_y = point_by_camera(camera, at - y, height_m);
  if (!here || !ahead_x || !behind_x || !ahead_y || !behind_y) return std::nullopt;
  PoseByCamera out;
  out.topRows<2>() = *here;
  out.row(2) = (ahead_x->row(1) - behind_x->row(1) - ahead_y->row(0) + behind_y->row(0)) / (2.0 * kStencil);
  return out;
}

std::optional<Covariance3> floor_covariance(const CameraModel& camera, const CameraUncertainty& uncertainty,
                                            const Eigen::Vector2d& at, double height_m) {
  const auto by_camera = pose_by_camera(camera, at, height_m);
  if (!by_camera) return std::nullopt;
  const Covariance3 out = *by_camera * uncertainty.covariance * by_camera->transpose();
  return Covariance3(0.5 * (out + out.transpose()));
}

}  // namespace skylight
