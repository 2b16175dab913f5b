#include "tracker/detect/tag_pose.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace skylight {
namespace {

constexpr std::string_view kNoPlane = "the tag is seen where the camera's model does not hold";
constexpr std::string_view kWrongSize =
    "a tag of this id is seen in another size: another tag, or not at its height";
constexpr std::string_view kOffPlane = "a tag of this id is seen that does not lie flat";
constexpr double kSureOf = 3.0;          // standard deviations beyond which a misfit is none of the noise
constexpr double kLikelyMisfit = 11.07;  // chi-squared of five degrees of freedom, 95 %
constexpr int kMostIterations = 10;
constexpr double kSmallStep = 1e-9;  // m, rad

using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;
using Places = std::array<Eigen::Vector2d, 4>;

/// Turn, size and place that bring one set of points onto another best (Umeyama 1991, in the plane).
struct Similarity {
  Pose2 pose;
  double size = 1.0;
  double misfit_m = 0.0;  ///< root mean square
};

Similarity similarity(const Places& from, const Places& to) {
  const Eigen::Vector2d a = 0.25 * (from[0] + from[1] + from[2] + from[3]);
  const Eigen::Vector2d b = 0.25 * (to[0] + to[1] + to[2] + to[3]);
  double along = 0.0, across = 0.0, from_squares = 0.0, to_squares = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d p = from[i] - a;
    const Eigen::Vector2d q = to[i] - b;
    along += p.dot(q);
    across += p.x() * q.y() - p.y() * q.x();
    from_squares += p.squaredNorm();
    to_squares += q.squaredNorm();
  }
  Similarity result;
  result.pose.yaw = std::atan2(across, along);
  const double turned = std::hypot(along, across);
  result.size = turned / from_squares;
  result.misfit_m = std::sqrt(std::max(0.0, to_squares - turned * result.size) / 4.0);
  // Where the origin of `from` goes: base_link.
  const Eigen::Vector2d origin = b - Eigen::Rotation2Dd(result.pose.yaw) * a;
  result.pose.x = origin.x();
  result.pose.y = origin.y();
  return result;
}

/// What the corners say of a pose: where they should be less where they are, and its change with the pose.
struct Residual {
  Vector8 px;
  Eigen::Matrix<double, 8, 3> by_pose;
};

std::optional<Residual> residual(const FoundTag& found, const Places& corners_m, const CameraModel& camera,
                                 double height_m, const Pose2& pose) {
  Residual out;
  const Eigen::Rotation2Dd turn(pose.yaw);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d arm = turn * corners_m[i];
    const Eigen::Vector2d at = pose.position() + arm;
    CameraModel::PixelByPoint by_point;
    const auto pixel = camera.pixel_from_map({at.x(), at.y(), height_m}, &by_point);
    if (!pixel) return std::nullopt;
    Eigen::Matrix<double, 3, 3> point_by_pose;
    point_by_pose << 1, 0, -arm.y(), 0, 1, arm.x(), 0, 0, 0;
    const auto row = 2 * static_cast<Eigen::Index>(i);
    out.px.segment<2>(row) = found.corners_px[i] - *pixel;
    out.by_pose.middleRows<2>(row) = by_point * point_by_pose;
  }
  return out;
}

}  // namespace

std::array<Eigen::Vector2d, 4> tag_corners_m(const TagSpec& spec) {
  // In the tag's own axes: x up the upright tag, y to its left.
  const double half = 0.5 * spec.size_m;
  Places corners{Eigen::Vector2d(half, half), Eigen::Vector2d(half, -half), Eigen::Vector2d(-half, -half),
                 Eigen::Vector2d(-half, half)};
  const Eigen::Rotation2Dd turn(spec.mounting.yaw);
  for (Eigen::Vector2d& corner : corners) corner = spec.mounting.position() + turn * corner;
  return corners;
}

TagAnswer tag_pose(const FoundTag& found, const TagSpec& spec, const CameraModel& camera,
                   const TagPoseConfig& config) {
  const Places corners_m = tag_corners_m(spec);
  Places seen_m;
  double edge_px = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto at = camera.plane_from_pixel(found.corners_px[i], spec.height_m);
    if (!at) return {{}, kNoPlane};
    seen_m[i] = *at;
    edge_px += 0.25 * (found.corners_px[i] - found.corners_px[(i + 1) % 4]).norm();
  }
  const Similarity start = similarity(corners_m, seen_m);
  const double noise = std::sqrt(found.covariance.diagonal().mean()) / edge_px;  // as a share of the edge
  if (std::abs(start.size - 1.0) > config.max_size_error + kSureOf * noise) return {{}, kWrongSize};
  if (start.misfit_m > spec.size_m * (config.max_plane_error + kSureOf * noise)) return {{}, kOffPlane};

  const Eigen::LLT<Matrix8> weight(found.covariance);
  if (weight.info() != Eigen::Success) return {{}, kNoPlane};
  TagPose answer{.pose = start.pose, .size_ratio = start.size};
  for (int i = 0; i < kMostIterations; ++i) {
    const auto now = residual(found, corners_m, camera, spec.height_m, answer.pose);
    if (!now) return {{}, kNoPlane};
    const Eigen::Matrix<double, 8, 3> weighed = weight.solve(now->by_pose);
    const Eigen::Matrix3d information = now->by_pose.transpose() * weighed;
    const Eigen::Vector3d step = information.ldlt().solve(weighed.transpose() * now->px);
    const double misfit = now->px.dot(weight.solve(now->px));
    answer.covariance = information.inverse() * std::max(1.0, misfit / kLikelyMisfit);
    answer.misfit_px = now->px.norm() / 2.0;
    if (step.norm() < kSmallStep) break;
    answer.pose = {answer.pose.x + step.x(), answer.pose.y + step.y(),
                   wrap_angle(answer.pose.yaw + step.z())};
  }
  if (!answer.covariance.allFinite()) return {{}, kNoPlane};
  return {answer, {}};
}

}  // namespace skylight
