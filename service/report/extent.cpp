#include "service/report/extent.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace skylight::service::report {
namespace {

bool is_missing(const Series& series, std::size_t i) {
  if (std::isnan(series.x[i])) return true;
  if (series.style == Style::band) return std::isnan(series.low[i]) || std::isnan(series.high[i]);
  return std::isnan(series.y[i]);
}

// Bars stand on the axis' zero and are as wide as their distance.
void take_bars(const Plot& plot, Extent& extent) {
  std::vector<double> middles;
  for (const Series& series : plot.series) {
    for (std::size_t i = 0; series.style == Style::bars && i < series.x.size(); ++i) {
      if (can_show(plot, series, i)) middles.push_back(plot.log_x ? std::log(series.x[i]) : series.x[i]);
    }
  }
  if (middles.empty()) return;
  if (!plot.log_y) extent.y.take(0.0);
  std::sort(middles.begin(), middles.end());
  middles.erase(std::unique(middles.begin(), middles.end()), middles.end());
  if (middles.size() < 2) return;
  double gap = middles.back() - middles.front();
  for (std::size_t i = 1; i < middles.size(); ++i) gap = std::min(gap, middles[i] - middles[i - 1]);
  for (const double end : {middles.front() - gap / 2.0, middles.back() + gap / 2.0}) {
    extent.x.take(plot.log_x ? std::exp(end) : end);
  }
}

}  // namespace

void Reach::take(double value) {
  low = any ? std::min(low, value) : value;
  high = any ? std::max(high, value) : value;
  any = true;
}

bool has_spread(const Plot& plot, const Series& series, std::size_t i) {
  return i < series.low.size() && drawable(series.x[i], plot.log_x) && drawable(series.low[i], false) &&
         drawable(series.high[i], plot.log_y);
}

bool can_show(const Plot& plot, const Series& series, std::size_t i) {
  if (series.style == Style::band) return has_spread(plot, series, i);
  return drawable(series.x[i], plot.log_x) && drawable(series.y[i], plot.log_y);
}

Extent extent_of(const Plot& plot) {
  Extent extent;
  for (const Series& series : plot.series) {
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!can_show(plot, series, i)) {
        ++(is_missing(series, i) ? extent.missing : extent.impossible);
        continue;
      }
      ++extent.shown;
      extent.x.take(series.x[i]);
      if (series.style != Style::band) extent.y.take(series.y[i]);
      if (!has_spread(plot, series, i)) continue;
      if (drawable(series.low[i], plot.log_y)) extent.y.take(series.low[i]);
      extent.y.take(series.high[i]);
    }
  }
  if (extent.shown == 0) return extent;
  take_bars(plot, extent);
  for (const Marker& marker : plot.vertical) {
    if (drawable(marker.at, plot.log_x)) extent.x.take(marker.at);
  }
  for (const Marker& marker : plot.horizontal) {
    if (drawable(marker.at, plot.log_y)) extent.y.take(marker.at);
  }
  return extent;
}

}  // namespace skylight::service::report
