#include "sim/camera/camera_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace skylight::sim {
namespace {

/// Beyond these the models are not meant to hold: 84 degrees off axis for the pinhole, straight back for the
/// fisheye.
constexpr double kMaxTangent = 10.0;
constexpr double kMaxAngle = std::numbers::pi;

/// The radial curve and its slope: r k(r^2) with k = 1 + a r^2 + b r^4 + ...
struct Radial {
  double value;
  double slope;
};

Radial radial(const CameraParameters& camera, double r) {
  const auto& d = camera.distortion;
  const bool fisheye = camera.lens == Lens::kannala_brandt;
  const std::array<double, 4> k =
      fisheye ? std::array<double, 4>{d[0], d[1], d[2], d[3]} : std::array<double, 4>{d[0], d[1], d[4], 0.0};
  const double r2 = r * r;
  double value = 0.0;
  double slope = 0.0;
  for (int i = 3; i >= 0; --i) {
    value = (value + k[static_cast<std::size_t>(i)]) * r2;
    slope = (slope + (2.0 * i + 3.0) * k[static_cast<std::size_t>(i)]) * r2;
  }
  return {r * (1.0 + value), 1.0 + slope};
}

Eigen::Vector2d distort(const CameraParameters& camera, const Eigen::Vector2d& p) {
  const double r2 = p.squaredNorm();
  const double r = std::sqrt(r2);
  const double scale = r > 0.0 ? radial(camera, r).value / r : 1.0;
  const double p1 = camera.distortion[2];
  const double p2 = camera.distortion[3];
  const double xy = p.x() * p.y();
  return {p.x() * scale + 2.0 * p1 * xy + p2 * (r2 + 2.0 * p.x() * p.x()),
          p.y() * scale + 2.0 * p2 * xy + p1 * (r2 + 2.0 * p.y() * p.y())};
}

/// Newton's method from the distorted point; the derivative by the product rule of distort().
std::optional<Eigen::Vector2d> undistort(const CameraParameters& camera, const Eigen::Vector2d& target,
                                         double range) {
  Eigen::Vector2d p = target;
  if (p.norm() > 0.9 * range) p *= 0.9 * range / p.norm();
  const double p1 = camera.distortion[2];
  const double p2 = camera.distortion[3];
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Eigen::Vector2d error = distort(camera, p) - target;
    const double r = p.norm();
    if (error.norm() < 1e-13 * (1.0 + r)) break;
    const Radial curve = radial(camera, r);
    const double scale = r > 0.0 ? curve.value / r : 1.0;
    // d(p * scale)/dp = scale I + (slope - scale) p p^T / r^2
    Eigen::Matrix2d jacobian = scale * Eigen::Matrix2d::Identity();
    if (r > 0.0) jacobian += (curve.slope - scale) / (r * r) * p * p.transpose();
    jacobian(0, 0) += 2.0 * p1 * p.y() + 6.0 * p2 * p.x();
    jacobian(0, 1) += 2.0 * p1 * p.x() + 2.0 * p2 * p.y();
    jacobian(1, 0) += 2.0 * p2 * p.y() + 2.0 * p1 * p.x();
    jacobian(1, 1) += 2.0 * p2 * p.x() + 6.0 * p1 * p.y();
    p -= jacobian.inverse() * error;
    if (!p.allFinite()) return std::nullopt;
    if (p.norm() > range) p *= range / p.norm();
  }
  const bool found = (distort(camera, p) - target).norm() < 1e-11 * (1.0 + target.norm()) && p.norm() < range;
  return found ? std::optional(p) : std::nullopt;
}

/// The angle whose distorted radius this is, by bisection on the rising stretch and Newton to polish.
std::optional<double> fisheye_angle(const CameraParameters& camera, double radius, double range) {
  if (radius > radial(camera, range).value) return std::nullopt;
  double low = 0.0;
  double high = range;
  for (int i = 0; i < 20; ++i) {
    const double middle = 0.5 * (low + high);
    (radial(camera, middle).value < radius ? low : high) = middle;
  }
  double angle = 0.5 * (low + high);
  for (int i = 0; i < 5; ++i) {
    const Radial curve = radial(camera, angle);
    if (curve.slope < 1e-6) break;
    angle = std::clamp(angle - (curve.value - radius) / curve.slope, 0.0, range);
  }
  return angle;
}

