// The detector `apriltag`: one robot's tag, looked for where the robot is expected. The finder is shared.
#pragma once

#include <optional>
#include <string_view>

#include "tracker/detect/orb_detector.hpp"
#include "tracker/detect/tag_pose.hpp"

namespace skylight {

/// An observation, or in words why there is none.
struct TagObservation {
  std::optional<Observation> observation;
  std::string_view refused;
};

/// Stateless between frames.
class TagDetector {
 public:
  TagDetector(const TagSpec& tag, const TagPoseConfig& config) : tag_(tag), config_(config) {}

  const TagSpec& tag() const { return tag_; }
  bool is(const FoundTag& found) const { return found.id == tag_.id && found.family == tag_.family; }

  /// Looks around where the tag should be; the finder must know its family. Of several (there should be but
  /// one) the one that fits its pattern best. The observation's score is FoundTag::score.
  TagObservation detect_near(const TagFinder& finder, const Frame& frame, const CameraModel& camera,
                             const Prior& prior) const;

  /// What a tag that was found tells of the robot. It must be this one's.
  TagObservation observe(const FoundTag& found, const Frame& frame, const CameraModel& camera) const;

  /// Where the tag's middle is for a robot at this pose, `map`.
  Eigen::Vector2d middle_m(const Pose2& pose) const;
  /// Its edge in pixels at a place of its plane; none where the camera's model does not hold.
  std::optional<double> edge_px(const CameraModel& camera, const Eigen::Vector2d& at) const;

 private:
  TagSpec tag_;
  TagPoseConfig config_;
};

/// Whether two observations of one robot contradict each other: farther apart than both covariances allow,
/// and than the tag's mounting may be off (2 mm, 1 degree: nobody glues tags on better).
bool contradict(const Observation& a, const Observation& b);

}  // namespace skylight
