// The plain values that pass between the stages. Metres, radians, seconds; frames as in tracker/README.md.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace skylight {

/// An instant, Unix time. The tracker reads no clock: every time enters as an argument.
using Time = std::chrono::sys_time<std::chrono::nanoseconds>;
using Duration = std::chrono::nanoseconds;

inline double to_seconds(Duration d) {
  return std::chrono::duration<double>(d).count();
}
/// Nearest nanosecond; |seconds| must be below 9.2e9.
inline Duration from_seconds(double seconds) {
  return Duration{std::llround(seconds * 1e9)};
}

/// A place in an image, pixels; the centre of the top-left pixel is (0, 0), as in OpenCV.
using Pixel = Eigen::Vector2d;

/// An angle brought to (-pi, pi].
inline double wrap_angle(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2.0 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? wrapped + 2.0 * std::numbers::pi : wrapped;
}

/// Where a robot's base_link stands in `map`: metres, yaw counter-clockwise from map x in (-pi, pi].
struct Pose2 {
  double x = 0.0;
  double y = 0.0;
  double yaw = 0.0;

  Eigen::Vector2d position() const { return {x, y}; }
  friend bool operator==(const Pose2&, const Pose2&) = default;
};

/// Velocity of base_link in `map`: m/s, and yaw rate in rad/s.
struct Velocity2 {
  double x = 0.0;
  double y = 0.0;
  double yaw_rate = 0.0;
  friend bool operator==(const Velocity2&, const Velocity2&) = default;
};

/// Covariance of (x, y, yaw): m^2, m rad, rad^2.
using Covariance3 = Eigen::Matrix3d;

/// occluded: not observed, and depth shows something higher where the robot is expected; its filter may carry
/// on (predicting) or have given up (lost).
enum class TrackState : std::uint8_t { searching, calibrating, tracking, predicting, occluded, lost };
enum class PoseKind : std::uint8_t { measured, filtered, smoothed, predicted };

/// What produced a pose: `orb` matched features, `align` aligned picture (of the `orb` detector),
/// `homography` the paper's pipeline, `prediction` no observation at that instant.
enum class PoseSource : std::uint8_t { orb, align, homography, apriltag, depth, prediction };

std::string_view to_string(TrackState state);
std::string_view to_string(PoseKind kind);
std::string_view to_string(PoseSource source);
std::optional<PoseKind> pose_kind_from_string(std::string_view text);

/// One image of one camera with the time of its exposure.
struct Frame {
  std::size_t camera = 0;      ///< index into the cameras that the tracker was given
  std::uint64_t sequence = 0;  ///< counts up by one per frame of this camera; a gap tells of dropped frames
  Time captured{};             ///< midpoint of the exposure
  cv::Mat image;               ///< CV_8UC1 (grey) or CV_8UC3 (BGR)
  cv::Mat
      depth;  ///< empty, or CV_16UC1 of the image's size: millimetres along the optical axis, 0 = no reading
};

/// Cameras by their index as bits: bit i is camera i, 0 to 63.
using CameraSet = std::uint64_t;
inline constexpr CameraSet camera_bit(std::size_t camera) {
  return CameraSet{1} << camera;
}

/// A detection carried to the floor.
struct Observation {
  Time captured{};
  Pose2 pose{};
  Covariance3 covariance = Covariance3::Identity();  ///< of what differs from frame to frame
  /// Of what is the same in every frame near this place: the camera's calibration. Never averaged away.
  Covariance3 correlated = Covariance3::Zero();
  PoseSource source = PoseSource::orb;
  std::size_t camera = 0;
  /// 0 to 1, how well the picture agrees with what was seen; its meaning stands with each detector.
  double score = 0.0;
  /// The picture looks the same turned by 2 pi / heading_turns: 1 (heading is known), 2 or 4.
  int heading_turns = 1;
};

/// What a robot says of its own motion: wheel odometry, or the velocity it was commanded to have.
struct BodyVelocity {
  Time at{};
  double forward = 0.0;   ///< m/s
  double sideways = 0.0;  ///< m/s, to the left
  double yaw_rate = 0.0;  ///< rad/s
  /// Of (forward, sideways, yaw rate). Scale errors and readings that err together are allowed for beyond it.
  Covariance3 covariance = Eigen::Vector3d(4e-4, 4e-4, 2.5e-3).asDiagonal();
};

/// A filter's answer for one instant.
struct Estimate {
  Time at{};
  Pose2 pose{};
  Covariance3 covariance = Covariance3::Identity();
  Velocity2 velocity{};
  CameraSet cameras = 0;  ///< whose observations made up the place
};

/// One line of a robot's history: everything that is known of it at one instant.
struct HistoryEntry {
  Time captured{};
  TrackState state = TrackState::searching;
  std::optional<Observation> measured{};  ///< none where nothing was detected
  std::optional<Estimate> filtered{};     ///< none while searching, calibrating or lost
};

}  // namespace skylight
