#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>

#include <Eigen/Geometry>

#include "service/reproduce/mrclam.hpp"
#include "service/reproduce/page.hpp"

namespace skylight::service::reproduce {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<const char*, kMrclamFilters> kNames{
    "window filter", "motion filter", "motion filter, odometry", "motion filter, slow error told"};
constexpr std::size_t kPathFrames = 600;  // 60 s
constexpr std::size_t kPathStep = 100;    // begins are tried each 10 s
constexpr std::size_t kAroundGap = 30;    // frames shown before and after
constexpr double kMovedThroughGap = 0.1;  // m: a robot that stands is easy to foretell

std::string digits(double value, int behind) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", behind, value);
  return text.data();
}

std::string mm(double metres) {
  return digits(1e3 * metres, 1) + " mm";
}

// The table.

Cell millimetres(const ErrorSummary& errors, double value) {
  return report::number(errors.count > 0 ? 1e3 * value : kNone, 1);
}
Cell degrees(const ErrorSummary& errors) {
  return report::number(errors.count > 0 ? kDegrees * errors.mean : kNone, 2);
}
Cell nees(const RobotScore& score) {
  return report::number(score.nees_frames > 0 ? score.nees_mean : kNone, 2);
}
Cell inside(const RobotScore& score) {
  return report::number(score.nees_frames > 0 ? 100.0 * score.ellipse_95 : kNone, 1);
}

std::vector<report::Column> columns() {
  std::vector<report::Column> out{{.heading = "robot"}, {.heading = "by"}};
  const auto add = [&](const char* group, const char* heading, const char* unit) {
    out.push_back({.heading = heading, .unit = unit, .group = group});
  };
  for (const char* heading : {"mean", "95 %", "99 %"}) add("now", heading, "mm");
  add("now", "heading", "degrees");
  add("now", "NEES", "");
  add("now", "in ellipse", "%");
  for (const char* heading : {"mean", "99 %"}) add("smoothed", heading, "mm");
  add("smoothed", "heading", "degrees");
  add("smoothed", "NEES", "");
  for (const char* heading : {"mean", "99 %"}) add("0.5 s ahead", heading, "mm");
  for (const char* heading : {"mean", "99 %"}) add("1 s ahead", heading, "mm");
  for (const char* heading : {"mean", "95 %"}) add("end of a gap", heading, "mm");
  add("end of a gap", "NEES", "");
  out.push_back({.heading = "with a pose", .unit = "%"});
  return out;
}

void add_now(const RobotScore& score, std::vector<Cell>& cells) {
  const ErrorSummary& place = score.position_error_m;
  for (const double value : {place.mean, place.p95, place.p99}) cells.push_back(millimetres(place, value));
  cells.push_back(degrees(score.yaw_error_rad));
  cells.push_back(nees(score));
  cells.push_back(inside(score));
}

report::Row measured_row(const std::string& robot, const MrclamScores& scores) {
  report::Row row{.cells = {report::text(robot), report::text("measured")}, .rule_above = true};
  add_now(scores.measured, row.cells);
  while (row.cells.size() + 1 < columns().size()) row.cells.push_back(report::number(kNone, 1));
  const RobotScore& all = scores.filters[kMotion].all;
  row.cells.push_back(report::number(100.0 * all.measured, 1));
  return row;
}

report::Row filter_row(const std::string& robot, const char* name, const MrclamScore& score) {
  report::Row row{.cells = {report::text(robot), report::text(name)}};
  add_now(score.filtered, row.cells);
  const ErrorSummary& smoothed = score.smoothed.position_error_m;
  row.cells.push_back(millimetres(smoothed, smoothed.mean));
  row.cells.push_back(millimetres(smoothed, smoothed.p99));
  row.cells.push_back(degrees(score.smoothed.yaw_error_rad));
  row.cells.push_back(nees(score.smoothed));
  for (const RobotScore* ahead : {&score.half_ahead, &score.one_ahead}) {
    row.cells.push_back(millimetres(ahead->position_error_m, ahead->position_error_m.mean));
    row.cells.push_back(millimetres(ahead->position_error_m, ahead->position_error_m.p99));
  }
  const ErrorSummary& gap = score.gap_end.position_error_m;
  row.cells.push_back(millimetres(gap, gap.mean));
  row.cells.push_back(millimetres(gap, gap.p95));
  row.cells.push_back(nees(score.gap_end));
  row.cells.push_back(report::number(100.0 * score.all.availability, 2));
  return row;
}

