// From a tag's corners in a picture to the robot's place on the floor.
#pragma once

#include <optional>
#include <string_view>

#include "tracker/camera.hpp"
#include "tracker/detect/apriltag.hpp"

namespace skylight {

struct TagPoseConfig {
  double max_size_error = 0.08;   ///< how far the tag's size may be off, as a share, 0 to 1
  double max_plane_error = 0.02;  ///< misfit of the four corners that no turn, place or size explains, as a
                                  ///< share of the edge, 0 to 1; 0.02 is a tag that is tilted by 19 degrees
};

/// Where the corners say that the robot stands.
struct TagPose {
  Pose2 pose{};  ///< of base_link
  Covariance3 covariance = Covariance3::Identity();
  double size_ratio = 1.0;  ///< seen edge over the tag's own
  double misfit_px = 0.0;   ///< root mean square distance of the corners from where the pose puts them
};

/// A pose, or in words why there is none.
struct TagAnswer {
  std::optional<TagPose> pose;
  std::string_view refused;
};

/// Least squares over x, y and yaw on the tag's own plane (its height is known, roll and pitch are none),
/// over the four corners in pixels through the camera with its lens, weighed by their covariance;
/// Gauss-Newton from the corners carried to the plane. The pose's covariance is the inverse of the
/// information, grown where the corners fit worse than they claim to be known. A tag of another size, or one
/// that is not on its plane (a picture of one, one that is held up), is refused.
TagAnswer tag_pose(const FoundTag& found, const TagSpec& spec, const CameraModel& camera,
                   const TagPoseConfig& config = {});

/// The tag's corners in base_link, in the order of TagCorners.
std::array<Eigen::Vector2d, 4> tag_corners_m(const TagSpec& spec);

}  // namespace skylight
