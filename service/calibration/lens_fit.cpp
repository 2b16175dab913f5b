#include "service/calibration/lens_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/calib3d.hpp>

#include "service/calibration/least_squares.hpp"

namespace skylight::calibration {
namespace {

constexpr int kPose = 6;  ///< translation, then rotation about the camera's axes
/// Focal lengths to start from, in widths of the picture: from a fisheye to a telephoto lens.
constexpr std::array kStarts{0.2, 0.28, 0.4, 0.55, 0.75, 1.0, 1.4, 2.0, 3.0, 5.0};
constexpr int kStartSteps = 12;
/// Of a picture's width: residuals that a start is not upset by.
constexpr double kStartRobust = 0.01;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d out;
  out << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return out;
}

Eigen::Isometry3d moved_pose(const Eigen::Isometry3d& pose, const Eigen::Matrix<double, kPose, 1>& step) {
  Eigen::Isometry3d out = pose;
  out.translation() += step.head<3>();
  const Eigen::Vector3d rotation = step.tail<3>();
  if (const double angle = rotation.norm(); angle > 0.0) {
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix() *
                                    pose.linear());
    out.linear() = turned.normalized().toRotationMatrix();
  }
  return out;
}

LensFit moved_fit(const LensFit& fit, const Eigen::VectorXd& step) {
  LensFit out = fit;
  out.intrinsics.fx_px += step[kFocalX];
  out.intrinsics.fy_px += step[kFocalY];
  out.intrinsics.cx_px += step[kCentreX];
  out.intrinsics.cy_px += step[kCentreY];
  for (int i = 0; i < 5; ++i) out.intrinsics.distortion[static_cast<std::size_t>(i)] += step[kDistortion + i];
  for (std::size_t view = 0; view < fit.camera_from_board.size(); ++view) {
    const auto at = kCameraPosition + kPose * static_cast<Eigen::Index>(view);
    out.camera_from_board[view] = moved_pose(fit.camera_from_board[view], step.segment<kPose>(at));
  }
  return out;
}

bool holds(LensModel lens, const FitOptions& options, int parameter) {
  const bool fifth = parameter == kDistortion + 4;
  if (lens == LensModel::kannala_brandt) return fifth;
  return (options.hold_k3 && fifth) || (options.hold_k2 && parameter == kDistortion + 1);
}

/// One view's part of the normal equations. False where the model does not hold at a corner.
bool add_view(const CameraModel& camera, const BoardView& view, const std::vector<bool>& used,
              const Eigen::Isometry3d& pose, double robust_px, Eigen::Index at, Normal& out) {
  constexpr int kAll = kCameraPosition + kPose;
  Eigen::Matrix<double, kAll, kAll> h = Eigen::Matrix<double, kAll, kAll>::Zero();
  Eigen::Matrix<double, kAll, 1> g = Eigen::Matrix<double, kAll, 1>::Zero();
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (!used[i]) continue;
    const Eigen::Vector3d turned = pose.linear() * view.points[i];
    const Eigen::Vector3d point = turned + pose.translation();
    CameraModel::PixelByPoint by_point;
    const auto pixel = camera.pixel_from_camera(point, &by_point);
    if (!pixel) return false;
    Eigen::Matrix<double, 2, kAll> j;
    j.leftCols<kCameraPosition>() = pixel_by_intrinsics(camera.intrinsics(), *pixel, point);
    j.middleCols<3>(kCameraPosition) = by_point;
    j.rightCols<3>() = -by_point * cross_matrix(turned);
    const Eigen::Vector2d error = *pixel - view.pixels[i];
    double weight = 1.0;
    double cost = error.squaredNorm();
    if (robust_px > 0.0) {
      const double scale = robust_px * robust_px;
      weight = 1.0 / (1.0 + cost / scale);
      cost = scale * std::log1p(cost / scale);
    }
    out.cost += 0.5 * cost;
    g.noalias() += weight * j.transpose() * error;
    h.noalias() += weight * j.transpose() * j;
  }
  out.gradient.head<kCameraPosition>() += g.head<kCameraPosition>();
  out.gradient.segment<kPose>(at) += g.tail<kPose>();
  out.hessian.topLeftCorner<kCameraPosition, kCameraPosition>() +=
      h.topLeftCorner<kCameraPosition, kCameraPosition>();
  out.hessian.block<kCameraPosition, kPose>(0, at) += h.topRightCorner<kCameraPosition, kPose>();
  out.hessian.block<kPose, kCameraPosition>(at, 0) += h.bottomLeftCorner<kPose, kCameraPosition>();
  out.hessian.block<kPose, kPose>(at, at) += h.bottomRightCorner<kPose, kPose>();
  return true;
}

std::optional<Normal> normal_at(const std::vector<BoardView>& views, const FitOptions& options,
                                const LensFit& fit) {
  if (!check(fit.intrinsics).empty()) return std::nullopt;
  const CameraModel camera(fit.intrinsics, Eigen::Isometry3d::Identity());
  Normal out(kCameraPosition + kPose * static_cast<Eigen::Index>(views.size()));
  for (std::size_t view = 0; view < views.size(); ++view) {
    const auto at = kCameraPosition + kPose * static_cast<Eigen::Index>(view);
    const auto& used = options.used[view];
    if (std::find(used.begin(), used.end(), true) == used.end()) {  // the pose has nothing to go by
      out.hessian.diagonal().segment<kPose>(at).setOnes();
    } else if (!add_view(camera, views[view], used, fit.camera_from_board[view], options.robust_px, at,
                         out)) {
      return std::nullopt;
    }
  }
  for (int i = 0; i < kCameraPosition; ++i) {
    if (holds(fit.intrinsics.lens, options, i)) out.hold(i);
  }
  return out;
}