report::Table table(const MrclamResults& results) {
  report::Table out{.id = "mrclam",
                    .title = "Five real robots: position errors by Vicon's truth",
                    .columns = columns(),
                    .rows = {},
                    .caption = {}};
  const auto add = [&](const std::string& name, const MrclamScores& scores) {
    out.rows.push_back(measured_row(name, scores));
    for (std::size_t f = 0; f < kMrclamFilters; ++f)
      out.rows.push_back(filter_row(name, kNames.at(f), scores.filters.at(f)));
  };
  add("all", results.pooled);
  for (const MrclamScores& scores : results.robots) add(std::to_string(scores.robot), scores);
  out.caption =
      "Now, smoothed and ahead are told outside of gaps, single misses included; measured only where "
      "there is an observation. Smoothed: 1.0 to 1.4 s later. Heading: mean absolute error. NEES: 3 where "
      "covariances are honest, above where they claim to know too much, below where too little. In ellipse: "
      "share of "
      "the true places inside the 95 % ellipse. With a pose: of all frames with a truth, gaps included.";
  return out;
}

// The plots.

void add_point(Series& series, const std::optional<Pose2>& pose) {
  series.x.push_back(pose ? pose->x : kNone);
  series.y.push_back(pose ? pose->y : kNone);
}

std::optional<Pose2> seen_pose(const MrclamFrame& frame) {
  return frame.seen ? std::optional(frame.seen->pose) : std::nullopt;
}

double way(const std::vector<MrclamFrame>& frames, std::size_t from, std::size_t to) {
  double sum = 0.0;
  for (std::size_t i = from + 1; i < to; ++i)
    if (frames[i].truth && frames[i - 1].truth)
      sum += (frames[i].truth->position() - frames[i - 1].truth->position()).norm();
  return sum;
}

/// Way over the diagonal of the box around it: 1 on a line; 0 where it goes less than a metre.
double winding(const std::vector<MrclamFrame>& frames, std::size_t from, std::size_t to) {
  const double length = way(frames, from, to);
  if (length < 1.0) return 0.0;
  Eigen::AlignedBox2d box;
  for (std::size_t i = from; i < to; ++i)
    if (frames[i].truth) box.extend(frames[i].truth->position());
  return length / box.diagonal().norm();
}

/// Where its path winds most in kPathFrames, so that it fits a small plot, in which noise can be seen.
std::size_t most_winding(const std::vector<MrclamFrame>& frames) {
  std::size_t best = 0;
  double most = 0.0;
  for (std::size_t from = 0; from + kPathFrames <= frames.size(); from += kPathStep) {
    const double one = winding(frames, from, from + kPathFrames);
    if (one > most) best = from;
    most = std::max(most, one);
  }
  return best;
}

Plot path_plot(const MrclamTrace& trace) {
  const std::size_t from = most_winding(trace.frames);
  const std::size_t to = std::min(from + kPathFrames, trace.frames.size());
  Series truth{.name = "truth", .style = Style::dashed, .colour = Colour::ink};
  Series measured{.name = "measured", .style = Style::dots, .colour = Colour::grey};
  Series filtered{.name = "filtered", .colour = Colour::blue};
  Series smoothed{.name = "smoothed", .colour = Colour::vermillion};
  for (std::size_t i = from; i < to; ++i) {
    add_point(truth, trace.frames[i].truth);
    add_point(measured, seen_pose(trace.frames[i]));
    add_point(filtered, trace.filtered[kMotion].at(i));
    add_point(smoothed, trace.smoothed[kMotion].at(i));
  }
  return {.id = "mrclam-path",
          .title = "Robot " + std::to_string(trace.robot) + ", the minute in which its path winds most",
          .x_label = "x (m)",
          .y_label = "y (m)",
          .series = {measured, truth, filtered, smoothed},
          .equal_axes = true,
          .caption = "Motion filter without odometry, gaps included."};
}

