// Where everything of a plot stands in its picture, before anything is drawn.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "service/report/axis.hpp"
#include "service/report/document.hpp"
#include "service/report/thin.hpp"

namespace skylight::service::report {

inline constexpr double kTickFontPx = 12.0;
inline constexpr double kLabelFontPx = 13.0;
inline constexpr double kTitleFontPx = 15.0;
inline constexpr double kLinePx = 17.0;  ///< from one line of text to the next

struct Canvas {
  double width_px = 820.0;
  bool standalone = true;  ///< with title and style, for a file of its own
  std::string id_suffix;   ///< keeps ids apart where one plot is in the page twice
};

struct LegendItem {
  std::size_t series = 0;
  std::vector<std::string> lines;
  double x = 0.0;  ///< left end of the sample
  double y = 0.0;  ///< middle of the first line
};

/// Pixels, y down, origin at the upper left.
struct Frame {
  double width = 0.0, height = 0.0;
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;  ///< the data's area
  Axis x, y;
  bool slanted = false;  ///< names below the axis that do not fit side by side
  double x_label_y = 0.0;
  std::vector<std::string> title, x_label, y_label;
  std::vector<LegendItem> legend;
  std::vector<std::string> notes;  ///< what is not shown
  bool empty = false;              ///< there is nothing to draw

  Point at(Point data) const;
  bool holds(Point px) const;
};

/// Of a plot that check() accepts.
Frame make_frame(const Plot& plot, const Canvas& canvas);

/// Of the piece of line, dot or box before a name in the legend.
double sample_width_px(const Series& series);

/// Half of the smallest distance between the bars of all series, in pixels.
double half_bar_gap_px(const Plot& plot, const Frame& frame);

}  // namespace skylight::service::report
