// Heights above the floor from a camera's depth, which the floor itself corrects.
//
// The calibrated pose says which depth z_floor each pixel would read of the floor z = 0, so what it reads
// instead tells a height: h = c (1 - z / z_floor), c the camera's height above the floor. Depth sensors err
// by an amount that lasts (an offset or scale of the disparity, a lens of their own), as large as a robot is
// high. It is learnt from the floor: 1 / z_read = 1 / z_floor + p(column, row) with a polynomial p of second
// degree, by least squares with Tukey's weights, for robots and people stand on the floor and are no part of
// it. Whether p comes from the sensor or from a camera that is tilted otherwise than calibrated cannot be
// told from one sensor: it is reported (FloorFit), and heights are above the floor that is seen.
//
// Only distances near the floor's are corrected rightly: an offset of z, other than of 1 / z, leaves
// 2 h / z_floor of itself at the height h.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "tracker/camera.hpp"

namespace skylight {

struct DepthConfig {
  bool use = true;             ///< false: depth is not looked at
  int cell_px = 4;             ///< side of the squares in which depth is read, four readings each, 2 to 32
  int learn_frames = 5;        ///< with depth, until heights are believed, 1 to 1000
  int follow_frames = 300;     ///< over which the correction then follows, learn_frames to 100000
  int follow_interval = 10;    ///< frames between looks at the floor once it is learnt, 1 to 1000
  double tolerance_m = 0.025;  ///< by which a surface may be off its height whatever the noise, 0.001 to 1
  double sigmas = 3.0;         ///< and in standard deviations, 1 to 10
  double covered_share = 0.3;  ///< of a robot's surface that is hidden by higher things: covered, 0.05 to 1
  /// The baseline detector reads the corrected depth; false: the sensor's own, as the paper's pipeline does.
  bool correct_homography = false;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const DepthConfig& config);

/// How the floor that depth sees lies to the calibrated one.
struct FloorFit {
  bool known = false;     ///< learnt; false: too few frames yet, or too little floor is seen
  int frames = 0;         ///< that were learnt from
  double share = 0.0;     ///< of the floor's pixels that read the floor
  double offset_m = 0.0;  ///< height at which it is seen in the middle of what is seen; up is positive
  double tilt_rad = 0.0;  ///< of the plane that fits it best
  double bend_m = 0.0;    ///< root mean square by which it is no plane, as learnt
  double noise_m = 0.0;   ///< standard deviation of the height of one cell (four readings) of the floor
  double uneven_m = 0.0;  ///< and of what lasts: by which parts of the floor stay off after the correction
};

/// Of one camera. Cheap to look at, 4 bytes for each cell to keep.
class FloorDepth {
 public:
  /// Throws std::invalid_argument with check()'s message.
  FloorDepth(const CameraModel& camera, const DepthConfig& config);

  /// Looks at a frame's depth (CV_16UC1, of the camera's size), if it is its turn.
  void learn(const cv::Mat& depth);
  const FloorFit& fit() const { return fit_; }
  const CameraModel& camera() const { return camera_; }
  const DepthConfig& config() const { return config_; }

  /// Cells across and down.
  cv::Size cells() const { return cells_; }
  /// Height above the floor of what a cell shows, metres; NaN where less than two of its four readings are
  /// there, or no floor could be.
  float height(const cv::Mat& depth, int column, int row) const;
  /// Of the cell around a pixel; NaN outside the picture too.
  float height(const cv::Mat& depth, const Pixel& pixel) const;
  /// Standard deviation of a cell's height near `height_m`; grows with the square of the distance (Nguyen,
  /// Izadi and Lovell, 3DIMPVT 2012), its size measured on the floor.
  double sigma_m(double height_m) const;
  /// A reading as it would be without the lasting error, metres along the optical axis.
  double corrected(const Pixel& pixel, double z_m) const;

 private:
  static constexpr int kTerms = 6;
  using Terms = Eigen::Matrix<double, kTerms, 1>;

  struct Sample {
    Terms terms;
    double rest;  ///< 1 / z_read - 1 / z_floor, 1/m
    int block;
  };

  Terms terms(double column_px, double row_px) const;
  double correction(double column_px, double row_px) const;
  float cell_depth(const cv::Mat& depth, int column, int row) const;
  std::vector<Sample> samples(const cv::Mat& depth) const;
  void begin(const std::vector<Sample>& samples);
  void weigh(const std::vector<Sample>& samples, double keep);
  void spread(const std::vector<Sample>& samples);
  void report(std::size_t inliers, std::size_t samples);

  CameraModel camera_;
  DepthConfig config_;
  cv::Size cells_;
  std::vector<float> inverse_floor_;  ///< 1 / z_floor by cell, 1/m; 0: no floor there
  double camera_height_m_ = 0.0;
  double floor_m_ = 1.0;  ///< distance of the floor along the axis in the picture's middle, or nearest to it
  Terms correction_ = Terms::Zero();  ///< 1/m, by the terms
  Eigen::Matrix<double, kTerms, kTerms> normal_ = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Terms right_ = Terms::Zero();
  double noise_ = 0.0;  ///< standard deviation of a cell's 1 / z on the floor, 1/m
  double uneven_variance_ = 0.0;
  std::uint64_t seen_ = 0;
  FloorFit fit_;
};

}  // namespace skylight
