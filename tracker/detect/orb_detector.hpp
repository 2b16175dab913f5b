// The detector `orb`: ORB acquires and audits, alignment of the picture tracks.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "tracker/detect/align.hpp"
#include "tracker/detect/correlate.hpp"
#include "tracker/detect/orb.hpp"

namespace skylight {

struct OrbDetectorConfig {
  OrbConfig orb;
  AlignConfig align;
  CorrelateConfig correlate;
  double accept_tracking =
      0.6;  ///< least score (see AlignResult) at a place where the robot is expected, 0 to 1
  double accept_found = 0.7;  ///< least score at a place where it was searched for, 0 to 1
};

/// Where a robot is expected.
struct Prior {
  Pose2 pose;
  double radius_m = 0.0;  ///< how far from there it may be
};

/// One robot's detector: stateless between frames but for prepared patches. Not thread-safe.
class OrbDetector {
 public:
  OrbDetector(std::shared_ptr<const Appearance> appearance, const OrbDetectorConfig& config);

  /// Looks where the robot is expected: aligns; where that refuses, searches around (`search_around`).
  /// The score of an observation is that of its alignment. None: refused, the evidence is thin.
  std::optional<Observation> detect_near(const Frame& frame, const CameraModel& camera, const Prior& prior,
                                         double surface_height_m);

  /// Searches a part of the frame, all headings: ORB, or correlation where the picture has too few
  /// features. What is found is aligned, and accepted by accept_found; places of base_link that are not
  /// `allowed` (absent: all are) do not count.
  std::optional<Observation> find_in(const Frame& frame, const CameraModel& camera, const cv::Rect& part,
                                     double surface_height_m,
                                     const std::function<bool(const Eigen::Vector2d&)>& allowed = {});

  /// A second opinion on a tracked pose: searches around it and returns a better place, if there is one
  /// that the picture fits clearly better. Guards against having settled on a look-alike.
  std::optional<Observation> audit(const Frame& frame, const CameraModel& camera, const Observation& tracked,
                                   double surface_height_m);

 private:
  std::optional<Observation> align_at(const Frame& frame, const CameraModel& camera, const Placement& from,
                                      AlignMode mode, double accept);
  void keep_better(std::optional<Observation>& best, std::optional<Observation> candidate) const;

  std::shared_ptr<const Appearance> appearance_;
  OrbDetectorConfig config_;
  Aligner aligner_;
  OrbModel orb_;
  std::optional<CorrelateModel> correlate_;  ///< only where ORB is thin
};

/// The pixels around a place of the plane, as a rectangle within the frame; empty where it is not seen.
cv::Rect part_around(const CameraModel& camera, const Eigen::Vector2d& centre_m, double radius_m,
                     double height_m);

}  // namespace skylight
