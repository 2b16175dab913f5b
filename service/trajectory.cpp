#include "service/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

#include "service/time_text.hpp"
#include "service/wire.hpp"

namespace skylight::service {
namespace {

// Exact to a nanometre within a kilometre, and to a nanoradian.
std::string text(double value) {
  char out[40];
  std::snprintf(out, sizeof out, "%.12g", value);
  return out;
}

Json point_json(const TrajectoryPoint& p, PoseKind kind) {
  Json covariance = Json::array();
  for (int i = 0; i < 9; ++i) covariance.push_back(p.covariance(i / 3, i % 3));
  return {
      {"captured", unix_seconds(p.captured)},
      {"state", skylight::to_string(p.state)},
      {"source", skylight::to_string(p.source)},
      {"x", p.pose.x},
      {"y", p.pose.y},
      {"yaw", p.pose.yaw},
      {"velocity", kind == PoseKind::measured
                       ? Json(nullptr)
                       : Json{{"x", p.velocity.x}, {"y", p.velocity.y}, {"yaw_rate", p.velocity.yaw_rate}}},
      {"covariance", covariance},
      {"score", p.score}};
}

}  // namespace

std::optional<TrajectoryFormat> trajectory_format(std::string_view name) {
  if (name == "csv") return TrajectoryFormat::csv;
  if (name == "tum") return TrajectoryFormat::tum;
  if (name == "json") return TrajectoryFormat::json;
  return std::nullopt;
}

namespace {

TrajectoryPoint point(const HistoryEntry& entry, PoseKind kind, const Estimate& estimate) {
  const bool seen = entry.measured && (kind == PoseKind::measured || entry.state != TrackState::predicting);
  return {entry.captured,
          entry.state,
          seen ? entry.measured->source : PoseSource::prediction,
          estimate.pose,
          estimate.covariance,
          estimate.velocity,
          seen ? entry.measured->score : 0.0};
}

// The smoothed poses of entries `first` to `last` - 1: those that are final from the history, the rest from
// the filter.
void add_smoothed(const RobotView& robot, const HistoryRange& range, std::vector<TrajectoryPoint>& points) {
  const HistoryView& history = robot.history;
  std::vector<Estimate> recent;
  if (robot.filter && range.last > history.settled())
    recent = robot.filter->smoothed_from(history[std::max(range.first, history.settled())].captured);
  auto next = recent.begin();
  for (std::size_t i = range.first; i < range.last; ++i) {
    if (i < history.settled()) {
      if (history.smoothed(i)) points.push_back(point(history[i], PoseKind::smoothed, *history.smoothed(i)));
      continue;
    }
    while (next != recent.end() && next->at < history[i].captured) ++next;
    if (next != recent.end() && next->at == history[i].captured)
      points.push_back(point(history[i], PoseKind::smoothed, *next));
  }
}

}  // namespace

Trajectory make_trajectory(const RobotView& robot, PoseKind kind, Time from, Time to) {
  Trajectory out{.robot = robot.id, .kind = kind, .points = {}};
  const HistoryRange range = robot.history.range(from, to);
  if (kind == PoseKind::smoothed) {
    add_smoothed(robot, range, out.points);
    return out;
  }
  for (std::size_t i = range.first; i < range.last; ++i) {
    const HistoryEntry& entry = robot.history[i];
    if (kind == PoseKind::measured && entry.measured) {
      const Observation& seen = *entry.measured;
      out.points.push_back(point(entry, kind,
                                 {.at = entry.captured,
                                  .pose = seen.pose,
                                  .covariance = seen.covariance + seen.correlated,
                                  .velocity = {}}));
    } else if (kind == PoseKind::filtered && entry.filtered) {
      out.points.push_back(point(entry, kind, *entry.filtered));
    }
  }
  return out;
}

void write_csv_header(std::ostream& out) {
  out << "robot,captured,kind,state,source,x,y,yaw,vx,vy,yaw_rate,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_"
         "yawyaw,score\n";
}

void write_csv_rows(std::ostream& out, const Trajectory& trajectory) {
  for (const TrajectoryPoint& p : trajectory.points) {
    out << trajectory.robot << ',' << time_text(p.captured) << ',' << skylight::to_string(trajectory.kind)
        << ',' << skylight::to_string(p.state) << ',' << skylight::to_string(p.source);
    for (const double value :
         {p.pose.x, p.pose.y, p.pose.yaw, p.velocity.x, p.velocity.y, p.velocity.yaw_rate, p.covariance(0, 0),
          p.covariance(0, 1), p.covariance(0, 2), p.covariance(1, 1), p.covariance(1, 2), p.covariance(2, 2),
          p.score}) {
      out << ',' << text(value);
    }
    out << '\n';
  }
}

void write_trajectory(std::ostream& out, const Trajectory& trajectory, TrajectoryFormat format) {
  switch (format) {
    case TrajectoryFormat::csv:
      write_csv_header(out);
      write_csv_rows(out, trajectory);
      return;
    case TrajectoryFormat::tum:
      for (const TrajectoryPoint& p : trajectory.points) {
        out << time_text(p.captured) << ' ' << text(p.pose.x) << ' ' << text(p.pose.y) << " 0 0 0 "
            << text(std::sin(p.pose.yaw / 2)) << ' ' << text(std::cos(p.pose.yaw / 2)) << '\n';
      }
      return;
    case TrajectoryFormat::json: {
      Json points = Json::array();
      for (const TrajectoryPoint& p : trajectory.points) points.push_back(point_json(p, trajectory.kind));
      out << Json{{"robot", trajectory.robot},
                  {"kind", skylight::to_string(trajectory.kind)},
                  {"points", std::move(points)}}
                 .dump()
          << '\n';
      return;
    }
  }
}

}  // namespace skylight::service
