// How a plot's series look, and their lines, dots, bands and bars as SVG.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "service/report/document.hpp"
#include "service/report/frame.hpp"
#include "service/report/style.hpp"

namespace skylight::service::report {

struct Look {
  Ink ink;
  std::string_view dash;  ///< stroke-dasharray; "" for an unbroken line
  int shape = 0;          ///< of its dots
  int bars = 0;           ///< which of the bar series this is
  double dot_px = 6.0;    ///< smaller where there are many
};

/// One for each series: no two have both the same colour and the same dashes or dots, as far as these go.
std::vector<Look> looks_of(const Plot& plot);

/// Opens a group in a series' colour; close with "</g>\n".
std::string open_group(const Look& look);
/// Dots around these points.
std::string dots_path(const std::vector<Point>& points, const Look& look);
/// The small picture of a series in the legend; `at` is its left middle.
std::string legend_sample(const Series& series, const Look& look, Point at);

/// What lies behind the lines: bands.
std::string draw_area(const Plot& plot, const Series& series, const Look& look, const Frame& frame);
/// Lines, dots, whiskers, bars. Adds to `drawn` where they stand, for labels that keep clear of them.
std::string draw_marks(const Plot& plot, const Series& series, const Look& look, const Frame& frame,
                       std::vector<Point>& drawn);

}  // namespace skylight::service::report
