#include "service/report/marks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "service/report/extent.hpp"
#include "service/report/text.hpp"

namespace skylight::service::report {
namespace {

constexpr double kFarPx = 1e5;  // what lies farther outside is drawn here
constexpr int kShapes = 6;

bool has_line(Style style) {
  return style == Style::line || style == Style::dashed || style == Style::line_and_dots;
}
bool has_dots(Style style) {
  return style == Style::dots || style == Style::line_and_dots;
}
bool has_whiskers(Style style) {
  return has_dots(style) || style == Style::bars;
}

std::string xy(Point p) {
  return px(p.x) + "," + px(p.y);
}

using Line = std::vector<Point>;

// The part of a segment within the area (Liang and Barsky, 1984).
std::optional<std::pair<Point, Point>> clipped(Point a, Point b, const Frame& frame) {
  double from = 0.0;
  double to = 1.0;
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const std::array<std::pair<double, double>, 4> edges{
      {{-dx, a.x - frame.left}, {dx, frame.right - a.x}, {-dy, a.y - frame.top}, {dy, frame.bottom - a.y}}};
  for (const auto& [slope, room] : edges) {
    if (slope == 0.0 && room < 0.0) return std::nullopt;
    if (slope < 0.0) from = std::max(from, room / slope);
    if (slope > 0.0) to = std::min(to, room / slope);
  }
  if (from > to) return std::nullopt;
  return std::pair{from > 0.0 ? Point{a.x + from * dx, a.y + from * dy} : a,
                   to < 1.0 ? Point{a.x + to * dx, a.y + to * dy} : b};
}

void append_clipped(std::vector<Line>& out, const Line& run, const Frame& frame) {
  if (run.size() == 1 && frame.holds(run.front())) out.push_back(run);
  bool joined = false;
  for (std::size_t i = 1; i < run.size(); ++i) {
    const auto part = clipped(run[i - 1], run[i], frame);
    if (!part) {
      joined = false;
      continue;
    }
    if (!joined) out.push_back({part->first});
    out.back().push_back(part->second);
    joined = part->second.x == run[i].x && part->second.y == run[i].y;
  }
}

// Unbroken pieces of a line within the area.
std::vector<Line> lines_of(const Plot& plot, const Series& series, const Frame& frame) {
  std::vector<Line> out;
  Line run;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (can_show(plot, series, i)) {
      run.push_back(frame.at({series.x[i], series.y[i]}));
      if (i + 1 < series.x.size()) continue;
    }
    append_clipped(out, run, frame);
    run.clear();
  }
  return out;
}

std::string line_path(const Line& line) {
  std::string out = "M" + xy(line.front());
  std::string last = xy(line.front());
  for (std::size_t i = 1; i < line.size(); ++i) {
    std::string next = xy(line[i]);
    if (next == last) continue;
    out += (i == 1 ? "L" : " ") + next;
    last = std::move(next);
  }
  return out;
}

// Points along a line, close enough that a label cannot lie between them.
void append_samples(std::vector<Point>& out, const Line& line) {
  constexpr double kApartPx = 6.0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    out.push_back(line[i]);
    if (i + 1 == line.size()) return;
    const Point a = line[i];
    const Point b = line[i + 1];
    const double pieces = std::ceil(std::hypot(b.x - a.x, b.y - a.y) / kApartPx);
    for (double k = 1.0; k < pieces; k += 1.0)
      out.push_back({a.x + k / pieces * (b.x - a.x), a.y + k / pieces * (b.y - a.y)});
  }
}

std::string draw_line(const Plot& plot, const Series& series, const Look& look, const Frame& frame,
                      std::vector<Point>& drawn) {
  std::string path;
  std::vector<Point> alone;
  for (const Line& line : lines_of(plot, series, frame)) {
    const Line thin = thin_line(line);
    append_samples(drawn, thin);
    if (thin.size() == 1) {
      alone.push_back(thin.front());
    } else {
      path += line_path(thin);
    }
  }
  std::string out;
  if (!path.empty()) {
    out += "<path class=\"line\" stroke-width=\"1.7\" stroke-linejoin=\"round\"";
    if (!look.dash.empty()) out += " stroke-dasharray=\"" + std::string(look.dash) + "\"";
    out += " d=\"" + path + "\"/>\n";
  }
  // A point between two gaps has no line: it is shown as a small dot.
  if (!alone.empty() && !has_dots(series.style)) out += dots_path(alone, {.dot_px = 3.0});
  return out;
}

