#include "service/calibration/floor_fit.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>

#include "service/calibration/least_squares.hpp"

namespace skylight::calibration {
namespace {

constexpr double kSmallestGain = 1e-9;  ///< share of the cost
constexpr int kPlace = 3;               ///< x, y, yaw of a sheet

Eigen::Index camera_at(std::size_t camera) {
  return kCameraParameters * static_cast<Eigen::Index>(camera);
}
Eigen::Index sheet_at(const ExtrinsicsInput& input, std::size_t sheet) {
  return camera_at(input.cameras.size()) + kPlace * static_cast<Eigen::Index>(sheet);
}
Eigen::Index all(const ExtrinsicsInput& input) {
  return sheet_at(input, input.sheets.size());
}

/// A parameter of the intrinsics that stays as it is.
bool held(const SeeingCamera& camera, Eigen::Index parameter) {
  if (camera.intrinsics.lens == LensModel::kannala_brandt && parameter == kDistortion + 4) return true;
  return !camera.unknown_intrinsics && !(camera.covariance(parameter, parameter) > 0.0);
}

/// A coordinate of a sheet's place that stays as it is.
bool held(const Sheet& sheet, int coordinate) {
  return sheet.place && !((coordinate < 2 ? sheet.sigma_m : sheet.sigma_rad) > 0.0);
}

struct PointTerms {
  Eigen::Vector2d error{0, 0};
  Eigen::Matrix<double, 2, kCameraParameters> by_camera;
  Eigen::Matrix<double, 2, kPlace> by_sheet;
  Eigen::Matrix2d information;
};

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d out;
  out << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return out;
}

std::optional<PointTerms> terms_of(const SeenPoint& point, const CameraModel& camera, const FloorPlace& place,
                                   double noise_scale) {
  const Eigen::Vector3d at = in_map(place, point.at);
  CameraModel::PixelByPoint by_map;
  const auto pixel = camera.pixel_from_map(at, &by_map);
  if (!pixel) return std::nullopt;
  PointTerms out;
  out.error = *pixel - point.pixel;
  const Eigen::Isometry3d& pose = camera.map_from_camera();
  const Eigen::Vector3d way = at - pose.translation();
  // The camera moves, the point stays: as tracker/camera_uncertainty.hpp has its parameters.
  out.by_camera.leftCols<kCameraPosition>() =
      pixel_by_intrinsics(camera.intrinsics(), *pixel, pose.linear().transpose() * way);
  out.by_camera.middleCols<3>(kCameraPosition) = -by_map;
  out.by_camera.middleCols<3>(kCameraRotation) = by_map * cross_matrix(way);
  const Eigen::Vector2d turned(-(at.y() - place.y_m), at.x() - place.x_m);
  out.by_sheet << by_map.leftCols<2>(), by_map.leftCols<2>() * turned;
  const Eigen::Matrix2d covariance =
      noise_scale * noise_scale *
      (point.sigma_px * point.sigma_px * Eigen::Matrix2d::Identity() +
       point.sigma_m * point.sigma_m * by_map.leftCols<2>() * by_map.leftCols<2>().transpose());
  out.information = covariance.inverse();
  return out;
}

bool add_points(const ExtrinsicsInput& input, const FloorFitOptions& options, const FloorState& state,
                std::size_t camera, Normal& out) {
  const Eigen::Index c = camera_at(camera);
  const auto& points = input.cameras[camera].points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!options.used[camera][i]) continue;
    const auto terms =
        terms_of(points[i], state.cameras[camera], state.sheets[points[i].sheet], options.noise_scale);
    if (!terms) return false;
    double cost = terms->error.dot(terms->information * terms->error);
    Eigen::Matrix2d information = terms->information;
    if (options.robust > 0.0) {
      const double scale = options.robust * options.robust;
      information /= 1.0 + cost / scale;
      cost = scale * std::log1p(cost / scale);
    }
    const Eigen::Index s = sheet_at(input, points[i].sheet);
    const Eigen::Matrix<double, kCameraParameters, 2> weighted = terms->by_camera.transpose() * information;
    const Eigen::Matrix<double, kPlace, 2> weighted_sheet = terms->by_sheet.transpose() * information;
    out.cost += 0.5 * cost;
    out.gradient.segment<kCameraParameters>(c) += weighted * terms->error;
    out.gradient.segment<kPlace>(s) += weighted_sheet * terms->error;
    out.hessian.block<kCameraParameters, kCameraParameters>(c, c) += weighted * terms->by_camera;
    const Eigen::Matrix<double, kCameraParameters, kPlace> mixed = weighted * terms->by_sheet;
    out.hessian.block<kCameraParameters, kPlace>(c, s) += mixed;
    out.hessian.block<kPlace, kCameraParameters>(s, c) += mixed.transpose();
    out.hessian.block<kPlace, kPlace>(s, s) += weighted_sheet * terms->by_sheet;
  }
  return true;
}

