// Skylight's half of the report: what was aimed at, what came out, and where the rest comes from.
#include <cmath>

#include "service/report/shares.hpp"
#include "service/reproduce/page.hpp"
#include "service/reproduce/paper_figures.hpp"
#include "service/reproduce/skylight_figures.hpp"
#include "tracker/filter/motion.hpp"

namespace skylight::service::reproduce {
namespace {

Cell judged(double value, double aim, int digits, bool at_least = false) {
  const bool kept = at_least ? value >= aim : value <= aim;
  return number(value, digits, kept ? Emphasis::good : Emphasis::bad);
}

/// Without odometry.
Reappeared beam_of(const SkylightFigures& f, std::string_view path) {
  for (const BeamScore& beam : f.beams)
    if (beam.path == path && !beam.odometry) return beam.reappeared;
  return {};
}

Row aim_row(const std::string& what, Cell paper, Cell aim, Cell ours) {
  return {.cells = {text(what), std::move(paper), std::move(aim), std::move(ours)}};
}

Table summary(const SkylightFigures& f) {
  Table table{.id = "aims",
              .title = "What was aimed at, and what came out",
              .columns = {{"figure"}, {"paper"}, {"aim"}, {"ours"}},
              .caption =
                  "1920 x 1080 px, 30 frames/s, one robot, camera 4 m above the floor, exposure 8 ms, "
                  "all picture effects at their defaults. Calibrated: lens and pose wrong so that the "
                  "floor's points move by 1.5 mm RMS, a draw for each seed. Shares are of all frames "
                  "from 1 s after the robot came into view; nothing is left out."};
  const Cell none = text("none");
  const auto paper = [](double value) { return number(value, 3, Emphasis::paper); };
  const RobotScore linear = f.with_calibration.linear.kinds.filtered.score();
  const RobotScore curved = f.with_calibration.curved.kinds.filtered.score();
  const RobotScore all = f.with_calibration.all.kinds.filtered.score();
  const RobotScore truth = f.with_truth.all.kinds.filtered.score();
  const auto add = [&](const std::string& what, Cell theirs, double aim, double ours, int digits,
                       bool at_least = false) {
    table.rows.push_back(
        aim_row(what, std::move(theirs), number(aim, digits), judged(ours, aim, digits, at_least)));
  };
  add("calibrated: mean error, linear, filtered (m)", paper(paper::kTable2[0].currently.mean_m), 0.003,
      linear.position_error_m.mean, 5);
  add("calibrated: mean error, curvilinear, filtered (m)", paper(paper::kTable2[1].currently.mean_m), 0.003,
      curved.position_error_m.mean, 5);
  add("calibrated: 99th percentile over pooled frames (m)", none, 0.007, all.position_error_m.p99, 5);
  add("true camera: mean error (m)", none, 0.001, truth.position_error_m.mean, 5);
  add("true camera: 99th percentile (m)", none, 0.003, truth.position_error_m.p99, 5);
  add("calibrated: mean heading error (degrees)", none, 0.3, kDegrees * all.yaw_error_rad.mean, 4);
  add("calibrated: usable, error below 0.1 m (%)", number(97.0, 1, Emphasis::paper), 99.9, 100.0 * all.usable,
      3, true);
  add("calibrated: confident wrong poses", none, 0.0, static_cast<double>(all.confident_wrong), 0);
  add("smoothed against filtered, white noise of the paper's size along the routes (times)", none, 1.4,
      f.white.ratio(), 2, true);
  add("smoothed against filtered, the paper's detections, straight down (times)", none, 1.4, f.paper.ratio(),
      2, true);
  add("predicted 0.5 s ahead, chaotic routes, calibrated: mean (m)", none, 0.015,
      f.chaotic.kinds.predicted.score().position_error_m.mean, 5);
  add("after a beam on a line, calibrated: mean at reappearance (m)", none, 0.03, beam_of(f, "line").mean_m,
      5);
  add("after a beam on an arc, calibrated: mean at reappearance (m)", none, 0.03, beam_of(f, "arc").mean_m,
      5);
  return table;
}

void add_score(Table& table, const std::string& camera, const std::string& routes, const std::string& kind,
               const RobotMetrics& metrics) {
  const RobotScore s = metrics.score();
  const ErrorSummary& e = s.position_error_m;
  table.rows.push_back(
      {{text(camera), text(routes), text(kind), number(kMm * e.mean, 3), number(kMm * e.p95, 3),
        number(kMm * e.p99, 3), number(kMm * e.max, 3), number(kDegrees * s.yaw_error_rad.mean, 4),
        number(kDegrees * s.yaw_error_rad.p99, 4), number(100.0 * s.usable, 3),
        number(static_cast<double>(s.confident_wrong), 0), number(s.nees_mean, 2),
        number(100.0 * s.ellipse_95, 1)}});
}

std::vector<report::Column> score_columns() {
  return {{"camera"},
          {"routes"},
          {"kind"},
          {"mean", "mm", "position error"},
          {"p95", "mm", "position error"},
          {"p99", "mm", "position error"},
          {"largest", "mm", "position error"},
          {"mean", "deg", "heading error"},
          {"p99", "deg", "heading error"},
          {"usable", "%"},
          {"confident wrong"},
          {"NEES"},
          {"in the 95 % ellipse", "%"}};
}

Table kinds_table(const SkylightFigures& f) {
  Table table{.id = "kinds",
              .title = "By camera, routes and kind of pose",
              .columns = score_columns(),
              .rows = {},
              .caption = "Predicted: 0.5 s ahead. Worst run, filtered: calibrated " +
                         f.with_calibration.all.worst_run + " (largest error " +
                         number_text(std::round(1e6 * f.with_calibration.all.worst_error_m) / 1e3) +
                         " mm), true " + f.with_truth.all.worst_run + " (" +
                         number_text(std::round(1e6 * f.with_truth.all.worst_error_m) / 1e3) +
                         " mm). NEES is near 3 where covariances are honest, below where they are cautious."};
  const auto add = [&](const std::string& camera, const std::string& routes, const KindMetrics& kinds) {
    add_score(table, camera, routes, "measured", kinds.measured);
    add_score(table, camera, routes, "filtered", kinds.filtered);
    add_score(table, camera, routes, "smoothed", kinds.smoothed);
    add_score(table, camera, routes, "predicted", kinds.predicted);
  };
  add("calibrated", "linear", f.with_calibration.linear.kinds);
  add("calibrated", "curvilinear", f.with_calibration.curved.kinds);
  add("true", "linear", f.with_truth.linear.kinds);
  add("true", "curvilinear", f.with_truth.curved.kinds);
  return table;
}

Table each_route(const SkylightFigures& f) {
  Table table{.id = "skylight-routes",
              .title = "Route by route, filtered",
              .columns = score_columns(),
              .rows = {},
              .caption = {}};
  for (const RouteScore& one : f.by_route)
    add_score(table, "calibrated", one.route, "filtered", one.filtered);
  return table;
}

std::vector<double> errors_of(const Runs& runs, const std::string& variant, const Filtering& filtering) {
  std::vector<double> out;
  for (const ObservedRun& run : runs) {
    for (const auto& error : filtered_errors(run, variant, filtering))
      out.push_back(error ? kMm * *error : INFINITY);
  }
  return out;
}

Plot distribution(const Gathered& gathered) {
  const Filtering ours{.make = [] { return std::make_unique<MotionFilter>(); }};
  Plot plot{.id = "distribution",
            .title = "How large the errors are",
            .x_label = "position error (mm)",
            .y_label = "share of frames below it",
            .log_x = true,
            .caption =
                "From the first calibrated frame to the end of each route. A curve that ends below "
                "1 has frames without a pose."};
  plot.series = {
      report::cumulative("Skylight, true camera", errors_of(gathered.routes, "true", ours)),
      report::cumulative("Skylight, calibrated camera", errors_of(gathered.routes, "calibrated", ours)),
      report::cumulative("the paper's filter on Skylight's detections",
                         errors_of(gathered.routes, "calibrated", paper_filter({}))),
      report::cumulative("the paper's pipeline", errors_of(gathered.paper, "ray", paper_filter({})))};
  return plot;
}

Table occlusion_table(const SkylightFigures& f) {
  Table table{.id = "occlusion",
              .title = "Under a beam: where the robot is taken to be when it is seen again",
              .columns = {{"path"},
                          {"odometry"},
                          {"passes"},
                          {"lost"},
                          {"not observed for", "s"},
                          {"mean error", "mm"},
                          {"largest", "mm"},
                          {"stated", "mm"}},
              .caption =
                  "Scenarios `occlusion/line` and `occlusion/arc`, a seed for each pass, calibrated camera. "
                  "Stated: what the covariance says of the error, one sigma over both axes. It is wide "
                  "because a robot that is not seen may have turned or stopped: the chaotic routes do so "
                  "some 25 times a minute, and one filter serves them all."};
  for (const BeamScore& beam : f.beams) {
    const Reappeared& r = beam.reappeared;
    table.rows.push_back(
        {{text(beam.path), text(beam.odometry ? "yes" : "no"), number(static_cast<double>(r.count), 0),
          number(static_cast<double>(r.lost), 0), number(r.hidden_s, 2), number(kMm * r.mean_m, 1),
          number(kMm * r.largest_m, 1), number(kMm * r.stated_m, 0)}});
  }
  return table;
}

Table prediction_table(const SkylightFigures& f) {
  Table table{.id = "prediction",
              .title = "How far ahead",
              .columns = {{"ahead", "s"},
                          {"odometry"},
                          {"linear", "mm", "mean error"},
                          {"circles", "mm", "mean error"},
                          {"chaotic", "mm", "mean error"},
                          {"NEES, chaotic"},
                          {"in the 95 % ellipse, chaotic", "%"}},
              .caption = "True camera: what the motion adds, without the calibration."};
  for (const AheadScore& a : f.ahead) {
    table.rows.push_back(
        {{text(number_text(a.ahead_s)), text(a.odometry ? "yes" : "no"),
          number(kMm * a.line.position_error_m.mean, 2), number(kMm * a.circle.position_error_m.mean, 2),
          number(kMm * a.chaotic.position_error_m.mean, 2), number(a.chaotic.nees_mean, 2),
          number(100.0 * a.chaotic.ellipse_95, 1)}});
  }
  return table;
}

Table smoothing_table(const SkylightFigures& f) {
  Table table{
      .id = "smoothing",
      .title = "What a second's later data is worth",
      .columns = {{"detector"}, {"filtered", "mm"}, {"smoothed", "mm"}, {"better by"}},
      .rows = {},
      .caption =
          "Mean errors, each run's mean error vector taken off, smoothing lag 1 s. White noise: mean "
          "distance "
          "0.1 m, heading 10 degrees, 20 % missed, along the true paths of these routes. The paper's camera "
          "measures depth in steps with a mean error that is the same everywhere (found by least squares "
          "from "
          "all runs): that puts each detection further in or out for as long as the robot is there, and no "
          "smoother knows. Taken off, what is left is noise."};
  std::vector<SmoothingScore> rows{f.white, f.paper};
  rows.insert(rows.end(), f.other_smoothing.begin(), f.other_smoothing.end());
  for (const SmoothingScore& s : rows) {
    table.rows.push_back(
        {{text(s.detector), number(kMm * s.mean.filtered_m, 2), number(kMm * s.mean.smoothed_m, 2),
          number(s.ratio(), 2, s.ratio() >= 1.4 ? Emphasis::good : Emphasis::bad)}});
  }
  return table;
}

Table parts_table(const SkylightFigures& f) {
  Table table{.id = "ablation",
              .title = "Where the error comes from",
              .columns = {{"room"},
                          {"mean", "mm", "measured"},
                          {"scatter", "mm", "measured"},
                          {"forward", "mm", "bias, measured"},
                          {"left", "mm", "bias, measured"},
                          {"mean", "mm", "filtered"},
                          {"forward", "mm", "bias, filtered: lag"}},
              .caption =
                  "Calibration is the difference of the first two rows. The others: a line, a circle "
                  "and a chaotic route, true camera, one thing changed at a time. Scatter: RMS about each "
                  "run's mean. A filter that lags would be off backwards: negative."};
  for (const auto& [name, p] : f.parts) {
    table.rows.push_back(
        {{text(name), number(kMm * p.measured_mean_m, 4), number(kMm * p.measured_scatter_m, 4),
          number(kMm * p.measured_bias_m.x(), 4), number(kMm * p.measured_bias_m.y(), 4),
          number(kMm * p.filtered_mean_m, 4), number(kMm * p.filtered_bias_m.x(), 4)}});
  }
  return table;
}

Plot error_over_time(const Gathered& gathered) {
  Plot plot{.id = "error-over-time",
            .title = "One chaotic route, second by second",
            .x_label = "time (s)",
            .y_label = "position error (mm)",
            .log_y = true};
  const Filtering ours{.make = [] { return std::make_unique<MotionFilter>(); }};
  for (const ObservedRun& run : gathered.routes) {
    if (run.route != "chaotic-1" || run.seed != 1) continue;
    for (const auto& [name, variant] :
         {std::pair{"true camera", "true"}, std::pair{"calibrated", "calibrated"}}) {
      Series series{.name = name};
      for (const TracedFrame& frame : trace(run, variant, ours)) {
        series.x.push_back(to_seconds(frame.captured - run.frames.front().captured));
        series.y.push_back(frame.estimated ? kMm * (*frame.estimated - frame.truth).norm() : NAN);
      }
      plot.series.push_back(std::move(series));
    }
  }
  return plot;
}

}  // namespace

std::vector<Section> skylight_sections(const Gathered& gathered) {
  const SkylightFigures figures = skylight_figures(gathered);
  Section first{.id = "summary", .title = "In short", .level = 1};
  first.blocks = {summary(figures)};
  Section accuracy{.id = "accuracy", .title = "Skylight along the paper's routes", .level = 1};
  accuracy.blocks = {kinds_table(figures), distribution(gathered), error_over_time(gathered),
                     each_route(figures)};
  Section parts{.id = "parts", .title = "Where the error comes from", .level = 1};
  parts.blocks = {parts_table(figures), smoothing_table(figures)};
  Section ahead{.id = "ahead", .title = "Ahead, and out of sight", .level = 1};
  ahead.blocks = {prediction_table(figures), occlusion_table(figures)};
  return {std::move(first), std::move(accuracy), std::move(parts), std::move(ahead)};
}

}  // namespace skylight::service::reproduce