double bounded_y(const Frame& frame, double x, double y) {
  if (frame.y.log && !drawable(y, true)) return frame.bottom;
  return std::clamp(frame.at({x, y}).y, -kFarPx, kFarPx);
}

std::string whisker_path(const Plot& plot, const Series& series, const Frame& frame, std::size_t i,
                         double shift) {
  if (!has_spread(plot, series, i)) return "";
  const double x = frame.at({series.x[i], series.high[i]}).x + shift;
  double low = bounded_y(frame, series.x[i], series.low[i]);
  double high = bounded_y(frame, series.x[i], series.high[i]);
  if (x < frame.left - 0.01 || x > frame.right + 0.01 || std::max(low, high) < frame.top ||
      std::min(low, high) > frame.bottom) {
    return "";
  }
  std::string caps;
  for (double* end : {&low, &high}) {
    const bool inside = *end >= frame.top - 0.01 && *end <= frame.bottom + 0.01;
    *end = std::clamp(*end, frame.top, frame.bottom);
    if (inside) caps += "M" + px(x - 3.0) + "," + px(*end) + "h6";
  }
  return "M" + px(x) + "," + px(low) + "V" + px(high) + caps;
}

std::string draw_dots(const Plot& plot, const Series& series, const Look& look, const Frame& frame,
                      std::vector<Point>& drawn) {
  std::vector<Point> points;
  std::vector<std::size_t> from;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!can_show(plot, series, i)) continue;
    const Point p = frame.at({series.x[i], series.y[i]});
    if (!frame.holds(p)) continue;
    points.push_back(p);
    from.push_back(i);
  }
  std::vector<Point> kept;
  std::string whiskers;
  for (const std::size_t i : thin_dots(points)) {
    kept.push_back(points[i]);
    whiskers += whisker_path(plot, series, frame, from[i], 0.0);
  }
  drawn.insert(drawn.end(), kept.begin(), kept.end());
  std::string out;
  if (!whiskers.empty()) out += "<path class=\"whiskers\" stroke-width=\"1.2\" d=\"" + whiskers + "\"/>\n";
  return out + dots_path(kept, look);
}

// Later series are lighter, with the same outline.
std::string bar_style(const Look& look) {
  constexpr std::array<const char*, 3> kFill{"0.85", "0.15", "0.5"};
  return std::string("fill=\"currentColor\" fill-opacity=\"") +
         kFill.at(static_cast<std::size_t>(look.bars) % 3) + "\" stroke-width=\"1\"";
}

std::string bar_path(double left, double width, double base, double top) {
  return "M" + px(left) + "," + px(base) + "V" + px(top) + "h" + px(width) + "V" + px(base) + "z";
}