struct Gap {
  const MrclamTrace* trace = nullptr;
  std::size_t last = 0;  ///< frame
  double error_m = 0.0;  ///< there, without odometry
};

std::size_t gap_frames(const MrclamNoise& noise) {
  return static_cast<std::size_t>(std::lround(noise.gap_s * kMrclamRateHz));
}

double error_at(const MrclamTrace& trace, std::size_t filter, std::size_t i) {
  const auto& told = trace.filtered.at(filter).at(i);
  const auto& truth = trace.frames[i].truth;
  return told && truth ? (told->position() - truth->position()).norm() : kNone;
}

/// The gaps that can be shown whole and through which the robot moved.
std::vector<Gap> gaps(const MrclamResults& results) {
  std::vector<Gap> out;
  const std::size_t length = gap_frames(results.noise);
  for (const MrclamTrace& trace : results.traces) {
    for (std::size_t i = length + kAroundGap; i + kAroundGap < trace.frames.size(); ++i) {
      if (!trace.frames[i].ends_gap || way(trace.frames, i + 1 - length, i + 1) < kMovedThroughGap) continue;
      bool whole = true;
      for (std::size_t k = i + 1 - length - kAroundGap; k <= i + kAroundGap; ++k)
        whole = whole && trace.frames[k].truth && trace.filtered[kMotion][k] &&
                trace.filtered[kMotionOdometry][k];
      if (whole) out.push_back({.trace = &trace, .last = i, .error_m = error_at(trace, kMotion, i)});
    }
  }
  return out;
}

Plot gap_plot(const MrclamResults& results) {
  Plot plot{.id = "mrclam-gap",
            .title = "Through a gap",
            .x_label = "time since the gap began (s)",
            .y_label = "position error (mm)",
            .vertical = {{0.0, "hidden"}, {results.noise.gap_s, "seen"}}};
  std::vector<Gap> all = gaps(results);
  if (all.empty()) return plot;
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end(),
                   [](const Gap& a, const Gap& b) { return a.error_m < b.error_m; });
  const MrclamTrace& trace = *middle->trace;
  const std::size_t first = middle->last + 1 - gap_frames(results.noise);
  Series measured{.name = "measured", .style = Style::dots, .colour = Colour::grey};
  Series without{.name = "filtered", .colour = Colour::blue};
  Series with{.name = "filtered, odometry", .colour = Colour::green};
  for (std::size_t i = first - kAroundGap; i <= middle->last + kAroundGap; ++i) {
    const double t = (static_cast<double>(i) - static_cast<double>(first)) / kMrclamRateHz;
    const auto seen = seen_pose(trace.frames[i]);
    for (Series* series : {&measured, &without, &with}) series->x.push_back(t);
    measured.y.push_back(seen ? 1e3 * (seen->position() - trace.frames[i].truth->position()).norm() : kNone);
    without.y.push_back(1e3 * error_at(trace, kMotion, i));
    with.y.push_back(1e3 * error_at(trace, kMotionOdometry, i));
  }
  plot.series = {measured, without, with};
  plot.caption = "Robot " + std::to_string(trace.robot) + ": of " + std::to_string(all.size()) +
                 " gaps in which a robot moved by at least 0.1 m, the one with the median error at its end "
                 "without odometry.";
  return plot;
}

// The text.

