// A picture prepared for alignment: samples in robot axes, blurred as the camera blurs.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "tracker/appearance.hpp"

namespace skylight {

/// How finely a picture is compared with a frame.
struct PatchScale {
  double metres_per_px = 0.0;  ///< of the frame at the robot's place
  double blur_px = 0.0;        ///< Gaussian that the frame is smoothed with before it is compared
  int channels = 1;            ///< 1 (grey) or 3 (BGR)
  int max_samples = 1200;      ///< bounds the work for large robots: more add little where noise is low
};

/// Samples on a grid over the picture; one column per quantity, so that loops over samples vectorise.
struct Patch {
  struct Channel {
    /// Columns: change of the grey level per pixel of movement forward, left and around (a turn that
    /// moves the outermost sample by one pixel); the grey level less its mean; 1.
    Eigen::Matrix<float, Eigen::Dynamic, 5> terms;
    double contrast = 0.0;  ///< standard deviation of the grey level
  };

  PatchScale scale;
  double spacing_m = 0.0;  ///< between samples
  Eigen::ArrayXf x, y;     ///< forward and left of the picture's centre, metres
  std::vector<Channel> channels;
  double radius_m = 0.0;  ///< largest distance of a sample from the centre

  Eigen::Index size() const { return x.size(); }
  double radius_px() const { return radius_m / scale.metres_per_px; }
};

/// The frame's pixel averages over its square, the frame is smoothed by blur_px and then read between
/// pixels by bilinear interpolation; the picture is given the same blur (variances add: side^2/12 for a
/// square, and 1/6 px^2 on average over the sub-pixel phase for bilinear reading), less what its own
/// pixels already brought. Samples that the blur would mix with what lies outside the picture are left out.
Patch make_patch(const Appearance& appearance, const PatchScale& scale);

}  // namespace skylight
