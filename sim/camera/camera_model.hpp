// The simulator's own projection: written apart from the tracker's, so that an error in one cannot hide in
// the other. Formulas: Brown, "Close-Range Camera Calibration", Photogrammetric Engineering 37 (1971), in the
// form k1 k2 p1 p2 k3; Kannala and Brandt, "A generic camera model ...", PAMI 28 (2006), eq. 6, with r =
// theta (1 + k1 theta^2 + ... + k4 theta^8).
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sim/scenario/camera.hpp"

namespace skylight::sim {

/// Optical frame: z away, x right, y down. The centre of the top-left pixel is (0, 0).
struct CameraParameters {
  int width_px = 0;
  int height_px = 0;
  Lens lens = Lens::brown_conrady;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3, or k1 k2 k3 k4 and 0
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
};

class CameraModel {
 public:
  explicit CameraModel(const CameraParameters& parameters);

  const CameraParameters& parameters() const { return parameters_; }
  const Eigen::Isometry3d& map_from_camera() const { return parameters_.map_from_camera; }

  /// Pixel of a point given in the optical frame, metres. None where it is not in front of the camera
  /// (brown_conrady) or where the lens folds back, so that two directions would share a pixel.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& in_camera) const;

  /// Direction (optical frame, z = 1 for brown_conrady, unit length for kannala_brandt) seen at a pixel;
  /// inverse of project() to 1e-10. None where no direction within the lens's range is seen there.
  std::optional<Eigen::Vector3d> direction(const Eigen::Vector2d& pixel) const;

  /// Pixel of a point in `map`.
  std::optional<Eigen::Vector2d> project_map(const Eigen::Vector3d& in_map) const;

  /// Within the picture, whose edge lies half a pixel around the outermost pixel centres.
  bool contains(const Eigen::Vector2d& pixel) const;

  /// The largest undistorted radius (tangent, or angle in radians) up to which the lens is one to one.
  double range() const { return range_; }

 private:
  CameraParameters parameters_;
  Eigen::Isometry3d camera_from_map_;
  double range_;
};

/// The camera's own projection, and where it hangs. Columns of the rotation: image right, image down, away.
CameraModel camera_model(const CameraSpec& camera);
Eigen::Isometry3d map_from_camera(const CameraSpec& camera);

}  // namespace skylight::sim
