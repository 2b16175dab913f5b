#include "service/report/draw.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "service/report/extent.hpp"
#include "service/report/marks.hpp"
#include "service/report/report.hpp"
#include "service/report/style.hpp"
#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

struct Words {
  std::string text;
  Point at;  ///< the baseline's start, middle or end, by the anchor
  const char* anchor = "start";
  const char* extra = "";  ///< further attributes
  double font_px = kTickFontPx;
};

std::string write_words(const Words& words) {
  return "<text x=\"" + px(words.at.x) + "\" y=\"" + px(words.at.y) + "\" text-anchor=\"" + words.anchor +
         "\" font-size=\"" + px(words.font_px) + "\" " + words.extra + ">" + escape(words.text) + "</text>\n";
}

std::string path(const std::string& attributes, const std::string& d) {
  return d.empty() ? "" : "<path " + attributes + " fill=\"none\" d=\"" + d + "\"/>\n";
}

std::string across(const Frame& frame, double y) {
  return "M" + px(frame.left) + "," + px(y) + "H" + px(frame.right);
}
std::string up(const Frame& frame, double x) {
  return "M" + px(x) + "," + px(frame.bottom) + "V" + px(frame.top);
}

// Between two powers of ten: 2, 3 ... 9 times the lower one.
std::vector<double> minor_ticks(const Axis& axis) {
  std::vector<double> out;
  for (std::size_t i = 1; axis.log && i < axis.ticks.size(); ++i) {
    const double low = axis.ticks[i - 1];
    if (std::abs(axis.ticks[i] / low - 10.0) > 1e-6) continue;
    for (int k = 2; k < 10; ++k) out.push_back(k * low);
  }
  return out;
}

double x_of(const Frame& frame, double value) {
  return frame.left + (frame.right - frame.left) * frame.x.share(value);
}
double y_of(const Frame& frame, double value) {
  return frame.bottom - (frame.bottom - frame.top) * frame.y.share(value);
}

std::string draw_grid(const Frame& frame) {
  std::string minor;
  for (const double tick : minor_ticks(frame.x)) minor += up(frame, x_of(frame, tick));
  for (const double tick : minor_ticks(frame.y)) minor += across(frame, y_of(frame, tick));
  std::string vertical;
  std::string horizontal;
  for (const double tick : frame.x.ticks) vertical += up(frame, x_of(frame, tick));
  for (const double tick : frame.y.ticks) horizontal += across(frame, y_of(frame, tick));
  const std::string edge = up(frame, frame.right) + across(frame, frame.top);
  return path("class=\"minor\" stroke=\"#f2f4f6\"", minor) + path("class=\"grid\" stroke=\"#e6e9ec\"", edge) +
         path("class=\"grid x\" stroke=\"#e6e9ec\"", vertical) +
         path("class=\"grid y\" stroke=\"#e6e9ec\"", horizontal);
}

std::string draw_x_labels(const Frame& frame) {
  std::string out;
  double free_from = -1e9;  // labels that would touch the one before are left out
  for (std::size_t i = 0; i < frame.x.ticks.size(); ++i) {
    const double x = x_of(frame, frame.x.ticks[i]);
    const double half = text_width_px(frame.x.labels[i], kTickFontPx) / 2.0;
    const double y = frame.bottom + 8.0 + kTickFontPx;
    if (frame.slanted) {
      if (x < free_from) continue;
      free_from = x + kTickFontPx + 2.0;
      const std::string turn =
          "class=\"tick x\" fill=\"#6b7580\" transform=\"rotate(-35 " + px(x) + " " + px(y - 4.0) + ")\"";
      out += write_words({frame.x.labels[i], {x + 4.0, y - 2.0}, "end", turn.c_str()});
      continue;
    }
    if (x - half < free_from) continue;
    free_from = x + half + 4.0;
    out += write_words({frame.x.labels[i], {x, y}, "middle", "class=\"tick x\" fill=\"#6b7580\""});
  }
  return out;
}

std::string draw_y_labels(const Frame& frame) {
  std::string out;
  double free_above = 1e9;
  for (std::size_t i = 0; i < frame.y.ticks.size(); ++i) {
    const double y = y_of(frame, frame.y.ticks[i]) + 0.35 * kTickFontPx;
    if (y > free_above) continue;
    free_above = y - kTickFontPx - 1.0;
    out +=
        write_words({frame.y.labels[i], {frame.left - 8.0, y}, "end", "class=\"tick y\" fill=\"#6b7580\""});
  }
  return out;
}