double one_to_one_range(const CameraParameters& camera) {
  const double limit = camera.lens == Lens::kannala_brandt ? kMaxAngle : kMaxTangent;
  constexpr int kSteps = 2000;
  for (int i = 1; i <= kSteps; ++i) {
    if (radial(camera, limit * i / kSteps).slope <= 0.0) return limit * (i - 1) / kSteps;
  }
  return limit;
}

}  // namespace

CameraModel::CameraModel(const CameraParameters& parameters)
    : parameters_(parameters),
      camera_from_map_(parameters.map_from_camera.inverse()),
      range_(one_to_one_range(parameters)) {}

std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& in_camera) const {
  Eigen::Vector2d distorted = Eigen::Vector2d::Zero();
  if (parameters_.lens == Lens::kannala_brandt) {
    const double across = in_camera.head<2>().norm();
    const double angle = std::atan2(across, in_camera.z());
    if (angle > range_) return std::nullopt;
    if (across > 0.0) distorted = in_camera.head<2>() * (radial(parameters_, angle).value / across);
  } else {
    if (in_camera.z() <= 1e-9) return std::nullopt;
    const Eigen::Vector2d p = in_camera.head<2>() / in_camera.z();
    if (p.norm() > range_) return std::nullopt;
    distorted = distort(parameters_, p);
  }
  return Eigen::Vector2d(parameters_.fx_px * distorted.x() + parameters_.cx_px,
                         parameters_.fy_px * distorted.y() + parameters_.cy_px);
}

std::optional<Eigen::Vector3d> CameraModel::direction(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d distorted((pixel.x() - parameters_.cx_px) / parameters_.fx_px,
                                  (pixel.y() - parameters_.cy_px) / parameters_.fy_px);
  if (parameters_.lens == Lens::kannala_brandt) {
    const double radius = distorted.norm();
    const auto angle = fisheye_angle(parameters_, radius, range_);
    if (!angle) return std::nullopt;
    if (radius == 0.0) return Eigen::Vector3d(0.0, 0.0, 1.0);
    const Eigen::Vector2d across = distorted * (std::sin(*angle) / radius);
    return Eigen::Vector3d(across.x(), across.y(), std::cos(*angle));
  }
  const auto p = undistort(parameters_, distorted, range_);
  if (!p) return std::nullopt;
  return Eigen::Vector3d(p->x(), p->y(), 1.0);
}

std::optional<Eigen::Vector2d> CameraModel::project_map(const Eigen::Vector3d& in_map) const {
  return project(camera_from_map_ * in_map);
}

bool CameraModel::contains(const Eigen::Vector2d& pixel) const {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < parameters_.width_px - 0.5 &&
         pixel.y() < parameters_.height_px - 0.5;
}

CameraModel camera_model(const CameraSpec& camera) {
  CameraParameters parameters;
  parameters.width_px = camera.width_px;
  parameters.height_px = camera.height_px;
  parameters.lens = camera.lens;
  parameters.fx_px = camera.fx_px;
  parameters.fy_px = camera.fy_px;
  parameters.cx_px = camera.cx_px.value_or(0.5 * (camera.width_px - 1));
  parameters.cy_px = camera.cy_px.value_or(0.5 * (camera.height_px - 1));
  parameters.distortion = camera.distortion;
  parameters.map_from_camera = map_from_camera(camera);
  return CameraModel(parameters);
}

Eigen::Isometry3d map_from_camera(const CameraSpec& camera) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  const auto turn = [&](std::size_t i, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(camera.rpy_deg[i] * kRadians, axis);
  };
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(camera.position_m[0], camera.position_m[1], camera.position_m[2]);
  // Straight down: the image's right is map x, its downward side -y, the view -z.
  const Eigen::Matrix3d straight_down = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  pose.linear() = (turn(2, Eigen::Vector3d::UnitZ()) * turn(1, Eigen::Vector3d::UnitY()) *
                   turn(0, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix() *
                  straight_down;
  return pose;
}

}  // namespace skylight::sim
