#include "tracker/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include <Eigen/LU>

namespace skylight {
namespace {

constexpr double kLongestFocalLength = 1e7;
constexpr double kLargestCoefficient = 1e6;
/// Where a model that never folds back still ends: 89.9999 degrees off the axis of a pinhole ...
constexpr double kWidestTangent = 1e6;
/// ... and, for a fisheye, short of straight behind, where every azimuth is the same direction.
constexpr double kWidestAngle = 3.1;
/// A ray that climbs or sinks by less than this per metre counts as parallel to the plane.
constexpr double kParallel = 1e-9;
constexpr int kScanSteps = 8192;
constexpr int kMostIterations = 100;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// A radial function and its derivative.
struct Radial {
  double value = 0.0;
  double slope = 0.0;
};

/// r (1 + k1 r^2 + k2 r^4 + k3 r^6): Brown's radial distortion.
Radial brown_radial(const std::array<double, 5>& d, double r) {
  const double s = r * r;
  return {.value = r * (1.0 + s * (d[0] + s * (d[1] + s * d[4]))),
          .slope = 1.0 + s * (3.0 * d[0] + s * (5.0 * d[1] + s * 7.0 * d[4]))};
}

/// theta (1 + k1 theta^2 + ... + k4 theta^8): Kannala and Brandt 2006, Eq. 6 scaled by the focal length.
Radial kannala_radial(const std::array<double, 5>& d, double theta) {
  const double s = theta * theta;
  return {.value = theta * (1.0 + s * (d[0] + s * (d[1] + s * (d[2] + s * d[3])))),
          .slope = 1.0 + s * (3.0 * d[0] + s * (5.0 * d[1] + s * (7.0 * d[2] + s * 9.0 * d[3])))};
}

/// The least determinant of Brown's Jacobian around the circle of radius r. With c the cosine between the
/// point and (p2, p1), q = r |(p2, p1)|, a the slope and b the value per radius of the radial part, the
/// Jacobian along and across the radius is [[a + 6qc, 2qs], [2qs, b + 2qc]]. It is symmetric (the model
/// is a gradient), so where it stays positive definite over a disc, no two points share an image.
double least_determinant(const std::array<double, 5>& d, double r) {
  const double a = brown_radial(d, r).slope;
  const double s = r * r;
  const double b = 1.0 + s * (d[0] + s * (d[1] + s * d[4]));
  const double q = r * std::hypot(d[2], d[3]);
  const auto determinant = [&](double c) {
    return a * b + 2.0 * q * c * (a + 3.0 * b) + 4.0 * q * q * (4.0 * c * c - 1.0);
  };
  if (q <= 0.0) return std::min(a, b);
  return determinant(std::clamp(-(a + 3.0 * b) / (16.0 * q), -1.0, 1.0));
}

/// The first place in (0, end] where f is no longer positive, or `end`. `place` maps [0, 1] to it.
template <typename F, typename Place>
double first_fold(const F& f, const Place& place) {
  double inside = 0.0;
  for (int i = 1; i <= kScanSteps; ++i) {
    double outside = static_cast<double>(i) / kScanSteps;
    if (f(place(outside)) > 0.0) {
      inside = outside;
      continue;
    }
    for (int k = 0; k < kMostIterations; ++k) {
      const double middle = 0.5 * (inside + outside);
      (f(place(middle)) > 0.0 ? inside : outside) = middle;
    }
    return place(inside);
  }
  return place(1.0);
}

double model_range(const Intrinsics& in) {
  if (in.lens == LensModel::kannala_brandt) {
    return first_fold([&](double theta) { return kannala_radial(in.distortion, theta).slope; },
                      [](double share) { return share * kWidestAngle; });
  }
  // Evenly in angle, so that the steps are fine where lenses fold and the end is still reached.
  return first_fold([&](double r) { return least_determinant(in.distortion, r); },
                    [](double share) { return std::tan(share * std::atan(kWidestTangent)); });
}

/// r in [0, end] with radial(r) = value, radial rising over the range: Newton, kept inside a bracket. None
/// where the value is not reached.
template <typename F>
std::optional<double> invert_radial(const F& radial, double value, double end) {
  if (!(value <= radial(end).value)) return std::nullopt;
  double low = 0.0;
  double high = end;
  double r = std::min(value, end);
  const double tolerance = kEpsilon * value;
  for (int i = 0; i < kMostIterations; ++i) {
    const Radial at = radial(r);
    const double excess = at.value - value;
    if (std::abs(excess) <= tolerance) return r;
    (excess < 0.0 ? low : high) = r;
    double next = r - excess / at.slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == r || std::abs(next - r) <= 0.5 * kEpsilon * r) return next;
    r = next;
  }
  return r;
}

void append_range(std::ostringstream& out, const char* field, double value, double low, double high) {
  if (out.tellp() > 0 || (value >= low && value <= high)) return;
  out << field << " is " << value << ", must lie in [" << low << ", " << high << "]";
}

}  // namespace

