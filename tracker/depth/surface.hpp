// A robot's surface as depth sees it: is it there, is it covered, how high is it.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "tracker/appearance.hpp"
#include "tracker/depth/floor_depth.hpp"

namespace skylight {

/// The surface that is looked for, in base_link.
struct Surface {
  std::vector<Eigen::Vector2d> places_m;  ///< spread evenly over it
  double height_m = 0.0;                  ///< above the floor
};

/// The places of a picture that belong to it (its mask), a little inside its edge.
Surface surface_of(const Appearance& appearance, double height_m);
/// A rectangle of this size about a place of base_link, its sides along the axes.
Surface surface_of(const Eigen::Vector2d& size_m, const Eigen::Vector2d& centre_m, double height_m);

/// What depth shows where a surface would be. Shares are of the cells with a reading.
struct SurfaceLook {
  int cells = 0;        ///< different ones that the surface would fill, in the picture
  int readings = 0;     ///< of them with a reading
  double higher = 0.0;  ///< above the surface by more than `within_m`
  double level = 0.0;   ///< within `within_m` of it
  double lower = 0.0;
  double within_m = 0.0;  ///< the tolerance, or the sigmas of a cell where those are more
  double height_m = 0.0;  ///< mean of what lies near the median; 0 without readings
  double sigma_m = 0.0;   ///< of that: noise, and what lasts
};

/// `pose`: of base_link, where the surface is looked for.
SurfaceLook look_at(const FloorDepth& floor, const cv::Mat& depth, const Surface& surface, const Pose2& pose);

/// Enough readings to say anything: at least a third of at least four cells.
bool tells(const SurfaceLook& look);
/// Something clearly higher hides so much of it that it counts as covered.
bool covered(const SurfaceLook& look, const DepthConfig& config);
/// The floor, or something else clearly lower than the surface, is seen in nearly all of its place.
bool empty(const SurfaceLook& look);
/// What is seen there is not at the surface's height.
bool at_wrong_height(const SurfaceLook& look, double surface_height_m, const DepthConfig& config);

/// A surface's height from many looks at it: the noise is averaged away, what lasts stays.
class SurfaceHeight {
 public:
  /// Of a robot that is seen where it was looked for.
  void add(const SurfaceLook& look, double uneven_m);
  int looks() const { return looks_; }
  double height_m() const { return mean_; }
  double sigma_m() const;  ///< infinite without looks

 private:
  int looks_ = 0;
  double mean_ = 0.0;
  double information_ = 0.0;  ///< of the noise, 1/m^2
  double uneven_m_ = 0.0;
};

}  // namespace skylight
