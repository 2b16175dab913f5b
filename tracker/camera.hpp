// The camera: pixels to rays to the floor and back. Formulas: Brown 1971 as in OpenCV's calib3d
// documentation, Kannala and Brandt 2006 (four coefficients, as in OpenCV's fisheye module).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tracker/types.hpp"

namespace skylight {

enum class LensModel : std::uint8_t { brown_conrady, kannala_brandt };

/// Intrinsics in pixels. The centre of the top-left pixel is (0, 0).
struct Intrinsics {
  static constexpr int kLargestSide = 65'535;  ///< px

  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  LensModel lens = LensModel::brown_conrady;
  /// brown_conrady: k1 k2 p1 p2 k3; kannala_brandt: k1 k2 k3 k4 (the fifth unused, 0).
  std::array<double, 5> distortion{};
};

/// A message for people where the intrinsics make no camera (size, focal length, a centre outside the
/// picture, NaN), naming the field, its value and the allowed range; empty where they do.
std::string check(const Intrinsics& intrinsics);

/// A fixed camera. Optical frame: z forward, x right, y down. A value: copies are cheap.
class CameraModel {
 public:
  using PixelByPoint = Eigen::Matrix<double, 2, 3>;  ///< d(pixel)/d(point), px per metre
  using RayByPixel = Eigen::Matrix<double, 3, 2>;    ///< d(unit ray)/d(pixel), per px

  /// Throws std::invalid_argument with check()'s message, or where map_from_camera is no rigid motion.
  CameraModel(const Intrinsics& intrinsics, const Eigen::Isometry3d& map_from_camera);

  const Intrinsics& intrinsics() const { return intrinsics_; }
  const Eigen::Isometry3d& map_from_camera() const { return map_from_camera_; }

  /// A point in the optical frame to its pixel (which may lie outside the picture). None where the model
  /// does not hold: behind a pinhole camera, or further out than the radius at which the distortion
  /// folds back, where two directions would share one pixel.
  std::optional<Pixel> pixel_from_camera(const Eigen::Vector3d& point,
                                         PixelByPoint* jacobian = nullptr) const;

  /// The unit ray in the optical frame through a pixel: inverse of pixel_from_camera to 1e-9. None where
  /// no direction within the model's range has this pixel.
  std::optional<Eigen::Vector3d> ray_from_pixel(const Pixel& pixel, RayByPixel* jacobian = nullptr) const;

  /// The same from a point in `map`, jacobian by the map coordinates.
  std::optional<Pixel> pixel_from_map(const Eigen::Vector3d& point, PixelByPoint* jacobian = nullptr) const;

  /// Where the ray through a pixel meets the plane z = height_m of `map`; x, y in metres, jacobian in
  /// metres per pixel. None where the ray runs parallel to the plane or away from it.
  std::optional<Eigen::Vector2d> plane_from_pixel(const Pixel& pixel, double height_m,
                                                  Eigen::Matrix2d* jacobian = nullptr) const;

  /// True where the pixel lies in the picture, `margin_px` away from its edge (negative: outside by as much).
  bool sees(const Pixel& pixel, double margin_px = 0.0) const;

 private:
  /// A direction in the lens's own plane: tangents x/z, y/z (brown_conrady) or, for the angles of a
  /// fisheye, ideal(theta) * direction. `distorted` is the pixel less the centre, over the focal lengths.
  struct Distorted;

  Distorted distort_brown_conrady(const Eigen::Vector2d& tangent) const;
  std::optional<Eigen::Vector2d> undistort_brown_conrady(const Eigen::Vector2d& distorted) const;
  std::optional<Pixel> brown_conrady_pixel(const Eigen::Vector3d& point, PixelByPoint* jacobian) const;
  std::optional<Pixel> kannala_brandt_pixel(const Eigen::Vector3d& point, PixelByPoint* jacobian) const;
  std::optional<Eigen::Vector3d> brown_conrady_ray(const Eigen::Vector2d& distorted,
                                                   RayByPixel* jacobian) const;
  std::optional<Eigen::Vector3d> kannala_brandt_ray(const Eigen::Vector2d& distorted,
                                                    RayByPixel* jacobian) const;

  Intrinsics intrinsics_;
  Eigen::Isometry3d map_from_camera_;
  Eigen::Isometry3d camera_from_map_;
  /// The model's range, not itself part of it: tangent of the angle from the optical axis
  /// (brown_conrady) or the angle in radians (kannala_brandt).
  double max_radius_ = 0.0;
};

}  // namespace skylight