std::string check(const Intrinsics& in) {
  std::ostringstream out;
  append_range(out, "width_px", in.width_px, 1, Intrinsics::kLargestSide);
  append_range(out, "height_px", in.height_px, 1, Intrinsics::kLargestSide);
  append_range(out, "fx_px", in.fx_px, 1e-3, kLongestFocalLength);
  append_range(out, "fy_px", in.fy_px, 1e-3, kLongestFocalLength);
  append_range(out, "cx_px", in.cx_px, -0.5, in.width_px - 0.5);
  append_range(out, "cy_px", in.cy_px, -0.5, in.height_px - 0.5);
  const bool fisheye = in.lens == LensModel::kannala_brandt;
  constexpr std::array kBrownNames{"distortion k1", "distortion k2", "distortion p1", "distortion p2",
                                   "distortion k3"};
  constexpr std::array kFisheyeNames{"distortion k1", "distortion k2", "distortion k3", "distortion k4",
                                     "distortion[4] (unused by kannala_brandt)"};
  for (std::size_t i = 0; i < in.distortion.size(); ++i) {
    const double bound = fisheye && i == 4 ? 0.0 : kLargestCoefficient;
    append_range(out, fisheye ? kFisheyeNames[i] : kBrownNames[i], in.distortion[i], -bound, bound);
  }
  return out.str();
}

struct CameraModel::Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;  ///< d(distorted)/d(tangent), symmetric
};

CameraModel::CameraModel(const Intrinsics& intrinsics, const Eigen::Isometry3d& map_from_camera)
    : intrinsics_(intrinsics),
      map_from_camera_(map_from_camera),
      camera_from_map_(map_from_camera.inverse()) {
  if (const std::string wrong = check(intrinsics); !wrong.empty()) throw std::invalid_argument(wrong);
  const Eigen::Matrix3d rotation = map_from_camera.linear();
  const bool rigid = map_from_camera.matrix().allFinite() && rotation.determinant() > 0.0 &&
                     (rotation * rotation.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-9);
  if (!rigid) {
    throw std::invalid_argument(
        "map_from_camera is no rigid motion: its rotation must be orthonormal to 1e-9, all finite");
  }
  max_radius_ = model_range(intrinsics);
}

CameraModel::Distorted CameraModel::distort_brown_conrady(const Eigen::Vector2d& tangent) const {
  const auto& [k1, k2, p1, p2, k3] = intrinsics_.distortion;
  const double x = tangent.x();
  const double y = tangent.y();
  const double s = x * x + y * y;
  const double radial = 1.0 + s * (k1 + s * (k2 + s * k3));
  const double twice_slope = 2.0 * (k1 + s * (2.0 * k2 + s * 3.0 * k3));  // 2 d(radial)/ds
  const double mixed = x * y * twice_slope + 2.0 * (p1 * x + p2 * y);
  Distorted out;
  out.point = {x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
               y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y};
  out.jacobian << radial + x * x * twice_slope + 2.0 * p1 * y + 6.0 * p2 * x, mixed, mixed,
      radial + y * y * twice_slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return out;
}

std::optional<Pixel> CameraModel::brown_conrady_pixel(const Eigen::Vector3d& point,
                                                      PixelByPoint* jacobian) const {
  if (!(point.z() > 0.0)) return std::nullopt;
  const double per_depth = 1.0 / point.z();
  const Eigen::Vector2d tangent = point.head<2>() * per_depth;
  if (!(tangent.squaredNorm() < max_radius_ * max_radius_)) return std::nullopt;
  const Distorted distorted = distort_brown_conrady(tangent);
  const Eigen::Vector2d focal(intrinsics_.fx_px, intrinsics_.fy_px);
  if (jacobian != nullptr) {
    const Eigen::Matrix2d by_xy = focal.asDiagonal() * distorted.jacobian * per_depth;
    jacobian->leftCols<2>() = by_xy;
    jacobian->col(2) = -by_xy * tangent;
  }
  return Pixel(focal.cwiseProduct(distorted.point) + Pixel(intrinsics_.cx_px, intrinsics_.cy_px));
}