/// The pose of a plane by its homography (Collins and Bartoli, "Infinitesimal plane-based pose estimation",
/// IJCV 109 (2014)), for a lens without distortion.
std::optional<Eigen::Isometry3d> start_pose(const CameraModel& camera, const BoardView& view,
                                            const std::vector<bool>& used) {
  std::vector<cv::Point3d> places;
  std::vector<cv::Point2d> seen;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const auto ray = camera.ray_from_pixel(view.pixels[i]);
    if (!used[i] || !ray || ray->z() < 0.1) continue;
    places.emplace_back(view.points[i].x(), view.points[i].y(), 0.0);
    seen.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
  }
  if (places.size() < 4) return std::nullopt;
  cv::Vec3d rotation;
  cv::Vec3d translation;
  if (!cv::solvePnP(places, seen, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation, translation, false,
                    cv::SOLVEPNP_IPPE))
    return std::nullopt;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() << translation[0], translation[1], translation[2];
  const Eigen::Vector3d turn(rotation[0], rotation[1], rotation[2]);
  if (turn.norm() > 0.0) pose.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  if (!pose.matrix().allFinite()) return std::nullopt;
  return pose;
}

std::optional<LensFit> fit_from(const std::vector<BoardView>& views, const Intrinsics& intrinsics,
                                FitOptions options) {
  const CameraModel camera(intrinsics, Eigen::Isometry3d::Identity());
  LensFit fit{.intrinsics = intrinsics, .camera_from_board = {}};
  for (std::size_t view = 0; view < views.size(); ++view) {
    const auto pose = start_pose(camera, views[view], options.used[view]);
    if (!pose) return std::nullopt;
    fit.camera_from_board.push_back(*pose);
  }
  options.robust_px = kStartRobust * intrinsics.width_px;
  const auto at = [&](const LensFit& state) { return normal_at(views, options, state); };
  if (!minimise(fit, at, moved_fit, {.most_steps = kStartSteps, .smallest_gain = 1e-4})) return std::nullopt;
  const auto normal = at(fit);
  if (!normal) return std::nullopt;
  fit.cost = normal->cost;
  return fit;
}

}  // namespace

std::optional<LensFit> first_fit(const std::vector<BoardView>& views, const IntrinsicsOptions& options,
                                 LensModel lens, const FitOptions& fit) {
  std::optional<LensFit> best;
  for (const double start : kStarts) {
    const double focal_px = start * options.width_px;
    const auto tried = fit_from(views,
                                {.width_px = options.width_px,
                                 .height_px = options.height_px,
                                 .fx_px = focal_px,
                                 .fy_px = focal_px,
                                 .cx_px = (options.width_px - 1) / 2.0,
                                 .cy_px = (options.height_px - 1) / 2.0,
                                 .lens = lens},
                                fit);
    if (tried && (!best || tried->cost < best->cost)) best = tried;
  }
  return best;
}

bool improve(const std::vector<BoardView>& views, const FitOptions& options, LensFit& fit) {
  if (options.hold_k3) fit.intrinsics.distortion[4] = 0.0;
  if (options.hold_k2) fit.intrinsics.distortion[1] = 0.0;
  const auto at = [&](const LensFit& state) { return normal_at(views, options, state); };
  if (!minimise(fit, at, moved_fit)) return false;
  fit.cost = at(fit)->cost;
  return true;
}

std::vector<std::vector<double>> reprojection_errors(const std::vector<BoardView>& views,
                                                     const LensFit& fit) {
  const CameraModel camera(fit.intrinsics, Eigen::Isometry3d::Identity());
  std::vector<std::vector<double>> errors(views.size());
  for (std::size_t view = 0; view < views.size(); ++view) {
    for (std::size_t i = 0; i < views[view].points.size(); ++i) {
      const auto pixel = camera.pixel_from_camera(fit.camera_from_board[view] * views[view].points[i]);
      errors[view].push_back(pixel ? (*pixel - views[view].pixels[i]).norm()
                                   : std::numeric_limits<double>::infinity());
    }
  }
  return errors;
}

std::optional<IntrinsicsCovariance> unit_covariance(const std::vector<BoardView>& views,
                                                    const FitOptions& options, const LensFit& fit) {
  const auto normal = normal_at(views, options, fit);
  if (!normal) return std::nullopt;
  const auto inverse = inverse_of(normal->hessian);
  if (!inverse) return std::nullopt;
  IntrinsicsCovariance out = inverse->topLeftCorner<kCameraPosition, kCameraPosition>();
  for (int i = 0; i < kCameraPosition; ++i) {
    if (!holds(fit.intrinsics.lens, options, i)) continue;
    out.row(i).setZero();
    out.col(i).setZero();
  }
  return out;
}

}  // namespace skylight::calibration
