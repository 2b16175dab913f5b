#include "service/reproduce/paper_tables.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "service/reproduce/paper_figures.hpp"
#include "service/reproduce/paper_frames.hpp"
#include "tracker/metrics.hpp"

namespace skylight::service::reproduce {
namespace {

double share(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

double ratio_of(double a, double b) {
  return b > 0.0 ? a / b : 0.0;
}

SweepPoint swept(const Runs& runs, std::string_view variant, double value, const WindowFilterConfig& config) {
  std::vector<Errors> errors;
  for (const ObservedRun& run : runs) errors.push_back(filtered_errors(run, variant, paper_filter(config)));
  return {value, figures_of(errors)};
}

/// A run with what Table 2 sets against each other.
struct BeforeAndAfter {
  const ObservedRun* run;
  Errors before;
  Errors after;
};

MovementRow row_of(const std::string& name, const std::vector<BeforeAndAfter>& all,
                   const std::function<bool(const std::string&)>& belongs) {
  std::vector<Errors> before;
  std::vector<Errors> after;
  for (const BeforeAndAfter& one : all) {
    if (!belongs(one.run->route)) continue;
    before.push_back(one.before);
    after.push_back(one.after);
  }
  return {name, figures_of(before), figures_of(after)};
}

// A table's average is the mean of its rows, as in the paper: not of the runs.
ErrorFigures average_of(const ErrorFigures& a, const ErrorFigures& b) {
  const auto middle = [&](double ErrorFigures::*field) { return 0.5 * (a.*field + b.*field); };
  ErrorFigures out;
  out.runs = a.runs + b.runs;
  out.failed_runs = a.failed_runs + b.failed_runs;
  out.frames = a.frames + b.frames;
  for (const auto field : {&ErrorFigures::mean_m, &ErrorFigures::dispersion_m, &ErrorFigures::minimum_m,
                           &ErrorFigures::spread_m, &ErrorFigures::pooled_mean_m, &ErrorFigures::p95_m,
                           &ErrorFigures::p99_m, &ErrorFigures::usable, &ErrorFigures::lost}) {
    out.*field = middle(field);
  }
  out.smallest_mean_m = std::min(a.smallest_mean_m, b.smallest_mean_m);
  out.largest_mean_m = std::max(a.largest_mean_m, b.largest_mean_m);
  return out;
}

/// Sums over the two filters' frames of a route.
struct Contested {
  std::size_t frames = 0;
  std::size_t first_lost = 0;
  std::size_t second_lost = 0;
  std::vector<double> first;
  std::vector<double> second;

  void add(const Contested& other) {
    frames += other.frames;
    first_lost += other.first_lost;
    second_lost += other.second_lost;
    first.insert(first.end(), other.first.begin(), other.first.end());
    second.insert(second.end(), other.second.begin(), other.second.end());
  }
};

/// Where a filter has its first estimate; 0 where it never has one: then all is lost.
std::size_t first_of(const std::vector<TracedFrame>& frames) {
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (frames[i].estimated) return i;
  return 0;
}

Contested contested(const std::vector<TracedFrame>& a, const std::vector<TracedFrame>& b) {
  Contested out;
  for (std::size_t i = std::max(first_of(a), first_of(b)); i < a.size(); ++i) {
    ++out.frames;
    if (!a[i].estimated) ++out.first_lost;
    if (!b[i].estimated) ++out.second_lost;
    if (!a[i].estimated || !b[i].estimated) continue;
    out.first.push_back((*a[i].estimated - a[i].truth).norm());
    out.second.push_back((*b[i].estimated - b[i].truth).norm());
  }
  return out;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

ContestRow row_of(const std::string& name, Contested c) {
  std::sort(c.first.begin(), c.first.end());
  std::sort(c.second.begin(), c.second.end());
  return {.route = name,
          .frames = c.frames,
          .both = c.first.size(),
          .first_mean_m = mean_of(c.first),
          .second_mean_m = mean_of(c.second),
          .first_p99_m = percentile(c.first, 0.99),
          .second_p99_m = percentile(c.second, 0.99),
          .first_lost = share(c.first_lost, c.frames),
          .second_lost = share(c.second_lost, c.frames)};
}

}  // namespace

double AcceptanceRow::of_all() const {
  return share(accepted, frames);
}
double AcceptanceRow::of_found() const {
  return share(accepted, found);
}
double MovementRow::improvement() const {
  return ratio_of(before.mean_m, after.mean_m);
}
double ContestRow::ratio() const {
  return ratio_of(first_mean_m, second_mean_m);
}

std::vector<AcceptanceRow> table_1(const Runs& runs) {
  std::vector<AcceptanceRow> rows;
  for (const paper::AcceptanceFigure& figure : paper::kTable1) {
    AcceptanceRow row{.configuration = std::string(figure.configuration),
                      .variant = std::string(figure.variant),
                      .alpha_m = figure.alpha_m};
    double sum = 0.0;
    for (const ObservedRun& run : runs) {
      for (const TracedFrame& frame : trace(run, row.variant)) {
        ++row.frames;
        if (!frame.detected) continue;
        ++row.found;
        const double error = (*frame.detected - frame.truth).norm();
        if (error > row.alpha_m) continue;
        ++row.accepted;
        sum += error;
      }
    }
    if (row.accepted > 0) row.mean_m = sum / static_cast<double>(row.accepted);
    rows.push_back(row);
  }
  return rows;
}

std::vector<SweepPoint> figure_6(const Runs& runs, std::string_view variant) {
  std::vector<SweepPoint> points;
  for (int window = paper::kFirstWindow; window <= paper::kLastWindow; ++window)
    points.push_back(swept(runs, variant, window, {.window_size = window, .alpha = paper::kAlphaOfWindows}));
  return points;
}

std::vector<SweepPoint> figure_7(const Runs& runs, std::string_view variant) {
  std::vector<SweepPoint> points;
  for (int i = 0; i < paper::kAlphas; ++i) {
    const double alpha = paper::kFirstAlpha + i * paper::kAlphaStep;
    points.push_back(swept(runs, variant, alpha, {.window_size = paper::kBestWindow, .alpha = alpha}));
  }
  return points;
}

const SweepPoint& best(const std::vector<SweepPoint>& points) {
  return *std::min_element(points.begin(), points.end(), [](const SweepPoint& a, const SweepPoint& b) {
    return a.figures.mean_m < b.figures.mean_m;
  });
}

Table2 table_2(const Runs& runs) {
  const Filtering filtering = paper_filter({.window_size = paper::kBestWindow, .alpha = paper::kBestAlpha});
  std::vector<BeforeAndAfter> all;
  for (const ObservedRun& run : runs) {
    all.push_back({&run, accepted_errors(run, "vertical", paper::kTable1.front().alpha_m),
                   filtered_errors(run, "ray", filtering)});
  }
  Table2 table;
  table.movements.push_back(row_of("linear", all, is_linear));
  table.movements.push_back(row_of("curvilinear", all, [](const auto& route) { return !is_linear(route); }));
  const MovementRow& linear = table.movements[0];
  const MovementRow& curved = table.movements[1];
  table.movements.push_back(
      {"average", average_of(linear.before, curved.before), average_of(linear.after, curved.after)});
  for (const std::string& route : routes_of(runs))
    table.routes.push_back(row_of(route, all, [&](const std::string& name) { return name == route; }));
  return table;
}

std::vector<ContestRow> contest(const Runs& runs, std::string_view variant, const Filtering& first,
                                const Filtering& second) {
  std::vector<ContestRow> rows;
  Contested linear;
  Contested curved;
  for (const std::string& route : routes_of(runs)) {
    Contested all;
    for (const ObservedRun& run : runs)
      if (run.route == route) all.add(contested(trace(run, variant, first), trace(run, variant, second)));
    (is_linear(route) ? linear : curved).add(all);
    rows.push_back(row_of(route, std::move(all)));
  }
  rows.push_back(row_of("linear", std::move(linear)));
  rows.push_back(row_of("curvilinear", std::move(curved)));
  return rows;
}

}  // namespace skylight::service::reproduce