std::string draw_axes(const Frame& frame) {
  std::string ticks;
  for (const double tick : frame.x.ticks)
    ticks += "M" + px(x_of(frame, tick)) + "," + px(frame.bottom) + "v4";
  for (const double tick : frame.y.ticks) ticks += "M" + px(frame.left) + "," + px(y_of(frame, tick)) + "h-4";
  const std::string box =
      "M" + px(frame.left) + "," + px(frame.top) + "V" + px(frame.bottom) + "H" + px(frame.right);
  std::string out = "<g class=\"grey\" color=\"#6b7580\">\n" +
                    path("class=\"axes\" stroke=\"currentColor\"", box + (frame.empty ? "" : ticks)) +
                    "</g>\n";
  return frame.empty ? out : out + draw_x_labels(frame) + draw_y_labels(frame);
}

std::string draw_axis_labels(const Frame& frame) {
  std::string out;
  double y = frame.x_label_y;
  for (const std::string& line : frame.x_label) {
    out +=
        write_words({line, {(frame.left + frame.right) / 2.0, y}, "middle", "class=\"label\"", kLabelFontPx});
    y += kLinePx;
  }
  const double middle = (frame.top + frame.bottom) / 2.0;
  double x = 10.0 + kLabelFontPx;
  // A map stands in the middle of the picture, its label beside it.
  double labels = 0.0;
  for (const std::string& label : frame.y.labels)
    labels = std::max(labels, text_width_px(label, kTickFontPx));
  x = std::max(x, frame.left - labels - 14.0 - kLinePx * (static_cast<double>(frame.y_label.size()) - 1.0));
  for (const std::string& line : frame.y_label) {
    const std::string turn = "class=\"label\" transform=\"rotate(-90 " + px(x) + " " + px(middle) + ")\"";
    out += write_words({line, {x, middle}, "middle", turn.c_str(), kLabelFontPx});
    x += kLinePx;
  }
  y = frame.height - 10.0 - kLinePx * (static_cast<double>(frame.notes.size()) - 1.0);
  for (const std::string& line : frame.notes) {
    out += write_words({line, {10.0, y}, "start", "class=\"note\" fill=\"#6b7580\" font-style=\"italic\""});
    y += kLinePx;
  }
  return out;
}

std::string draw_title(const Frame& frame) {
  std::string out;
  double y = 10.0 + kTitleFontPx;
  for (const std::string& line : frame.title) {
    out += write_words({line, {10.0, y}, "start", "class=\"title\" font-weight=\"600\"", kTitleFontPx});
    y += 20.0;
  }
  return out;
}

std::string draw_legend(const Plot& plot, const std::vector<Look>& looks, const Frame& frame) {
  std::string out;
  for (const LegendItem& item : frame.legend) {
    out += legend_sample(plot.series[item.series], looks[item.series], {item.x, item.y});
    double y = item.y + 0.35 * kLabelFontPx;
    for (const std::string& line : item.lines) {
      out += write_words({line,
                          {item.x + sample_width_px(plot.series[item.series]) + 6.0, y},
                          "start",
                          "class=\"legend\"",
                          kLabelFontPx});
      y += kLinePx;
    }
  }
  return out;
}

// Places labels of markers where the fewest points are, off each other.
class LabelPlaces {
 public:
  LabelPlaces(const Frame& frame, const std::vector<Point>& drawn) : frame_(frame), drawn_(drawn) {}

  /// Of these left ends of baselines the best one; nothing where all are taken.
  const Point* choose(const std::vector<Point>& places, double width) {
    const Point* best = nullptr;
    long fewest = 0;
    for (const Point& place : places) {
      const Box box{place.x - 2.0, place.y - kTickFontPx, place.x + width + 2.0, place.y + 4.0};
      if (box.left < frame_.left || box.right > frame_.right || box.top < frame_.top ||
          box.bottom > frame_.bottom)
        continue;
      if (std::any_of(taken_.begin(), taken_.end(), [&](const Box& other) { return meet(box, other); }))
        continue;
      const auto covered = std::count_if(drawn_.begin(), drawn_.end(), [&](Point p) {
        return meet(box, {p.x, p.y, p.x, p.y});
      });
      if (best != nullptr && covered >= fewest) continue;
      best = &place;
      fewest = covered;
    }
    if (best != nullptr)
      taken_.push_back({best->x - 2.0, best->y - kTickFontPx, best->x + width + 2.0, best->y + 4.0});
    return best;
  }