/// What is known beforehand of the camera: its measured height, and what its calibration says of its
/// intrinsics.
void add_prior(const SeeingCamera& camera, const CameraModel& now, Eigen::Index at, Normal& out) {
  if (camera.height_m) {
    const double weight = 1.0 / (camera.height_sigma_m * camera.height_sigma_m);
    const double off = now.map_from_camera().translation().z() - *camera.height_m;
    const Eigen::Index z = at + kCameraPosition + 2;
    out.cost += 0.5 * weight * off * off;
    out.gradient[z] += weight * off;
    out.hessian(z, z) += weight;
  }
  if (camera.unknown_intrinsics) return;
  std::vector<Eigen::Index> open;
  for (Eigen::Index i = 0; i < kCameraPosition; ++i) {
    if (!held(camera, i)) open.push_back(i);
  }
  if (open.empty()) return;
  const auto information = inverse_of(camera.covariance(open, open));
  if (!information)
    throw std::invalid_argument(camera.name + ": the covariance of its intrinsics is singular");
  const Intrinsics& from = camera.intrinsics;
  const Intrinsics& to = now.intrinsics();
  Eigen::Matrix<double, kCameraPosition, 1> off;
  off << to.fx_px - from.fx_px, to.fy_px - from.fy_px, to.cx_px - from.cx_px, to.cy_px - from.cy_px, 0, 0, 0,
      0, 0;
  for (std::size_t i = 0; i < from.distortion.size(); ++i)
    off[kDistortion + static_cast<Eigen::Index>(i)] = to.distortion[i] - from.distortion[i];
  const Eigen::VectorXd step = off(open);
  const Eigen::VectorXd pull = *information * step;
  out.cost += 0.5 * step.dot(pull);
  for (std::size_t i = 0; i < open.size(); ++i) {
    out.gradient[at + open[i]] += pull[static_cast<Eigen::Index>(i)];
    for (std::size_t j = 0; j < open.size(); ++j)
      out.hessian(at + open[i], at + open[j]) +=
          (*information)(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
}

/// What was measured of a sheet's place.
void add_prior(const Sheet& sheet, const FloorPlace& now, Eigen::Index at, Normal& out) {
  if (!sheet.place) return;
  const Eigen::Vector3d off(now.x_m - sheet.place->x_m, now.y_m - sheet.place->y_m,
                            wrap_angle(now.yaw_rad - sheet.place->yaw_rad));
  for (int i = 0; i < kPlace; ++i) {
    if (held(sheet, i)) continue;
    const double sigma = i < 2 ? sheet.sigma_m : sheet.sigma_rad;
    out.cost += 0.5 * off[i] * off[i] / (sigma * sigma);
    out.gradient[at + i] += off[i] / (sigma * sigma);
    out.hessian(at + i, at + i) += 1.0 / (sigma * sigma);
  }
}

bool is_used(const ExtrinsicsInput& input, const FloorFitOptions& options, std::size_t sheet) {
  for (std::size_t camera = 0; camera < input.cameras.size(); ++camera) {
    for (std::size_t i = 0; i < input.cameras[camera].points.size(); ++i) {
      if (options.used[camera][i] && input.cameras[camera].points[i].sheet == sheet) return true;
    }
  }
  return false;
}

std::optional<Normal> normal_at(const ExtrinsicsInput& input, const FloorFitOptions& options,
                                const FloorState& state) {
  if (!state.holds) return std::nullopt;
  Normal out(all(input));
  for (std::size_t camera = 0; camera < input.cameras.size(); ++camera) {
    if (!add_points(input, options, state, camera, out)) return std::nullopt;
    const Eigen::Index at = camera_at(camera);
    add_prior(input.cameras[camera], state.cameras[camera], at, out);
    for (Eigen::Index i = 0; i < kCameraPosition; ++i) {
      if (held(input.cameras[camera], i)) out.hold(at + i);
    }
  }
  for (std::size_t sheet = 0; sheet < input.sheets.size(); ++sheet) {
    const Eigen::Index at = sheet_at(input, sheet);
    add_prior(input.sheets[sheet], state.sheets[sheet], at, out);
    const bool loose = !input.sheets[sheet].place && !is_used(input, options, sheet);
    for (int i = 0; i < kPlace; ++i) {
      if (loose || held(input.sheets[sheet], i)) out.hold(at + i);
    }
  }
  return out;
}

FloorState moved_state(const ExtrinsicsInput& input, const FloorState& state, const Eigen::VectorXd& step) {
  FloorState out{.cameras = {}, .sheets = state.sheets};
  for (std::size_t camera = 0; camera < state.cameras.size(); ++camera) {
    const CameraParameters by = step.segment<kCameraParameters>(camera_at(camera));
    try {
      out.cameras.push_back(moved(state.cameras[camera], by));
    } catch (const std::invalid_argument&) {  // too far
      out.cameras.push_back(state.cameras[camera]);
      out.holds = false;
    }
  }
  for (std::size_t sheet = 0; sheet < out.sheets.size(); ++sheet) {
    const Eigen::Index at = sheet_at(input, sheet);
    out.sheets[sheet].x_m += step[at];
    out.sheets[sheet].y_m += step[at + 1];
    out.sheets[sheet].yaw_rad = wrap_angle(out.sheets[sheet].yaw_rad + step[at + 2]);
  }
  return out;
}

}  // namespace

Eigen::Vector3d in_map(const FloorPlace& place, const Eigen::Vector3d& at) {
  const double c = std::cos(place.yaw_rad);
  const double s = std::sin(place.yaw_rad);
  return {place.x_m + c * at.x() - s * at.y(), place.y_m + s * at.x() + c * at.y(), at.z()};
}

bool improve(const ExtrinsicsInput& input, const FloorFitOptions& options, FloorState& state) {
  const auto at = [&](const FloorState& there) { return normal_at(input, options, there); };
  const auto move = [&](const FloorState& from, const Eigen::VectorXd& step) {
    return moved_state(input, from, step);
  };
  return minimise(state, at, move, {.most_steps = options.most_steps, .smallest_gain = kSmallestGain});
}

Surplus surplus(const ExtrinsicsInput& input, const FloorFitOptions& options, const FloorState& state) {
  Surplus out;
  for (std::size_t camera = 0; camera < input.cameras.size(); ++camera) {
    const auto& points = input.cameras[camera].points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!options.used[camera][i]) continue;
      const auto terms =
          terms_of(points[i], state.cameras[camera], state.sheets[points[i].sheet], options.noise_scale);
      if (!terms) continue;
      out.chi_square += terms->error.dot(terms->information * terms->error);
      out.freedom += 2;
    }
    out.freedom -= 6;
    // Intrinsics and places that are known beforehand bring their own information.
    if (!input.cameras[camera].unknown_intrinsics) continue;
    for (Eigen::Index i = 0; i < kCameraPosition; ++i) out.freedom -= held(input.cameras[camera], i) ? 0 : 1;
  }
  for (std::size_t sheet = 0; sheet < input.sheets.size(); ++sheet)
    out.freedom -= !input.sheets[sheet].place && is_used(input, options, sheet) ? kPlace : 0;
  return out;
}

std::vector<CameraUncertainty> uncertainties(const ExtrinsicsInput& input, const FloorFitOptions& options,
                                             const FloorState& state) {
  const auto normal = normal_at(input, options, state);
  if (!normal) return {};
  const auto inverse = inverse_of(normal->hessian);
  if (!inverse) return {};
  std::vector<CameraUncertainty> out;
  for (std::size_t camera = 0; camera < input.cameras.size(); ++camera) {
    const Eigen::Index at = camera_at(camera);
    CameraUncertainty& one = out.emplace_back();
    one.covariance = inverse->block<kCameraParameters, kCameraParameters>(at, at);
    for (Eigen::Index i = 0; i < kCameraPosition; ++i) {
      if (!held(input.cameras[camera], i)) continue;
      one.covariance.row(i).setZero();
      one.covariance.col(i).setZero();
    }
  }
  return out;
}

}  // namespace skylight::calibration
