// One axis of a plot: its ends, and ticks at round numbers.
#pragma once

#include <string>
#include <vector>

#include "service/report/document.hpp"

namespace skylight::service::report {

/// Whether a value can stand on an axis. Beyond 1e100 sums overflow, so that counts as infinite.
bool drawable(double value, bool log);

struct Axis {
  double low = 0.0;
  double high = 1.0;  ///< above low
  bool log = false;
  std::vector<double> ticks;        ///< rising, within [low, high]
  std::vector<std::string> labels;  ///< one for each tick
  double step = 0.0;                ///< between ticks; 0 on a log axis and where names stand

  /// 0 at low, 1 at high, beyond them outside; `value` must be drawable.
  double share(double value) const;
};

struct AxisWish {
  double low = 0.0;  ///< the data's smallest and largest; drawable, low <= high
  double high = 0.0;
  Range fixed;  ///< taken as they are
  bool log = false;
  int ticks = 6;  ///< about as many as this, where round ends do not leave much empty
};

/// From 3 to 10 ticks, at multiples of 1, 2 or 5 times a power of ten; on a log axis at 1-2-5 or at powers of
/// ten. Ends that are not fixed lie on ticks; fixed ones are less than a step away from one. Without a spread
/// in the data the axis reaches a tenth to both sides (1 around zero).
Axis make_axis(const AxisWish& wish);

/// For a map: both with the same step, unless fixed ends leave one of them fewer than 3 ticks then. Ends that
/// are not fixed lie a little outside of the data, not on ticks; the shorter side is at least a quarter of
/// the longer one.
struct AxisPair {
  Axis x, y;
};
AxisPair make_equal_axes(const AxisWish& x, const AxisWish& y);

/// Ticks at 0, 1, 2 ... with the names.
Axis named_axis(const std::vector<std::string>& names);

}  // namespace skylight::service::report
