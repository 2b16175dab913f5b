// What a robot looks like from above: a picture with metric scale, and the height of its surface.
#pragma once

#include <string>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>

#include "tracker/camera.hpp"
#include "tracker/types.hpp"

namespace skylight {

/// Seen from above with the robot's forward direction (base_link x) up the picture and its left (y) to
/// the left: the pixel (column c, row r) of a w x h picture shows the place
///   x = ((h - 1) / 2 - r) metres_per_pixel - reference_point.x
///   y = ((w - 1) / 2 - c) metres_per_pixel - reference_point.y      of base_link.
struct Picture {
  cv::Mat image{};  ///< CV_8UC1, CV_8UC3 (BGR) or CV_8UC4 (BGRA, alpha below 128: not part of it)
  double metres_per_pixel = 0.0;  ///< 1e-5 to 0.1
  double surface_height_m = 0.0;  ///< of the picture above the floor, -1 to 5
  /// base_link relative to the picture's centre, in robot axes (forward, left), metres.
  Eigen::Vector2d reference_point_m = Eigen::Vector2d::Zero();
  /// Side of the square over which one pixel averages, metres; 0: metres_per_pixel. A picture cut from a
  /// frame was already averaged by the camera's pixels.
  double footprint_m = 0.0;
};

/// A box drawn on a frame, to make an appearance from what the camera sees.
struct FrameCut {
  cv::Rect2d box_px;              ///< outer edges: the box of the pixels 3 to 5 is [2.5, 5.5]
  double yaw = 0.0;               ///< the robot's yaw in `map` in that frame
  double surface_height_m = 0.0;  ///< height of the surface that is seen
};

/// A checked picture and what is known from it alone. Immutable; share it between identical robots.
class Appearance {
 public:
  /// Throws std::invalid_argument naming what is wrong: an empty picture, a depth or channel count not
  /// listed above, sides under 8 or over 8192 px, a scale, height or reference point out of range, a
  /// picture of one colour (nothing to align).
  Appearance(std::string id, Picture picture);

  const std::string& id() const { return id_; }
  const Picture& picture() const { return picture_; }

  /// CV_32FC1 or CV_32FC3 (where colour tells more than grey), values 0 to 255.
  const cv::Mat& values() const { return values_; }
  /// CV_32FC1 of the same size: 1 where the picture counts, 0 elsewhere.
  const cv::Mat& mask() const { return mask_; }
  bool coloured() const { return values_.channels() == 3; }

  /// Forward and left extent, metres.
  Eigen::Vector2d size_m() const;
  /// Centre of the picture in base_link.
  Eigen::Vector2d centre_m() const { return -picture_.reference_point_m; }

  /// The picture turned by 2 pi / heading_turns about its centre looks the same: 1, 2 or 4.
  int heading_turns() const { return heading_turns_; }

 private:
  std::string id_;
  Picture picture_;
  cv::Mat values_;
  cv::Mat mask_;
  int heading_turns_ = 1;
};

/// Cuts a box out of a frame, rectified to the plane at the given height; base_link at the box's centre.
/// `pose` (if given) receives where the robot stands in that frame. Throws std::invalid_argument where
/// the box leaves the picture, has less than 8 px a side, or cannot be carried to the plane.
Picture cut_from_frame(const Frame& frame, const CameraModel& camera, const FrameCut& cut,
                       Pose2* pose = nullptr);

}  // namespace skylight
