// Acquisition by ORB features (Rublee et al. 2011): which way does the picture lie on the robot's plane?
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"

namespace skylight {

struct OrbConfig {
  double picture_px =
      110.0;  ///< longer side of the picture when features are taken; small robots are upsampled to it
  int picture_features = 400;  ///< at most, on the picture
  int margin_px = 32;          ///< around the picture: ORB leaves 31 px at the edge without features
  double ratio = 0.85;         ///< nearest against second-nearest descriptor distance
  double tolerance_px = 2.5;   ///< of a matched point against the pose, pixels of the frame
  int min_inliers = 7;         ///< matched points that agree on one pose
  int max_matches = 120;       ///< the best ones, bounds the work
};

/// The picture's features, places in base_link.
struct OrbModel {
  double px_per_metre = 0.0;
  std::vector<Eigen::Vector2d> places_m;
  cv::Mat descriptors;

  /// Too few features for ORB to find this picture: search by correlation instead.
  bool thin() const { return places_m.size() < 30; }
};

OrbModel make_orb_model(const Appearance& appearance, const OrbConfig& config);

/// Features of a part of a frame.
struct OrbScene {
  std::vector<Pixel> places_px;
  cv::Mat descriptors;
};

/// `upsample`: magnification before features are taken, 0.1 to 8. `roi` is cut to the frame.
OrbScene extract_orb(const Frame& frame, const cv::Rect& roi, double upsample);

/// A pose of base_link on which matched points agree.
struct OrbPose {
  Pose2 pose{};
  int inliers = 0;
  double residual_m = 0.0;  ///< root mean square over the inliers
};

/// Matches the picture against the scene (never the other way round: a textured floor would drown it),
/// carries the matched points to the plane and takes the poses that most of them agree on: every pair of
/// matches whose distance fits proposes one, exhaustively, so that the answer does not depend on chance.
/// Best first, at most `max_poses` (copies of one picture); empty where the evidence is thin.
std::vector<OrbPose> find_orb(const OrbModel& model, const OrbScene& scene, const CameraModel& camera,
                              double surface_height_m, const OrbConfig& config, int max_poses = 1);

}  // namespace skylight
