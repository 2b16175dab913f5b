// How well a camera is known, and what that leaves unknown of a place on the floor.
//
// A calibration's error is the same in every frame: it moves all that a camera tells of one place by the same
// amount, so that no number of frames averages it away. First order throughout: an error d of the camera's
// parameters moves the floor point behind a fixed pixel by J d, covariance J Sigma J^T.
//
// The pixel stays, the parameters move. An error of the intrinsics by which a fixed point would move by e
// pixels moves the point behind a fixed pixel as -e pixels would, through the inverse of the camera's
// Jacobian on the plane. With v the way from the camera to the point, both in `map`, a motion w of the ray's
// end is brought back to the plane along the ray: w_xy - v_xy w_z / v_z; w is the translation of the camera,
// and rotation x v for its rotation.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "tracker/camera.hpp"

namespace skylight {

/// What a calibration finds out, in this order.
inline constexpr int kFocalX = 0;          ///< px
inline constexpr int kFocalY = 1;          ///< px
inline constexpr int kCentreX = 2;         ///< px
inline constexpr int kCentreY = 3;         ///< px
inline constexpr int kDistortion = 4;      ///< five coefficients in the order of Intrinsics::distortion
inline constexpr int kCameraPosition = 9;  ///< three: motion of the camera's centre in `map`, m
/// Three: rotation vector about the camera's own centre, along the axes of `map`, rad: map_from_camera's
/// rotation becomes Exp(rotation) * rotation.
inline constexpr int kCameraRotation = 12;
inline constexpr int kCameraParameters = 15;

using CameraParameters = Eigen::Matrix<double, kCameraParameters, 1>;
/// d(pixel of a fixed point of the optical frame) / d(intrinsics): the first nine parameters.
using PixelByIntrinsics = Eigen::Matrix<double, 2, kCameraPosition>;
/// d(x, y of the point on a plane behind a fixed pixel) / d(parameters).
using PointByCamera = Eigen::Matrix<double, 2, kCameraParameters>;
/// d(x, y, yaw of a small picture on a plane behind fixed pixels) / d(parameters).
using PoseByCamera = Eigen::Matrix<double, 3, kCameraParameters>;

/// Covariance of the errors of a camera's parameters; zero: the camera is known exactly.
struct CameraUncertainty {
  Eigen::Matrix<double, kCameraParameters, kCameraParameters> covariance =
      Eigen::Matrix<double, kCameraParameters, kCameraParameters>::Zero();
};

/// Standard deviations of a calibration, taken for independent of each other. 0: known exactly.
struct CalibrationSigmas {
  double focal_px = 0.0;               ///< of each focal length, 0 to 1e5
  double centre_px = 0.0;              ///< of each coordinate of the centre, 0 to 1e5
  std::array<double, 5> distortion{};  ///< of each coefficient, 0 to 1e3
  double position_m = 0.0;             ///< of the camera's centre per axis of `map`, 0 to 100
  double rotation_rad = 0.0;           ///< of the camera's rotation per axis of `map`, 0 to 1
  friend bool operator==(const CalibrationSigmas&, const CalibrationSigmas&) = default;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const CalibrationSigmas& sigmas);
/// Empty, or what is wrong: not finite, not symmetric, or a negative variance in some direction.
std::string check(const CameraUncertainty& uncertainty);

/// Throws std::invalid_argument with check()'s message.
CameraUncertainty camera_uncertainty(const CalibrationSigmas& sigmas);

/// The camera with its parameters moved by `by`. Throws std::invalid_argument where that is no camera.
CameraModel moved(const CameraModel& camera, const CameraParameters& by);

/// `pixel` is where the camera sees `point` (optical frame, m).
PixelByIntrinsics pixel_by_intrinsics(const Intrinsics& intrinsics, const Pixel& pixel,
                                      const Eigen::Vector3d& point);

/// At the point (at, height_m) of `map`. None where the camera's model does not hold there, or where it looks
/// along the plane.
std::optional<PointByCamera> point_by_camera(const CameraModel& camera, const Eigen::Vector2d& at,
                                             double height_m);

/// The same with the yaw: how far a small square picture there seems turned, fitted by least squares over
/// all of it as detectors do (half the curl of the points' motion), whichever way it faces.
std::optional<PoseByCamera> pose_by_camera(const CameraModel& camera, const Eigen::Vector2d& at,
                                           double height_m);

/// Covariance of (x, y, yaw) that the camera's uncertainty leaves to an observation of a robot whose picture
/// lies at `at`, height_m above the floor; m^2, m rad, rad^2. Rank up to 3, zero for a camera that is known
/// exactly. None as pose_by_camera().
std::optional<Covariance3> floor_covariance(const CameraModel& camera, const CameraUncertainty& uncertainty,
                                            const Eigen::Vector2d& at, double height_m);

}  // namespace skylight
