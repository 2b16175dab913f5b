#include "tracker/detect/orb_detector.hpp"

#include <algorithm>
#include <cmath>

#include "tracker/detect/local_projection.hpp"

namespace skylight {
namespace {

constexpr double kClearlyBetter = 0.05;  // score by which an audit must win
constexpr double kBeyondDoubt = 0.85;    // score from which no other way of aligning is tried
constexpr int kMaxCandidates = 3;

// Metres per pixel of the plane at the middle of a part of the frame.
std::optional<double> scale_at(const CameraModel& camera, const cv::Rect& part, double height_m) {
  Eigen::Matrix2d metres_by_px;
  const Pixel middle(part.x + part.width / 2.0, part.y + part.height / 2.0);
  if (!camera.plane_from_pixel(middle, height_m, &metres_by_px)) return std::nullopt;
  return std::sqrt(std::abs(metres_by_px.determinant()));
}

std::optional<FloorPart> floor_part(const CameraModel& camera, const cv::Rect& part, double height_m) {
  const auto centre =
      camera.plane_from_pixel({part.x + part.width / 2.0, part.y + part.height / 2.0}, height_m);
  const auto scale = scale_at(camera, part, height_m);
  if (!centre || !scale) return std::nullopt;
  return FloorPart{*centre, 0.5 * std::max(part.width, part.height) * *scale};
}

}  // namespace

cv::Rect part_around(const CameraModel& camera, const Eigen::Vector2d& centre_m, double radius_m,
                     double height_m) {
  const auto local = LocalProjection::at(camera, centre_m, height_m, radius_m);
  if (!local) return {};
  const Eigen::Vector2d half = local->jacobian.cwiseAbs() * Eigen::Vector2d::Constant(radius_m);
  const cv::Rect around(static_cast<int>(std::floor(local->origin_px.x() - half.x())),
                        static_cast<int>(std::floor(local->origin_px.y() - half.y())),
                        static_cast<int>(std::ceil(2 * half.x())) + 1,
                        static_cast<int>(std::ceil(2 * half.y())) + 1);
  return around & cv::Rect(0, 0, camera.intrinsics().width_px, camera.intrinsics().height_px);
}

OrbDetector::OrbDetector(std::shared_ptr<const Appearance> appearance, const OrbDetectorConfig& config)
    : appearance_(std::move(appearance)),
      config_(config),
      aligner_(appearance_, config.align),
      orb_(make_orb_model(*appearance_, config.orb)) {
  if (orb_.thin()) correlate_ = make_correlate_model(*appearance_, config.correlate);
}

std::optional<Observation> OrbDetector::align_at(const Frame& frame, const CameraModel& camera,
                                                 const Placement& from, AlignMode mode, double accept) {
  const auto aligned = aligner_.align(frame, camera, from, mode);
  if (!aligned || aligned->score < accept) return std::nullopt;
  return Observation{.captured = frame.captured,
                     .pose = aligned->pose,
                     .covariance = aligned->covariance,
                     .source = PoseSource::align,
                     .camera = frame.camera,
                     .score = aligned->score,
                     .heading_turns = appearance_->heading_turns()};
}

void OrbDetector::keep_better(std::optional<Observation>& best, std::optional<Observation> candidate) const {
  if (candidate && (!best || candidate->score > best->score)) best = std::move(candidate);
}

std::optional<Observation> OrbDetector::detect_near(const Frame& frame, const CameraModel& camera,
                                                    const Prior& prior, double surface_height_m) {
  const Placement from{prior.pose, surface_height_m};
  std::optional<Observation> best;
  for (const AlignMode mode : {AlignMode::fine, AlignMode::smeared, AlignMode::coarse}) {
    keep_better(best, align_at(frame, camera, from, mode, config_.accept_tracking));
    if (best && best->score >= kBeyondDoubt) return best;
  }
  if (best) return best;
  const double radius = prior.radius_m + 0.6 * appearance_->size_m().norm();
  return find_in(frame, camera, part_around(camera, prior.pose.position(), radius, surface_height_m),
                 surface_height_m);
}

std::optional<Observation> OrbDetector::find_in(const Frame& frame, const CameraModel& camera,
                                                const cv::Rect& part, double surface_height_m,
                                                const std::function<bool(const Eigen::Vector2d&)>& allowed) {
  std::optional<Observation> best;
  const auto consider = [&](const Pose2& pose, AlignMode mode) {
    auto found = align_at(frame, camera, {pose, surface_height_m}, mode, config_.accept_found);
    if (found && (!allowed || allowed(found->pose.position()))) keep_better(best, std::move(found));
  };
  const auto scale = part.empty() ? std::nullopt : scale_at(camera, part, surface_height_m);
  if (!scale) return best;
  if (correlate_) {
    const auto floor = floor_part(camera, part, surface_height_m);
    if (!floor) return best;
    for (const CorrelatePose& found : find_correlate(*correlate_, *appearance_, frame, camera, *floor,
                                                     surface_height_m, config_.correlate)) {
      consider(found.pose, AlignMode::coarse);
    }
    return best;
  }
  const double upsample = std::clamp(orb_.px_per_metre * *scale, 0.1, 8.0);
  const OrbScene scene = extract_orb(frame, part, upsample);
  for (const OrbPose& found : find_orb(orb_, scene, camera, surface_height_m, config_.orb, kMaxCandidates)) {
    consider(found.pose, AlignMode::fine);
  }
  if (best) best->source = PoseSource::orb;
  return best;
}

std::optional<Observation> OrbDetector::audit(const Frame& frame, const CameraModel& camera,
                                              const Observation& tracked, double surface_height_m) {
  const double size = appearance_->size_m().norm();
  auto found = find_in(frame, camera, part_around(camera, tracked.pose.position(), size, surface_height_m),
                       surface_height_m);
  if (!found || found->score < tracked.score + kClearlyBetter) return std::nullopt;
  return found;
}

}  // namespace skylight
