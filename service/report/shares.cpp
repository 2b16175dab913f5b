#include "service/report/shares.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace skylight::service::report {

Series cumulative(std::string name, std::vector<double> values) {
  Series out{.name = std::move(name), .style = Style::line};
  const auto all = static_cast<double>(values.size());
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  std::sort(values.begin(), values.end());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i + 1 < values.size() && values[i + 1] == values[i]) continue;
    out.x.push_back(values[i]);
    out.y.push_back(static_cast<double>(i + 1) / all);
  }
  return out;
}

Series histogram(std::string name, const std::vector<double>& values, const HistogramBins& bins) {
  const std::vector<double>& edges = bins.edges;
  const bool rising = std::adjacent_find(edges.begin(), edges.end(),
                                         [](double a, double b) { return !(a < b); }) == edges.end();
  if (edges.size() < 2 || !rising || !std::isfinite(edges.front()) || !std::isfinite(edges.back()) ||
      (bins.log_x && edges.front() <= 0.0)) {
    throw std::invalid_argument("report: histogram \"" + name +
                                "\": its edges must be finite, rising, at least 2, above zero on a log axis");
  }
  std::vector<std::size_t> counts(edges.size() - 1, 0);
  for (const double value : values) {
    if (!(value >= edges.front() && value <= edges.back())) continue;
    const auto above = std::upper_bound(edges.begin(), edges.end(), value);
    const auto bin = static_cast<std::size_t>(above - edges.begin()) - 1;
    ++counts[std::min(bin, counts.size() - 1)];
  }
  Series out{.name = std::move(name), .style = Style::bars};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    out.x.push_back(bins.log_x ? std::sqrt(edges[i] * edges[i + 1]) : (edges[i] + edges[i + 1]) / 2.0);
    out.y.push_back(values.empty() ? 0.0
                                   : static_cast<double>(counts[i]) / static_cast<double>(values.size()));
  }
  return out;
}

}  // namespace skylight::service::report
