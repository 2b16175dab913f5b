// Where cameras hang, from points at known places that they see: clicked points, tags, boards.
//
// Least squares on the reprojection error over all cameras together (bundle adjustment; Triggs et al.,
// "Bundle adjustment - a modern synthesis" (2000)): the cameras' poses, their intrinsics as far as their
// calibration leaves them open, and the places of sheets that nobody measured. Covariance as in
// intrinsics.hpp; what is known beforehand (intrinsics, places of sheets) enters with its own and comes out
// with what the points added.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "service/calibration/intrinsics.hpp"
#include "tracker/camera_uncertainty.hpp"

namespace skylight::calibration {

/// On the floor, in `map`: the origin of a sheet's frame, and the way from map x to its own x axis.
struct FloorPlace {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
};

/// Points that are rigid together: a sheet of tags, a board, or all that was measured in `map` itself (at 0,
/// 0, 0).
struct Sheet {
  std::string name;
  std::optional<FloorPlace> place{};  ///< absent: unknown, found out if two cameras see it or one sees others
  double sigma_m = 0.0;               ///< of the place per axis, 0 to 1; 0: exact
  double sigma_rad = 0.0;             ///< of its yaw, 0 to 1
};

/// A point of a sheet as one camera sees it.
struct SeenPoint {
  std::string name;             ///< for people
  std::size_t sheet = 0;        ///< index into ExtrinsicsInput::sheets
  Eigen::Vector3d at{0, 0, 0};  ///< in the sheet's frame, m; z above the floor
  Pixel pixel{0, 0};
  double sigma_px = 1.0;  ///< of each coordinate, above 0; found anew from the residuals where these are many
  double sigma_m = 0.0;   ///< of the place, per axis of the floor, 0 to 1
  int group = -1;         ///< points of one tag or board have one number; -1: stands alone
};

/// A camera and what it sees.
struct SeeingCamera {
  std::string name;
  Intrinsics intrinsics;
  /// How well they are known. Zero: exactly. Refined together with the pose, as far as this leaves them open.
  IntrinsicsCovariance covariance = IntrinsicsCovariance::Zero();
  /// Only size and lens of `intrinsics` count: the rest is found from the points, of which there must be
  /// many, over the whole picture.
  bool unknown_intrinsics = false;
  /// Of the lens above the floor, m, where it was measured. Points of one height seen from straight above
  /// tell it apart from the focal length badly or not at all.
  std::optional<double> height_m{};
  double height_sigma_m = 0.01;  ///< above 0
  std::vector<SeenPoint> points;
};

struct ExtrinsicsInput {
  std::vector<Sheet> sheets;
  std::vector<SeeingCamera> cameras;
};

struct PointResult {
  std::string name;
  bool used = true;
  std::string why_not;                ///< of a point that was left out
  Eigen::Vector2d residual_px{0, 0};  ///< where the camera sees it less where it should be seen; NaN: nowhere
  /// The same on the plane of the point, m: where the camera says it lies less its place; NaN: nowhere.
  Eigen::Vector2d residual_m{0, 0};
};

struct CameraResult {
  std::string name;
  Intrinsics intrinsics;
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  CameraUncertainty uncertainty;
  double rms_px = 0.0;  ///< of the points used, distance
  double rms_m = 0.0;   ///< the same on the floor
  std::vector<PointResult> points;
  /// Standard deviation of a place on the floor, over both axes together, that this calibration leaves: where
  /// it is least in the picture, and where it is most. NaN where the camera sees no floor.
  double best_floor_sigma_m = 0.0;
  double worst_floor_sigma_m = 0.0;
};

struct ExtrinsicsResult {
  std::vector<CameraResult> cameras;
  std::vector<FloorPlace> sheets;
  std::vector<std::string> warnings;
};

/// Throws std::invalid_argument naming camera or point: fewer than four points, all in one line, pixels
/// outside the picture, mirrored places (x and y exchanged, or one with the wrong sign), tags or boards of
/// another size than stated, a camera that shares no sheet with the others, points that fit no pose. Single
/// points and tags that contradict the others are left out and named.
ExtrinsicsResult calibrate_extrinsics(const ExtrinsicsInput& input);

}  // namespace skylight::calibration