std::string draw_bars(const Plot& plot, const Series& series, const Look& look, const Frame& frame,
                      std::vector<Point>& drawn) {
  const auto count = std::count_if(plot.series.begin(), plot.series.end(),
                                   [](const Series& s) { return s.style == Style::bars; });
  // Bars of one histogram touch; names and groups stand apart.
  const double share = count == 1 && plot.x_names.empty() ? 2.0 : 1.6;
  const double slot = share * half_bar_gap_px(plot, frame) / static_cast<double>(count);
  const double width = std::clamp(slot, 0.5, 60.0);
  const double shift = width * (look.bars - static_cast<double>(count - 1) / 2.0);
  const double base =
      frame.y.log ? frame.bottom : std::clamp(bounded_y(frame, frame.x.low, 0.0), frame.top, frame.bottom);
  std::map<long, double> highest;  // bars closer than a pixel: the longest of each half pixel
  std::string whiskers;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!can_show(plot, series, i)) continue;
    const double x = frame.at({series.x[i], series.y[i]}).x + shift;
    if (x < frame.left || x > frame.right) continue;
    const double y = std::clamp(bounded_y(frame, series.x[i], series.y[i]), frame.top, frame.bottom);
    double& end = highest.try_emplace(std::lround(x * 20.0) / (slot < 0.5 ? 10 : 1), y).first->second;
    if (std::abs(y - base) > std::abs(end - base)) end = y;
    whiskers += whisker_path(plot, series, frame, i, shift);
  }
  std::string path;
  for (const auto& [twentieths, end] : highest) {
    const double x = static_cast<double>(twentieths) / (slot < 0.5 ? 2.0 : 20.0);
    path += bar_path(x - width / 2.0, width, base, end);
    drawn.push_back({x, end});
  }
  std::string out;
  if (!path.empty()) out += "<path class=\"bars\" " + bar_style(look) + " d=\"" + path + "\"/>\n";
  if (whiskers.empty()) return out;
  const Look ink{.ink = ink_of(Colour::ink)};  // on a bar of its own colour a whisker would not be seen
  return out + open_group(ink) + "<path class=\"whiskers\" stroke-width=\"1.2\" d=\"" + whiskers +
         "\"/>\n</g>\n";
}

// A closed path around one run of a band; in each pixel column the lowest and the highest.
std::string band_path(const Plot& plot, const Series& series, const Frame& frame, std::size_t begin,
                      std::size_t end) {
  Line upper;
  Line lower;
  for (std::size_t i = begin; i < end && has_spread(plot, series, i); ++i) {
    const double x = std::clamp(frame.at({series.x[i], series.high[i]}).x, -kFarPx, kFarPx);
    const double high = bounded_y(frame, series.x[i], series.high[i]);
    const double low = bounded_y(frame, series.x[i], series.low[i]);
    if (!upper.empty() && std::floor(upper.back().x) == std::floor(x) && i + 1 < end) {
      upper.back().y = std::min(upper.back().y, high);
      lower.back().y = std::max(lower.back().y, low);
      continue;
    }
    upper.push_back({x, high});
    lower.push_back({x, low});
  }
  if (upper.size() < 2) return "";
  std::string out = "M" + xy(upper.front()) + "L";
  for (std::size_t i = 1; i < upper.size(); ++i) out += xy(upper[i]) + " ";
  for (std::size_t i = lower.size(); i-- > 0;) out += xy(lower[i]) + (i > 0 ? " " : "z");
  return out;
}

std::string shape_path(int shape, double r) {
  switch (shape) {
    case 2:
      return "m0," + px(-1.2 * r) + "l" + px(1.15 * r) + "," + px(2.0 * r) + "h" + px(-2.3 * r) + "z";
    case 3: {
      const std::string d = px(1.3 * r);
      return "m0,-" + d + "l" + d + "," + d + "l-" + d + "," + d + "l-" + d + ",-" + d + "z";
    }
    case 4: {
      const std::string d = px(r);
      const std::string dd = px(2.0 * r);
      return "m-" + d + ",-" + d + "l" + dd + "," + dd + "m0,-" + dd + "l-" + dd + "," + dd;
    }
    case 5: {
      const std::string d = px(1.2 * r);
      const std::string dd = px(2.4 * r);
      return "m-" + d + ",0h" + dd + "m-" + d + ",-" + d + "v" + dd;
    }
    default:
      return "h0";  // a round or square cap without a line
  }
}

}  // namespace

std::vector<Look> looks_of(const Plot& plot) {
  constexpr std::array<std::string_view, 6> kDashes{"",      "11 3",         "8 3 2 3",
                                                    "2 2.5", "11 3 2 3 2 3", "5 2 1 2"};
  std::set<Colour> taken;
  for (const Series& series : plot.series) taken.insert(series.colour);
  std::vector<Look> out;
  int colours = 0;
  int lines = 0;
  int dots = 0;
  int bars = 0;
  for (const Series& series : plot.series) {
    Colour colour = series.colour;
    if (colour == Colour::automatic) {
      for (int tries = 0; tries < 6 && taken.contains(automatic_colour(colours)); ++tries) ++colours;
      colour = automatic_colour(colours++);
    }
    Look look{.ink = ink_of(colour)};
    if (series.style == Style::dashed) look.dash = "6 4";
    if (series.style == Style::line)
      look.dash = kDashes.at(static_cast<std::size_t>(lines++) % kDashes.size());
    if (has_dots(series.style)) look.shape = dots++ % kShapes;
    if (series.style == Style::bars) look.bars = bars++;
    look.dot_px = series.x.size() <= 80 ? 6.0 : series.x.size() <= 600 ? 4.0 : 2.6;
    out.push_back(look);
  }
  return out;
}

