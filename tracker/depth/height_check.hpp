// Whether what looks like a robot stands at the robot's height: told from as many looks as that takes.
//
// One look at a small robot far away does not tell heights apart that differ by little more than the
// tolerance: a look-alike that stands 3 cm higher passes a tolerance of 2.5 cm in every twentieth frame. So
// the mean of several is judged, and until it is clear the robot is not said to be there. It is clear where
// the mean, give or take the sigmas of its noise, lies within the limit: the tolerance, or the sigmas of what
// lasts (FloorFit::uneven_m) where those are more. After kMostLooks the mean alone decides.
#pragma once

#include "tracker/depth/surface.hpp"

namespace skylight {

class HeightCheck {
 public:
  static constexpr int kMostLooks = 15;
  enum class Answer { open, right, wrong };

  /// Another look at the same thing, which tells() something. `surface_height_m`: the robot's. Once it is
  /// right a look that is wrong by itself is that look's alone; before, it begins anew.
  Answer add(const SurfaceLook& look, double surface_height_m, const FloorDepth& floor);
  /// It was found to be right.
  bool passed() const { return passed_; }
  /// There were looks, and it is not clear yet.
  bool open() const { return looks_ > 0 && !passed_; }

 private:
  int looks_ = 0;
  double off_m_ = 0.0;           ///< mean of what is seen, less the robot's height
  double noise_variance_ = 0.0;  ///< of one look, mean, m^2
  bool passed_ = false;
};

}  // namespace skylight
