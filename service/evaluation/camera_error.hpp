// Cameras as a calibration would give them, where there is only the truth: wrong by a stated amount, and told
// how wrong such a calibration is.
//
// The errors are those of a usual calibration in two parts. The intrinsics come from a chessboard in a few
// views: how well is our own estimate (below in the .cpp); only its proportions matter, for all is scaled.
// Then intrinsics and pose are fitted together to sixteen points spread over the floor that the camera sees,
// each put down with a tape to 3 mm: the covariance is (J^T J / (3 mm)^2 + prior^-1)^-1. So what the floor
// shows (a shift, a turn, a tilt) is known as well as the tape allows, and what it does not show (a longer
// lens from higher up) is as unknown as the chessboard left it: strongly correlated, and seen only by robots
// that stand above the floor.
#pragma once

#include <cstdint>

#include "service/assembly.hpp"
#include "tracker/camera_uncertainty.hpp"

namespace skylight::service {

struct CalibrationError {
  Eigen::Vector2d room_m{6.0, 6.0};  ///< the floor, origin of `map` in its middle
  double rms_m = 0.0015;             ///< by which the floor's points (z = 0) move, root mean square, 0 to 0.1
  std::uint64_t seed = 1;
};

struct WrongCamera {
  CameraModel model;       ///< as calibrated
  CameraUncertainty told;  ///< of it
};

/// Root mean square of the distances between points of the room's floor and where `other` sees them, the
/// points lying on a grid, those that `truth` sees. Throws std::invalid_argument where it sees none, or where
/// `other` has no such pixel.
double floor_rms(const CameraModel& truth, const CameraModel& other, const Eigen::Vector2d& room_m);

/// Drawn from the covariance above, then scaled so that floor_rms() is `rms_m` to rounding; told is the
/// covariance scaled so that rms_m is what it expects. The same seed gives the same camera everywhere.
/// Throws std::invalid_argument for a value out of range, and as floor_rms().
WrongCamera wrong_camera(const CameraModel& truth, const CalibrationError& error);

/// Each camera of the assembly gives way to a wrong one, drawn with seeds of their own, and the tracker is
/// told of it: before make_tracker(). Throws as wrong_camera().
void use_wrong_cameras(Assembly& assembly, const CalibrationError& error);

}  // namespace skylight::service