std::string open_group(const Look& look) {
  return "<g class=\"" + std::string(look.ink.name) + "\" color=\"" + std::string(look.ink.light) +
         "\" fill=\"none\" stroke=\"currentColor\">\n";
}

std::string dots_path(const std::vector<Point>& points, const Look& look) {
  if (points.empty()) return "";
  std::string out = "<path class=\"dots\" ";
  if (look.shape < 2) {
    out += look.shape == 0 ? "stroke-linecap=\"round\"" : "stroke-linecap=\"square\"";
    out += " stroke-width=\"" + px(look.shape == 0 ? look.dot_px : 0.85 * look.dot_px) + "\"";
  } else if (look.shape < 4) {
    out += "fill=\"currentColor\" stroke=\"none\"";
  } else {
    out += "stroke-width=\"1.5\"";
  }
  const std::string shape = shape_path(look.shape, look.dot_px / 2.0);
  out += " d=\"";
  for (const Point& p : points) out += "M" + xy(p) + shape;
  return out + "\"/>\n";
}

std::string legend_sample(const Series& series, const Look& look, Point at) {
  std::string out = open_group(look);
  const double width = sample_width_px(series);
  const Point middle{at.x + width / 2.0, at.y};
  if (series.style == Style::bars) {
    out += "<path " + bar_style(look) + " d=\"" + bar_path(middle.x - 6.0, 12.0, at.y + 6.0, at.y - 6.0) +
           "\"/>\n";
  }
  const bool band = series.style == Style::band || (!series.low.empty() && !has_whiskers(series.style));
  if (band) {
    out += "<path fill=\"currentColor\" fill-opacity=\"0.2\" stroke=\"none\" d=\"" +
           bar_path(at.x, width, at.y + 6.0, at.y - 6.0) + "\"/>\n";
  }
  if (has_line(series.style)) {
    out += "<path stroke-width=\"1.7\"";
    if (!look.dash.empty()) out += " stroke-dasharray=\"" + std::string(look.dash) + "\"";
    out += " d=\"M" + xy(at) + "h" + px(width) + "\"/>\n";
  }
  if (has_dots(series.style)) {
    Look larger = look;
    larger.dot_px = std::max(larger.dot_px, 4.0);
    out += dots_path({middle}, larger);
  }
  return out + "</g>\n";
}

std::string draw_area(const Plot& plot, const Series& series, const Look& look, const Frame& frame) {
  if (series.low.empty() || has_whiskers(series.style)) return "";
  std::string path;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= series.x.size(); ++i) {
    if (i < series.x.size() && has_spread(plot, series, i)) continue;
    path += band_path(plot, series, frame, begin, i);
    begin = i + 1;
  }
  if (path.empty()) return "";
  return open_group(look) +
         "<path class=\"band\" fill=\"currentColor\" fill-opacity=\"0.2\" stroke=\"none\" d=\"" + path +
         "\"/>\n</g>\n";
}

std::string draw_marks(const Plot& plot, const Series& series, const Look& look, const Frame& frame,
                       std::vector<Point>& drawn) {
  std::string marks;
  if (series.style == Style::bars) marks += draw_bars(plot, series, look, frame, drawn);
  if (has_line(series.style)) marks += draw_line(plot, series, look, frame, drawn);
  if (has_dots(series.style)) marks += draw_dots(plot, series, look, frame, drawn);
  return marks.empty() ? marks : open_group(look) + marks + "</g>\n";
}

}  // namespace skylight::service::report