 private:
  struct Box {
    double left, top, right, bottom;
  };
  static bool meet(const Box& a, const Box& b) {
    return a.left <= b.right && b.left <= a.right && a.top <= b.bottom && b.top <= a.bottom;
  }
  const Frame& frame_;
  const std::vector<Point>& drawn_;
  std::vector<Box> taken_;
};

std::string marker_label(const std::string& label, const std::vector<Point>& places, LabelPlaces& free) {
  if (label.empty()) return "";
  const Point* place = free.choose(places, text_width_px(label, kTickFontPx));
  if (place == nullptr) return "";
  return write_words({label, *place, "start",
                      "class=\"halo\" stroke=\"#fff\" stroke-width=\"3\" stroke-linejoin=\"round\" "
                      "paint-order=\"stroke\""});
}

constexpr const char* kMarkerLine =
    "class=\"marker\" stroke=\"currentColor\" stroke-width=\"1.1\" stroke-dasharray=\"3 3\"";

std::string draw_vertical_marker(const Marker& marker, const Frame& frame, LabelPlaces& free) {
  if (!drawable(marker.at, frame.x.log)) return "";
  const double x = x_of(frame, marker.at);
  if (x < frame.left - 0.01 || x > frame.right + 0.01) return "";
  const double width = text_width_px(marker.label, kTickFontPx);
  std::vector<Point> places;
  for (const double share : {0.0, 0.12, 0.24, 0.5, 0.75, 1.0}) {
    const double y = frame.top + 15.0 + share * (frame.bottom - frame.top - 23.0);
    places.push_back({x + 5.0, y});
    places.push_back({x - 5.0 - width, y});
  }
  return path(kMarkerLine, up(frame, x)) + marker_label(marker.label, places, free);
}

std::string draw_horizontal_marker(const Marker& marker, const Frame& frame, LabelPlaces& free) {
  if (!drawable(marker.at, frame.y.log)) return "";
  const double y = y_of(frame, marker.at);
  if (y < frame.top - 0.01 || y > frame.bottom + 0.01) return "";
  const double room = frame.right - frame.left - 8.0 - text_width_px(marker.label, kTickFontPx);
  std::vector<Point> places;
  for (const double share : {1.0, 0.0, 0.5, 0.75, 0.25}) {
    places.push_back({frame.left + 4.0 + share * room, y - 5.0});
    places.push_back({frame.left + 4.0 + share * room, y + 15.0});
  }
  return path(kMarkerLine, across(frame, y)) + marker_label(marker.label, places, free);
}

// A label keeps off the markers that it does not belong to as well.
void append_markers(std::vector<Point>& drawn, const Plot& plot, const Frame& frame) {
  constexpr double kApartPx = 6.0;
  for (const Marker& marker : plot.vertical) {
    if (!drawable(marker.at, frame.x.log)) continue;
    for (double y = frame.top; y < frame.bottom; y += kApartPx) drawn.push_back({x_of(frame, marker.at), y});
  }
  for (const Marker& marker : plot.horizontal) {
    if (!drawable(marker.at, frame.y.log)) continue;
    for (double x = frame.left; x < frame.right; x += kApartPx) drawn.push_back({x, y_of(frame, marker.at)});
  }
}

std::string draw_markers(const Plot& plot, const Frame& frame, std::vector<Point> drawn) {
  append_markers(drawn, plot, frame);
  LabelPlaces free(frame, drawn);
  std::string out;
  for (const Marker& marker : plot.vertical) out += draw_vertical_marker(marker, frame, free);
  for (const Marker& marker : plot.horizontal) out += draw_horizontal_marker(marker, frame, free);
  return out.empty() ? out : "<g class=\"grey\" color=\"#6b7580\">\n" + out + "</g>\n";
}

