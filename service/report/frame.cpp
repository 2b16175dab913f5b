#include "service/report/frame.hpp"

#include <algorithm>
#include <cmath>

#include "service/report/extent.hpp"
#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

constexpr double kPadPx = 10.0;        // around everything
constexpr double kTickLengthPx = 8.0;  // from the area to its tick labels
constexpr double kMapHeightPx = 470.0;

double widest(const std::vector<std::string>& lines, double font_px) {
  double width = 0.0;
  for (const std::string& line : lines) width = std::max(width, text_width_px(line, font_px));
  return width;
}

double area_height(double width_px) {
  return std::round(130.0 + 0.25 * width_px);
}

int wished_ticks(double length_px, double apart_px) {
  return std::clamp(static_cast<int>(length_px / apart_px), 4, 8);
}

AxisWish wish_of(const Reach& reach, const Range& fixed, bool log, int ticks) {
  if (reach.any) return {.low = reach.low, .high = reach.high, .fixed = fixed, .log = log, .ticks = ticks};
  return {.low = log ? 1.0 : 0.0, .high = log ? 10.0 : 1.0, .fixed = fixed, .log = log, .ticks = ticks};
}

void choose_axes(Frame& frame, const Plot& plot, const Extent& extent) {
  const AxisWish x = wish_of(extent.x, plot.x_range, plot.log_x, wished_ticks(frame.width - 70.0, 80.0));
  const AxisWish y =
      wish_of(extent.y, plot.y_range, plot.log_y, wished_ticks(area_height(frame.width), 45.0));
  if (plot.equal_axes) {
    const AxisPair pair = make_equal_axes(x, y);
    frame.x = pair.x;
    frame.y = pair.y;
    return;
  }
  frame.x = plot.x_names.empty() ? make_axis(x) : named_axis(plot.x_names);
  frame.y = make_axis(y);
}

// Samples and names in rows, as many side by side as fit; nothing for series without a name.
std::vector<LegendItem> flow_legend(const Plot& plot, double width) {
  std::vector<LegendItem> items;
  double x = 0.0;
  double y = kLinePx / 2.0;
  double row_height = 0.0;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    if (plot.series[i].name.empty()) continue;
    const double text_left = sample_width_px(plot.series[i]) + 6.0;
    LegendItem item{.series = i, .lines = wrap(plot.series[i].name, width - text_left, kLabelFontPx)};
    const double item_width = text_left + widest(item.lines, kLabelFontPx);
    if (x > 0.0 && x + item_width > width) {
      x = 0.0;
      y += row_height;
      row_height = 0.0;
    }
    item.x = x;
    item.y = y;
    x += item_width + 14.0;
    row_height = std::max(row_height, kLinePx * static_cast<double>(item.lines.size()));
    items.push_back(std::move(item));
  }
  return items;
}

double legend_height(const std::vector<LegendItem>& items) {
  double height = 0.0;
  for (const LegendItem& item : items) {
    height = std::max(height, item.y + kLinePx * (static_cast<double>(item.lines.size()) - 0.5));
  }
  return height;
}

double legend_width(const Plot& plot, const std::vector<LegendItem>& items) {
  double width = 0.0;
  for (const LegendItem& item : items)
    width =
        std::max(width, sample_width_px(plot.series[item.series]) + 6.0 + widest(item.lines, kLabelFontPx));
  return width;
}

void place_legend(std::vector<LegendItem>& items, double left, double top) {
  for (LegendItem& item : items) {
    item.x += left;
    item.y += top;
  }
}

// The area between the margins; a map takes of it what its shape allows, in the middle.
void place_area(Frame& frame, const Plot& plot, double left, double right, double top) {
  double width = right - left;
  double height = area_height(frame.width);
  if (plot.equal_axes) {
    const double units_across = frame.x.high - frame.x.low;
    const double units_up = frame.y.high - frame.y.low;
    const double px_per_unit = std::min(width / units_across, std::min(width, kMapHeightPx) / units_up);
    left += (width - units_across * px_per_unit) / 2.0;
    width = units_across * px_per_unit;
    height = units_up * px_per_unit;
  }
  frame.left = left;
  frame.right = left + width;
  frame.top = top;
  frame.bottom = top + height;
}

// A map that is narrower than the picture has its legend at its side, every other plot above the area.
void place_legend_and_area(Frame& frame, const Plot& plot, double left, double right, double top) {
  place_area(frame, plot, left, right, top);
  const double spare = (right - left) - (frame.right - frame.left);
  std::vector<LegendItem> column = flow_legend(plot, std::min(spare - 24.0, 200.0));
  if (plot.equal_axes && spare > 130.0 && legend_width(plot, column) + 24.0 <= spare) {
    double y = kLinePx;
    for (LegendItem& item : column) {
      item.x = 0.0;
      item.y = y;
      y += kLinePx * static_cast<double>(item.lines.size()) + 3.0;
    }
    const double shift = (frame.left - left) - (spare - legend_width(plot, column) - 24.0) / 2.0;
    frame.left -= shift;
    frame.right -= shift;
    place_legend(column, frame.right + 24.0, frame.top);
    frame.legend = std::move(column);
    return;
  }
  // Above a map it begins with the area, unless that leaves too little room.
  const double from = right - frame.left > 160.0 ? frame.left : left;
  frame.legend = flow_legend(plot, right - from);
  if (frame.legend.empty()) return;
  const double height = legend_height(frame.legend);
  place_legend(frame.legend, from, top);
  place_area(frame, plot, left, right, top + height + 8.0);
}

