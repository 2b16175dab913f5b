#include "service/reproduce/skylight_figures.hpp"

#include <algorithm>
#include <cmath>

#include "service/reproduce/noisy.hpp"
#include "settings/text.hpp"
#include "tracker/filter/motion.hpp"

namespace skylight::service::reproduce {
namespace {

ScoreOptions motion(const std::string& variant) {
  return {.filter = [] { return std::make_unique<MotionFilter>(); }, .variant = variant};
}

ScoreOptions without_smoothing(ScoreOptions options) {
  options.smoothed = false;
  return options;
}

std::vector<const ObservedRun*> all_of(const Runs& runs) {
  return chosen(runs, [](const ObservedRun&) { return true; });
}

std::vector<const ObservedRun*> beginning_with(const Runs& runs, const std::string& prefix) {
  return chosen(runs, [&](const ObservedRun& run) { return run.route.rfind(prefix, 0) == 0; });
}

RouteScores route_scores(const Runs& runs, const ScoreOptions& options) {
  RouteScores out{
      .linear = pooled(linear_runs(runs), options), .curved = pooled(curved_runs(runs), options), .all = {}};
  out.all = out.linear;
  out.all.kinds.merge(out.curved.kinds);
  if (out.curved.worst_error_m > out.all.worst_error_m) {
    out.all.worst_error_m = out.curved.worst_error_m;
    out.all.worst_run = out.curved.worst_run;
  }
  return out;
}

std::vector<RouteScore> by_route(const Runs& runs) {
  std::vector<RouteScore> out;
  for (const std::string& route : routes_of(runs)) {
    const auto same = chosen(runs, [&](const ObservedRun& run) { return run.route == route; });
    out.push_back({route, pooled(same, without_smoothing(motion("calibrated"))).kinds.filtered});
  }
  return out;
}

Reappeared reappeared(const Runs& runs, const std::string& route, const ScoreOptions& options) {
  Reappeared out;
  for (const ObservedRun& run : runs) {
    if (run.route != route) continue;
    for (const Reappearance& gap : reappearances(run, options, 1.5)) {
      if (gap.lost) {
        ++out.lost;
        continue;
      }
      ++out.count;
      out.hidden_s += gap.hidden_s;
      out.mean_m += gap.error_m;
      out.stated_m += gap.stated_m;
      out.largest_m = std::max(out.largest_m, gap.error_m);
    }
  }
  const double n = static_cast<double>(std::max<std::size_t>(1, out.count));
  out.hidden_s /= n;
  out.mean_m /= n;
  out.stated_m /= n;
  return out;
}

SmoothingScore smoothing_of(const std::string& detector, const Runs& runs, const std::string& variant) {
  return {detector, smoothing(all_of(runs), motion(variant))};
}

std::vector<SmoothingScore> other_smoothing(const Gathered& gathered) {
  const double error = depth_error(gathered.paper, "vertical_scan");
  const std::string millimetres = settings::number_text(std::round(1e3 * error));
  return {smoothing_of("white noise of the paper's size, 10 frames/s", noisy(gathered.routes, 10.0), "noisy"),
          smoothing_of("the paper's detections, straight down, the depth's mean error of " + millimetres +
                           " mm taken off",
                       without_depth_error(gathered.paper, "vertical_scan", error), "vertical_scan"),
          smoothing_of("the paper's detections, along the ray (without depth)", gathered.paper, "ray")};
}

std::vector<BeamScore> beams(const Runs& runs) {
  std::vector<BeamScore> out;
  ScoreOptions options = without_smoothing(motion("calibrated"));
  for (const bool odometry : {false, true}) {
    options.odometry = odometry;
    for (const char* path : {"line", "arc"}) out.push_back({path, odometry, reappeared(runs, path, options)});
  }
  return out;
}

std::vector<AheadScore> ahead(const Runs& all) {
  Runs runs;
  std::copy_if(all.begin(), all.end(), std::back_inserter(runs),
               [](const ObservedRun& run) { return run.seed <= 2; });
  std::vector<AheadScore> out;
  ScoreOptions options = without_smoothing(motion("true"));
  for (const double ahead : {0.1, 0.3, 0.5, 1.0, 2.0}) {
    for (const bool odometry : {false, true}) {
      options.ahead_s = ahead;
      options.odometry = odometry;
      const auto score_of = [&](const std::string& prefix) {
        return pooled(beginning_with(runs, prefix), options).kinds.predicted.score();
      };
      out.push_back({ahead, odometry, score_of("line"), score_of("circle"), score_of("chaotic")});
    }
  }
  return out;
}

std::vector<PartsScore> parts(const Gathered& gathered) {
  std::vector<PartsScore> out;
  const auto add = [&](const std::string& name, const Runs& runs, const ScoreOptions& options) {
    out.push_back({name, error_parts(all_of(runs), without_smoothing(options))});
  };
  add("all routes, calibrated camera", gathered.routes, motion("calibrated"));
  add("all routes, true camera", gathered.routes, motion("true"));
  ScoreOptions window = motion("true");
  window.filter = [] { return std::make_unique<WindowFilter>(WindowFilterConfig{}); };
  add("all routes, true camera, the paper's window filter", gathered.routes, window);
  for (std::size_t i = 0; i < gathered.ablations.size(); ++i)
    add(gathered.plan.ablations[i].name, gathered.ablations[i], motion("true"));
  return out;
}

}  // namespace

SkylightFigures skylight_figures(const Gathered& gathered) {
  return {.with_truth = route_scores(gathered.routes, motion("true")),
          .with_calibration = route_scores(gathered.routes, motion("calibrated")),
          .by_route = by_route(gathered.routes),
          .chaotic = pooled(beginning_with(gathered.routes, "chaotic"), motion("calibrated")),
          .white = smoothing_of("white noise of the paper's size, 30 frames/s", noisy(gathered.routes, 30.0),
                                "noisy"),
          .paper = smoothing_of("the paper's detections, straight down", gathered.paper, "vertical_scan"),
          .other_smoothing = other_smoothing(gathered),
          .beams = beams(gathered.occlusion),
          .ahead = ahead(gathered.routes),
          .parts = parts(gathered)};
}

}  // namespace skylight::service::reproduce