std::string draw_data(const Plot& plot, const std::vector<Look>& looks, const Frame& frame,
                      const std::string& id) {
  std::string areas;
  for (std::size_t i = 0; i < plot.series.size(); ++i)
    areas += draw_area(plot, plot.series[i], looks[i], frame);
  std::string out;
  if (!areas.empty()) {
    out += "<clipPath id=\"" + id + ".area\"><rect x=\"" + px(frame.left) + "\" y=\"" + px(frame.top) +
           "\" width=\"" + px(frame.right - frame.left) + "\" height=\"" + px(frame.bottom - frame.top) +
           "\"/></clipPath>\n";
    out += "<g clip-path=\"url(#" + id + ".area)\">\n" + areas + "</g>\n";
  }
  std::vector<Point> drawn;
  for (std::size_t i = 0; i < plot.series.size(); ++i)
    out += draw_marks(plot, plot.series[i], looks[i], frame, drawn);
  return out + draw_markers(plot, frame, drawn);
}

std::string no_data(const Frame& frame) {
  return write_words({"no data",
                      {(frame.left + frame.right) / 2.0, (frame.top + frame.bottom) / 2.0},
                      "middle",
                      "class=\"note\" fill=\"#6b7580\" font-style=\"italic\"",
                      kTitleFontPx});
}

std::string range_text(const std::string& label, const Axis& axis) {
  const std::string name = label.empty() ? "without a name" : label;
  if (axis.labels.empty()) return name;
  return name + ", from " + axis.labels.front() + " to " + axis.labels.back() +
         (axis.log ? ", logarithmic" : "");
}

// For those who do not see the plot.
std::string description(const Plot& plot, const Frame& frame) {
  if (frame.empty) return "There are no data to show.";
  std::string out =
      "Across: " + range_text(plot.x_label, frame.x) + ". Up: " + range_text(plot.y_label, frame.y) + ".";
  for (const Series& series : plot.series) {
    Reach reach;
    std::size_t count = 0;
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!can_show(plot, series, i)) continue;
      ++count;
      const bool band = series.style == Style::band;
      reach.take(band ? series.low[i] : series.y[i]);
      if (band) reach.take(series.high[i]);
    }
    out += " " + (series.name.empty() ? "A series" : series.name) + ": " + std::to_string(count) + " points";
    if (reach.any) out += ", from " + short_text(reach.low) + " to " + short_text(reach.high);
    out += ".";
  }
  for (const auto* markers : {&plot.vertical, &plot.horizontal}) {
    for (const Marker& marker : *markers) {
      out += " Line at " + short_text(marker.at) + (marker.label.empty() ? "." : ": " + marker.label + ".");
    }
  }
  return out;
}

}  // namespace

std::string draw(const Plot& plot, const Canvas& canvas) {
  const Frame frame = make_frame(plot, canvas);
  std::vector<Look> looks = looks_of(plot);
  if (canvas.width_px < 400.0) {
    for (Look& look : looks) look.dot_px *= 0.75;
  }
  const std::string id = plot.id + canvas.id_suffix;
  const std::string size = px(frame.width) + "\" height=\"" + px(frame.height);
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" width=\"" + size +
                    "\" viewBox=\"0 0 " + px(frame.width) + " " + px(frame.height) +
                    "\" role=\"img\" aria-labelledby=\"" + id + ".title " + id + ".desc\">\n";
  out += "<title id=\"" + id + ".title\">" + escape(plot.title) + "</title>\n";
  out += "<desc id=\"" + id + ".desc\">" + escape(description(plot, frame)) + "</desc>\n";
  if (canvas.standalone) {
    out += "<style>" + std::string(kPlotStyle) + "</style>\n";
    out += "<rect class=\"ground\" width=\"" + size + "\" fill=\"#fff\"/>\n" + draw_title(frame);
  }
  if (!frame.empty) out += draw_grid(frame) + draw_data(plot, looks, frame, id);
  if (frame.empty) out += no_data(frame);
  return out + draw_axes(frame) + draw_axis_labels(frame) + draw_legend(plot, looks, frame) + "</svg>\n";
}

std::string svg(const Plot& plot) {
  check(plot);
  return draw(plot, {});
}

}  // namespace skylight::service::report