// Below the area: tick labels, the axis' label, notes.
void place_foot(Frame& frame) {
  double y = frame.bottom + kTickLengthPx + kTickFontPx;
  const double apart =
      (frame.right - frame.left) / static_cast<double>(std::max<std::size_t>(1, frame.x.ticks.size()));
  frame.slanted = frame.x.step == 0.0 && !frame.x.log && widest(frame.x.labels, kTickFontPx) + 6.0 > apart;
  if (frame.slanted) y += 0.6 * widest(frame.x.labels, kTickFontPx);
  frame.x_label_y = y + 20.0;
  if (!frame.x_label.empty()) y = frame.x_label_y + kLinePx * static_cast<double>(frame.x_label.size() - 1);
  y += kLinePx * static_cast<double>(frame.notes.size());
  frame.height = std::ceil(y + kPadPx);
}

std::vector<std::string> lines_of(const std::string& text, double width_px, double font_px) {
  return text.empty() ? std::vector<std::string>{} : wrap(text, width_px, font_px);
}

std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + (count == 1 ? " point " : " points ") + what;
}

std::size_t count_outside(const Plot& plot, const Frame& frame) {
  std::size_t outside = 0;
  for (const Series& series : plot.series) {
    for (std::size_t i = 0; series.style != Style::band && i < series.x.size(); ++i) {
      outside += can_show(plot, series, i) && !frame.holds(frame.at({series.x[i], series.y[i]})) ? 1 : 0;
    }
  }
  return outside;
}

std::vector<std::string> notes_of(const Plot& plot, const Frame& frame, const Extent& extent, double width) {
  std::string text;
  const bool log = plot.log_x || plot.log_y;
  if (extent.impossible > 0) {
    text = "Not shown: " + counted(extent.impossible, log ? "infinite or not above zero." : "infinite.");
  }
  if (const std::size_t outside = count_outside(plot, frame); outside > 0) {
    text += (text.empty() ? "" : " ") + counted(outside, "outside of the axes.");
  }
  return lines_of(text, width, kTickFontPx);
}

}  // namespace

Point Frame::at(Point data) const {
  return {left + (right - left) * x.share(data.x), bottom - (bottom - top) * y.share(data.y)};
}

bool Frame::holds(Point px) const {
  constexpr double kSlackPx = 0.01;
  return px.x >= left - kSlackPx && px.x <= right + kSlackPx && px.y >= top - kSlackPx &&
         px.y <= bottom + kSlackPx;
}

Frame make_frame(const Plot& plot, const Canvas& canvas) {
  const Extent extent = extent_of(plot);
  Frame frame{.width = canvas.width_px, .empty = extent.shown == 0};
  choose_axes(frame, plot, extent);
  double top = kPadPx;
  if (canvas.standalone) frame.title = lines_of(plot.title, frame.width - 2.0 * kPadPx, kTitleFontPx);
  top += 20.0 * static_cast<double>(frame.title.size());
  // The label of y is as long as the area is high, nearly: it may wrap.
  frame.y_label = lines_of(plot.y_label, area_height(frame.width) + 30.0, kLabelFontPx);
  const double labels = frame.empty ? 0.0 : widest(frame.y.labels, kTickFontPx);
  const double left =
      kPadPx + kLinePx * static_cast<double>(frame.y_label.size()) + labels + kTickLengthPx + 2.0;
  const double last = frame.x.labels.empty() ? 0.0 : text_width_px(frame.x.labels.back(), kTickFontPx) / 2.0;
  const double right = frame.width - std::max(kPadPx, plot.x_names.empty() ? last : 0.0);
  place_legend_and_area(frame, plot, left, right, top + 4.0);
  frame.x_label = lines_of(plot.x_label, frame.right - frame.left + 40.0, kLabelFontPx);
  frame.notes = notes_of(plot, frame, extent, frame.width - 2.0 * kPadPx);
  place_foot(frame);
  return frame;
}

double sample_width_px(const Series& series) {
  const bool small = series.style == Style::dots || series.style == Style::bars;
  return small ? 12.0 : 28.0;
}

double half_bar_gap_px(const Plot& plot, const Frame& frame) {
  std::vector<double> middles;
  for (const Series& series : plot.series) {
    for (std::size_t i = 0; series.style == Style::bars && i < series.x.size(); ++i) {
      if (can_show(plot, series, i)) middles.push_back(frame.at({series.x[i], series.y[i]}).x);
    }
  }
  std::sort(middles.begin(), middles.end());
  double gap = (frame.right - frame.left) / 4.0;
  for (std::size_t i = 1; i < middles.size(); ++i) {
    if (middles[i] - middles[i - 1] > 0.01) gap = std::min(gap, middles[i] - middles[i - 1]);
  }
  return gap / 2.0;
}

}  // namespace skylight::service::report