std::optional<Pixel> CameraModel::kannala_brandt_pixel(const Eigen::Vector3d& point,
                                                       PixelByPoint* jacobian) const {
  const double r = std::sqrt(point.x() * point.x() + point.y() * point.y());
  const double theta = std::atan2(r, point.z());
  if (!(theta < max_radius_) || !(r > 0.0 || point.z() > 0.0)) return std::nullopt;
  const Radial radial = kannala_radial(intrinsics_.distortion, theta);
  // On the axis the azimuth has no meaning and value / r tends to 1 / z.
  const bool on_axis = r < 1e-12 * point.z();
  const double scale = on_axis ? 1.0 / point.z() : radial.value / r;
  const Eigen::Vector2d focal(intrinsics_.fx_px, intrinsics_.fy_px);
  if (jacobian != nullptr) {
    const Eigen::Vector2d e = on_axis ? Eigen::Vector2d(1.0, 0.0) : Eigen::Vector2d(point.head<2>() / r);
    const double slope = radial.slope / (r * r + point.z() * point.z());
    const Eigen::Matrix2d along = e * e.transpose();
    jacobian->leftCols<2>() =
        focal.asDiagonal() * (slope * point.z() * along + scale * (Eigen::Matrix2d::Identity() - along));
    jacobian->col(2) = -slope * r * focal.cwiseProduct(e);
  }
  return Pixel(focal.cwiseProduct(scale * point.head<2>()) + Pixel(intrinsics_.cx_px, intrinsics_.cy_px));
}

