#include "tracker/detect/tag_detector.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "tracker/detect/local_projection.hpp"

namespace skylight {
namespace {

constexpr std::string_view kNotSeen =
    "its tag is not seen where it was expected: covered, too small or blurred";
constexpr double kRim =
    1.25;  // a tag with its white rim, as a multiple of its edge: 36h11 has 10 cells for 8
constexpr double kHalfDiagonal = 0.7071068;
constexpr int kCloseLook = 128;   // px: side of a part that is looked at with full magnification
constexpr int kWidestLook = 384;  // px: side of the widest part
constexpr double kMountingM = 0.002;
constexpr double kMountingRad = 0.0175;
constexpr double kGate = 16.27;  // chi-squared of three degrees of freedom, 99.9 %

}  // namespace

Eigen::Vector2d TagDetector::middle_m(const Pose2& pose) const {
  return pose.position() + Eigen::Rotation2Dd(pose.yaw) * tag_.mounting.position();
}

std::optional<double> TagDetector::edge_px(const CameraModel& camera, const Eigen::Vector2d& at) const {
  const auto local = LocalProjection::at(camera, at, tag_.height_m, tag_.size_m);
  if (!local) return std::nullopt;
  return tag_.size_m / local->metres_per_px();
}

TagObservation TagDetector::observe(const FoundTag& found, const Frame& frame,
                                    const CameraModel& camera) const {
  const TagAnswer answer = tag_pose(found, tag_, camera, config_);
  if (!answer.pose) return {{}, answer.refused};
  return {Observation{.captured = frame.captured,
                      .pose = answer.pose->pose,
                      .covariance = answer.pose->covariance,
                      .source = PoseSource::apriltag,
                      .camera = frame.camera,
                      .score = std::clamp(found.score, 0.0, 1.0)},
          {}};
}

TagObservation TagDetector::detect_near(const TagFinder& finder, const Frame& frame,
                                        const CameraModel& camera, const Prior& prior) const {
  const Eigen::Vector2d middle = middle_m(prior.pose);
  const auto edge = edge_px(camera, middle);
  if (!edge) return {{}, kNotSeen};
  const double radius = prior.radius_m + kRim * kHalfDiagonal * tag_.size_m;
  const cv::Rect around = part_around(camera, middle, radius, tag_.height_m);
  // A robot not seen for a while may be far: the middle of where it may be, less magnified; the search has
  // the rest.
  const cv::Point centre = (around.tl() + around.br()) / 2;
  const cv::Rect widest(centre.x - kWidestLook / 2, centre.y - kWidestLook / 2, kWidestLook, kWidestLook);
  const cv::Rect part = around & widest;
  const double as_if_px = part.area() > kCloseLook * kCloseLook ? 2.0 * *edge : *edge;
  TagObservation best{{}, kNotSeen};
  for (const FoundTag& found : finder.find(frame.image, {part, as_if_px})) {
    if (!is(found)) continue;
    TagObservation seen = observe(found, frame, camera);
    const bool better =
        seen.observation && (!best.observation || seen.observation->score > best.observation->score);
    if (better || !best.observation) best = std::move(seen);
  }
  return best;
}

bool contradict(const Observation& a, const Observation& b) {
  const Eigen::Vector3d apart(a.pose.x - b.pose.x, a.pose.y - b.pose.y, wrap_angle(a.pose.yaw - b.pose.yaw));
  Covariance3 allowed = a.covariance + b.covariance;
  allowed.diagonal() +=
      Eigen::Vector3d(kMountingM * kMountingM, kMountingM * kMountingM, kMountingRad * kMountingRad);
  return apart.dot(allowed.ldlt().solve(apart)) > kGate;
}

}  // namespace skylight
