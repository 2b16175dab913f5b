// How values are spread: the series of a distribution's curve and of a histogram.
#pragma once

#include <string>
#include <vector>

#include "service/report/document.hpp"

namespace skylight::service::report {

/// Over each value the share of all values (0 to 1) that are at most as large. Values that are not finite (no
/// pose, say) count among all: the curve then ends below 1. Equal values are one point.
Series cumulative(std::string name, std::vector<double> values);

/// Bars over the middles of bins between neighbouring `edges` (rising, at least 2): the share of all values
/// that lie in a bin, its lower edge included, the last one's upper edge too. Not finite values count among
/// all. With `log_x` the middles are geometric, as a log axis shows them. Throws std::invalid_argument for
/// other edges.
struct HistogramBins {
  std::vector<double> edges;
  bool log_x = false;
};
Series histogram(std::string name, const std::vector<double>& values, const HistogramBins& bins);

}  // namespace skylight::service::report
