// Actors drawn into a picture that stands, row by row: first their shadows on the floor, then their bodies
// over it, sixteen rays a pixel spread over its area and the row's exposure.
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include "sim/render/placed.hpp"
#include "sim/render/standing.hpp"

namespace skylight::sim {

/// A soft-edged band of shadow on the floor.
struct PassingShadow {
  double darkness = 0.5;       ///< share of the light missing in its middle
  double width_m = 1.5;        ///< from edge to edge; in between it falls as a cosine
  double direction_rad = 0.0;  ///< across the band, in `map`
  double centre_m = 0.0;       ///< of its middle line, along the direction from the origin of `map`
};

/// Pixels that differ from the standing picture, and the actor for whom they do.
struct Change {
  static constexpr std::size_t kNobody = static_cast<std::size_t>(-1);
  Span span;
  std::size_t actor = kNobody;
};

/// What there is to draw, and where to.
struct Scene {
  View view;
  const RayField* rays = nullptr;
  Eigen::Vector3d axis{0.0, 0.0, -1.0};  ///< of the camera, in `map`
  double contact_shadow = 0.0;
  std::vector<const Placed*> moving;  ///< what is drawn
  std::vector<const Placed*> fixed;   ///< what is in the standing picture already, and may be in front
  const std::vector<PassingShadow>* passing = nullptr;
  const StandingPicture* standing = nullptr;
  cv::Mat* mean = nullptr;    ///< the standing picture but for `changed`
  cv::Mat* metres = nullptr;  ///< none: not wanted
  /// Of each row, what differs from the standing picture: put back before, collected while drawing.
  std::vector<std::vector<Change>>* changed = nullptr;
  /// By actor: not drawn and not put back, what the last frame has of it is right. None: all are drawn.
  const std::vector<bool>* kept = nullptr;
  /// Drawing what stands: takes the floor and the lamps' shares away where it is covered. Else none.
  StandingPicture* into = nullptr;
};

/// Draws rows begin to end - 1. Rows do not depend on each other.
void paint_rows(const Scene& scene, int begin, int end);

}  // namespace skylight::sim