std::optional<Pixel> CameraModel::pixel_from_camera(const Eigen::Vector3d& point,
                                                    PixelByPoint* jacobian) const {
  if (!std::isfinite(point.sum())) return std::nullopt;
  std::optional<Pixel> pixel = intrinsics_.lens == LensModel::brown_conrady
                                   ? brown_conrady_pixel(point, jacobian)
                                   : kannala_brandt_pixel(point, jacobian);
  // Not finite: so close to the lens that the quotient overflows.
  if (!pixel || !std::isfinite(pixel->x() + pixel->y())) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector2d> CameraModel::undistort_brown_conrady(const Eigen::Vector2d& distorted) const {
  const auto& d = intrinsics_.distortion;
  const double reach = distorted.norm();
  const auto radial = [&d](double r) { return brown_radial(d, r); };
  const bool no_tangential = d[2] == 0.0 && d[3] == 0.0;
  // Tangential terms push some pixels beyond the radial reach: those start just inside the range.
  const std::optional<double> radius = invert_radial(radial, reach, max_radius_);
  if (!radius && no_tangential) return std::nullopt;
  Eigen::Vector2d tangent = distorted * (reach > 0.0 ? radius.value_or(0.999 * max_radius_) / reach : 0.0);
  if (no_tangential) return tangent;

  // distort is the gradient of a function that is convex over the range: Newton with step halving finds
  // the one solution, or runs into the edge of the range and there is none.
  if (!(tangent.norm() < max_radius_)) tangent *= 0.999 * max_radius_ / tangent.norm();
  Distorted at = distort_brown_conrady(tangent);
  double error = (at.point - distorted).norm();
  const double tolerance = 2.0 * kEpsilon * reach;
  for (int i = 0; i < kMostIterations && error > tolerance; ++i) {
    Eigen::Vector2d step = at.jacobian.inverse() * (distorted - at.point);
    bool better = false;
    for (int halving = 0; halving < 40 && !better; ++halving, step *= 0.5) {
      const Eigen::Vector2d next = tangent + step;
      if (!(next.squaredNorm() < max_radius_ * max_radius_)) continue;
      const Distorted there = distort_brown_conrady(next);
      const double next_error = (there.point - distorted).norm();
      if (!(next_error < error)) continue;
      tangent = next;
      at = there;
      error = next_error;
      better = true;
    }
    if (!better) break;  // as near as doubles come, or at the edge
  }
  if (!(error <= 1e3 * kEpsilon * std::max(reach, tangent.norm()))) return std::nullopt;
  return tangent;
}

std::optional<Eigen::Vector3d> CameraModel::brown_conrady_ray(const Eigen::Vector2d& distorted,
                                                              RayByPixel* jacobian) const {
  const std::optional<Eigen::Vector2d> tangent = undistort_brown_conrady(distorted);
  if (!tangent || !(tangent->squaredNorm() < max_radius_ * max_radius_)) return std::nullopt;
  const double per_length = 1.0 / std::sqrt(1.0 + tangent->squaredNorm());
  const Eigen::Vector3d ray = Eigen::Vector3d(tangent->x(), tangent->y(), 1.0) * per_length;
  if (jacobian != nullptr) {
    RayByPixel by_tangent = -ray * ray.head<2>().transpose() * per_length;
    by_tangent.topRows<2>() += Eigen::Matrix2d::Identity() * per_length;
    *jacobian = by_tangent * distort_brown_conrady(*tangent).jacobian.inverse();
  }
  return ray;
}

std::optional<Eigen::Vector3d> CameraModel::kannala_brandt_ray(const Eigen::Vector2d& distorted,
                                                               RayByPixel* jacobian) const {
  const double reach = distorted.norm();
  const auto radial = [this](double theta) { return kannala_radial(intrinsics_.distortion, theta); };
  const std::optional<double> theta = invert_radial(radial, reach, max_radius_);
  if (!theta || !(*theta < max_radius_)) return std::nullopt;
  const double sine = std::sin(*theta);
  const double cosine = std::cos(*theta);
  const Eigen::Vector2d e = reach > 0.0 ? Eigen::Vector2d(distorted / reach) : Eigen::Vector2d(1.0, 0.0);
  if (jacobian != nullptr) {
    const double across = reach > 0.0 ? sine / reach : 1.0;  // sin(theta) / distorted radius tends to 1
    const double slope = radial(*theta).slope;
    const Eigen::Matrix2d along = e * e.transpose();
    jacobian->topRows<2>() = cosine / slope * along + across * (Eigen::Matrix2d::Identity() - along);
    jacobian->row(2) = -sine / slope * e.transpose();
  }
  return Eigen::Vector3d(sine * e.x(), sine * e.y(), cosine);
}

std::optional<Eigen::Vector3d> CameraModel::ray_from_pixel(const Pixel& pixel, RayByPixel* jacobian) const {
  const Eigen::Vector2d distorted((pixel.x() - intrinsics_.cx_px) / intrinsics_.fx_px,
                                  (pixel.y() - intrinsics_.cy_px) / intrinsics_.fy_px);
  std::optional<Eigen::Vector3d> ray = intrinsics_.lens == LensModel::brown_conrady
                                           ? brown_conrady_ray(distorted, jacobian)
                                           : kannala_brandt_ray(distorted, jacobian);
  if (ray && jacobian != nullptr) {
    jacobian->col(0) /= intrinsics_.fx_px;
    jacobian->col(1) /= intrinsics_.fy_px;
  }
  return ray;
}

std::optional<Pixel> CameraModel::pixel_from_map(const Eigen::Vector3d& point, PixelByPoint* jacobian) const {
  std::optional<Pixel> pixel =
      pixel_from_camera(camera_from_map_.linear() * point + camera_from_map_.translation(), jacobian);
  if (pixel && jacobian != nullptr) *jacobian = PixelByPoint(*jacobian * camera_from_map_.linear());
  return pixel;
}

std::optional<Eigen::Vector2d> CameraModel::plane_from_pixel(const Pixel& pixel, double height_m,
                                                             Eigen::Matrix2d* jacobian) const {
  RayByPixel by_pixel;
  const std::optional<Eigen::Vector3d> ray = ray_from_pixel(pixel, jacobian != nullptr ? &by_pixel : nullptr);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d direction = map_from_camera_.linear() * *ray;
  const Eigen::Vector3d centre = map_from_camera_.translation();
  const double distance = (height_m - centre.z()) / direction.z();
  if (std::abs(direction.z()) < kParallel || !(distance > 0.0) || !std::isfinite(distance))
    return std::nullopt;
  if (jacobian != nullptr) {
    const Eigen::Matrix<double, 3, 2> turned = map_from_camera_.linear() * by_pixel;
    *jacobian = distance * (turned.topRows<2>() - direction.head<2>() / direction.z() * turned.row(2));
  }
  return Eigen::Vector2d(centre.head<2>() + distance * direction.head<2>());
}

bool CameraModel::sees(const Pixel& pixel, double margin_px) const {
  // The picture reaches half a pixel beyond the centres of its outermost pixels.
  return pixel.x() >= margin_px - 0.5 && pixel.y() >= margin_px - 0.5 &&
         pixel.x() <= intrinsics_.width_px - 0.5 - margin_px &&
         pixel.y() <= intrinsics_.height_px - 0.5 - margin_px;
}

}  // namespace skylight
