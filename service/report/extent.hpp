// What of a plot's data can be drawn, and how far it reaches.
#pragma once

#include <cstddef>

#include "service/report/axis.hpp"
#include "service/report/document.hpp"

namespace skylight::service::report {

struct Reach {
  double low = 0.0, high = 0.0;
  bool any = false;
  void take(double value);
};

struct Extent {
  Reach x, y;                  ///< of what can be drawn, with the markers
  std::size_t shown = 0;       ///< points, or pairs of a band, that can be drawn
  std::size_t missing = 0;     ///< with NaN: gaps
  std::size_t impossible = 0;  ///< infinite, or not above zero on a log axis
};

/// Whether point i can be drawn; of a band, whether its pair can.
bool can_show(const Plot& plot, const Series& series, std::size_t i);
/// Whether there is a low and a high at i. On a log axis low may be 0 or less: then it reaches to the bottom.
bool has_spread(const Plot& plot, const Series& series, std::size_t i);
Extent extent_of(const Plot& plot);

}  // namespace skylight::service::report
