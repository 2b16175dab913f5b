// A tag that lies on the floor at a known place.
#pragma once

#include <string>

namespace skylight::service {

struct FloorTag {
  std::string family = "36h11";
  int id = 0;
  double size_m = 0.0;  ///< between the corners that a detector reports, m
  double x_m = 0.0;     ///< of its middle, in `map`
  double y_m = 0.0;
  double yaw_deg = 0.0;  ///< of its x axis (to the right in the upright tag) from map x, counter-clockwise
  double place_sigma_m = 0.002;  ///< standard deviation of the place, per axis
};

}  // namespace skylight::service
