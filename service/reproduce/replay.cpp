#include "service/reproduce/replay.hpp"

#include <algorithm>
#include <cmath>

#include "service/reproduce/paper_frames.hpp"
#include "tracker/metrics.hpp"

namespace skylight::service::reproduce {
namespace {

constexpr double kUsableError = RobotMetrics::kUsableError;

Errors from_first(Errors errors) {
  const auto first = std::find_if(errors.begin(), errors.end(), [](const auto& e) { return e.has_value(); });
  if (first != errors.end()) errors.erase(errors.begin(), first);
  return errors;
}

struct RunFigures {
  double mean = 0.0;
  double std = 0.0;
  double min = 0.0;
};

RunFigures figures_of_run(const std::vector<double>& errors) {
  RunFigures out;
  const auto count = static_cast<double>(errors.size());
  for (const double e : errors) out.mean += e / count;
  for (const double e : errors) out.std += (e - out.mean) * (e - out.mean) / count;
  out.std = std::sqrt(out.std);
  out.min = *std::min_element(errors.begin(), errors.end());
  return out;
}

std::vector<double> present(const Errors& errors) {
  std::vector<double> out;
  for (const auto& e : errors)
    if (e) out.push_back(*e);
  return out;
}

void pool(std::vector<double> errors, ErrorFigures& out) {
  std::sort(errors.begin(), errors.end());
  const auto frames = static_cast<double>(out.frames);
  for (const double e : errors) {
    out.pooled_mean_m += e / static_cast<double>(errors.size());
    if (e < kUsableError) out.usable += 1.0 / frames;
  }
  out.p95_m = percentile(errors, 0.95);
  out.p99_m = percentile(errors, 0.99);
  if (out.frames > 0) out.lost = 1.0 - static_cast<double>(errors.size()) / frames;
}

}  // namespace

std::vector<std::string> routes_of(const Runs& runs) {
  std::vector<std::string> out;
  for (const ObservedRun& run : runs)
    if (std::find(out.begin(), out.end(), run.route) == out.end()) out.push_back(run.route);
  return out;
}

Filtering paper_filter(const WindowFilterConfig& config) {
  return {.make = [config] { return std::make_unique<WindowFilter>(config); }, .of_the_point = true};
}

std::vector<TracedFrame> trace(const ObservedRun& run, std::string_view variant) {
  const std::size_t v = variant_index(run, variant);
  const double reference = reference_of(variant);
  std::vector<TracedFrame> out;
  for (const ObservedFrame& frame : run.frames) {
    TracedFrame traced{
        .captured = frame.captured, .truth = point_of(frame.truth, reference), .truth_yaw = frame.truth.yaw};
    if (const auto& seen = frame.seen.at(v)) {
      traced.detected = point_of(seen->pose, reference);
      traced.detected_yaw = seen->pose.yaw;
    }
    out.push_back(traced);
  }
  return out;
}

std::vector<TracedFrame> trace(const ObservedRun& run, std::string_view variant, const Filtering& filtering) {
  std::vector<TracedFrame> out = trace(run, variant);
  const std::size_t v = variant_index(run, variant);
  const double reference = reference_of(variant);
  const std::unique_ptr<Filter> filter = filtering.make();
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::optional<Observation> seen = run.frames[i].seen[v];
    if (seen && filtering.of_the_point) {
      seen->pose.x = out[i].detected->x();
      seen->pose.y = out[i].detected->y();
    }
    const FilterStep step = filter->update(out[i].captured, seen);
    if (step.estimate)
      out[i].estimated = point_of(step.estimate->pose, filtering.of_the_point ? 0.0 : reference);
  }
  return out;
}

Errors accepted_errors(const ObservedRun& run, std::string_view variant, double alpha_m) {
  Errors errors;
  for (const TracedFrame& frame : trace(run, variant)) {
    errors.emplace_back();
    if (!frame.detected) continue;
    const double error = (*frame.detected - frame.truth).norm();
    if (error <= alpha_m) errors.back() = error;
  }
  return from_first(std::move(errors));
}

Errors filtered_errors(const ObservedRun& run, std::string_view variant, const Filtering& filtering) {
  Errors errors;
  for (const TracedFrame& frame : trace(run, variant, filtering)) {
    errors.emplace_back();
    if (frame.estimated) errors.back() = (*frame.estimated - frame.truth).norm();
  }
  return from_first(std::move(errors));
}

ErrorFigures figures_of(const std::vector<Errors>& runs) {
  ErrorFigures out;
  std::vector<double> all;
  std::vector<double> means;
  for (const Errors& errors : runs) {
    const std::vector<double> one = present(errors);
    out.frames += errors.size();
    if (one.empty()) {
      ++out.failed_runs;
      continue;
    }
    ++out.runs;
    const RunFigures run = figures_of_run(one);
    means.push_back(run.mean);
    out.dispersion_m += run.std;
    out.minimum_m += run.min;
    all.insert(all.end(), one.begin(), one.end());
  }
  if (means.empty()) {
    out.lost = out.frames > 0 ? 1.0 : 0.0;
    return out;
  }
  const auto count = static_cast<double>(means.size());
  const RunFigures over_runs = figures_of_run(means);
  out.mean_m = over_runs.mean;
  out.spread_m = over_runs.std;
  out.smallest_mean_m = over_runs.min;
  out.largest_mean_m = *std::max_element(means.begin(), means.end());
  out.dispersion_m /= count;
  out.minimum_m /= count;
  pool(std::move(all), out);
  return out;
}

}  // namespace skylight::service::reproduce