std::string what_was_done(const MrclamResults& results) {
  const MrclamNoise& n = results.noise;
  return "UTIAS MRCLAM data set 6: five iRobot Create, their truth by Vicon, " +
         digits(results.seconds / 60.0, 0) + " robot-minutes, of which they move " +
         digits(100.0 * results.pooled.moving, 0) +
         " %. The pictures are not real: the truth is taken at 10 Hz, with white noise of " + mm(n.white_m) +
         " per axis and " + digits(kDegrees * n.white_rad, 1) + " degrees, a slow error of " + mm(n.slow_m) +
         " per axis with a time constant of " + digits(n.slow_time_s, 1) + " s, " +
         digits(100.0 * n.single_miss, 0) + " % single misses, and a gap of " + digits(n.gap_s, 1) +
         " s every " + digits(n.gap_every_s, 0) + " s on average (seed " + std::to_string(n.seed) +
         "). Odometry is what the data set has: the velocity that the robot was commanded to have, not what "
         "its "
         "wheels did. Filters are at their defaults but where it is stated; the window filter is the "
         "paper's, "
         "12 and 0.3 m.";
}

std::string what_it_tells(const MrclamResults& results) {
  const auto& filters = results.pooled.filters;
  const MrclamScore& without = filters[kMotion];
  const MrclamScore& with = filters[kMotionOdometry];
  const auto mean = [](const RobotScore& score) { return mm(score.position_error_m.mean); };
  return "Mean errors over all robots: measured " + mean(results.pooled.measured) + ", window filter " +
         mean(filters[kWindow].filtered) + ", motion filter " + mean(without.filtered) + ", smoothed " +
         mean(without.smoothed) + "; with odometry " + mean(with.filtered) + " and " + mean(with.smoothed) +
         ". 1 s ahead " + mean(without.one_ahead) + ", with odometry " + mean(with.one_ahead) +
         ". At the end of " + std::to_string(without.gap_end.frames) + " gaps " + mean(without.gap_end) +
         ", with odometry " + mean(with.gap_end) + ".";
}

/// Why covariances claim too little.
std::string what_is_too_sure(const MrclamResults& results) {
  const auto nees_of = [&](std::size_t filter) {
    const RobotScore& score = results.pooled.filters.at(filter).filtered;
    return digits(score.nees_mean, 1) + " (" + digits(100.0 * score.ellipse_95, 0) + " % in the ellipse)";
  };
  MrclamCommands least;
  MrclamCommands most;
  if (!results.robots.empty()) least = most = results.robots.front().commands;
  for (const MrclamScores& robot : results.robots) {
    least.lead_s = std::min(least.lead_s, robot.commands.lead_s);
    most.lead_s = std::max(most.lead_s, robot.commands.lead_s);
    least.yaw_scale = std::min(least.yaw_scale, robot.commands.yaw_scale);
    most.yaw_scale = std::max(most.yaw_scale, robot.commands.yaw_scale);
  }
  return "What the filter claims: by default it knows nothing of a slow error of this size, and its NEES "
         "is " +
         nees_of(kMotion) + "; told of it (`observation_bias_m`) " + nees_of(kMotionTold) +
         ", with about the same errors. With odometry it is " + nees_of(kMotionOdometry) +
         ": turns are commanded " + digits(least.lead_s, 2) + " to " + digits(most.lead_s, 2) +
         " s before the robots make them, and they turn only " + digits(100.0 * least.yaw_scale, 0) + " to " +
         digits(100.0 * most.yaw_scale, 0) +
         " % as fast as they were told. Commands so wrong still help where nothing is seen, but the filter "
         "believes them more than they deserve: the NEES at the end of a gap is " +
         digits(results.pooled.filters[kMotionOdometry].gap_end.nees_mean, 1) + " with odometry and " +
         digits(results.pooled.filters[kMotion].gap_end.nees_mean, 1) +
         " without, where it claims far too little knowledge of robots as slow as these.";
}

}  // namespace

report::Section mrclam_section(const MrclamResults& results) {
  report::Section section{.id = "real-robots", .title = "Real robots", .level = 1, .blocks = {}};
  section.blocks.emplace_back(report::Paragraph{.text = what_was_done(results)});
  section.blocks.emplace_back(report::Paragraph{.text = what_it_tells(results)});
  section.blocks.emplace_back(report::Paragraph{.text = what_is_too_sure(results)});
  section.blocks.emplace_back(table(results));
  if (!results.traces.empty()) section.blocks.emplace_back(path_plot(results.traces.front()));
  section.blocks.emplace_back(gap_plot(results));
  return section;
}

}  // namespace skylight::service::reproduce
