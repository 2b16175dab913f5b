#include "service/trajectory.hpp"

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

Trajectory make_trajectory(const std::string& robot, const HistoryView& history, PoseKind kind, Time from,
                           Time to) {
  Trajectory out{.robot = robot, .kind = kind, .points = {}};
  const HistoryRange range = history.range(from, to);
  for (std::size_t i = range.first; i < range.last; ++i) {
    const HistoryEntry& entry = history[i];
    const double score = entry.measured ? entry.measured->score : 0.0;
    const PoseSource source = entry.measured ? entry.measured->source : PoseSource::prediction;
    if (kind == PoseKind::measured && entry.measured) {
      out.points.push_back(
          {entry.captured, entry.state, source, entry.measured->pose, entry.measured->covariance, {}, score});
    } else if (kind == PoseKind::filtered && entry.filtered) {
      const Estimate& e = *entry.filtered;
      const bool gap = entry.state == TrackState::predicting;
      out.points.push_back({entry.captured, entry.state, gap ? PoseSource::prediction : source, e.pose,
                            e.covariance, e.velocity, gap ? 0.0 : score});
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
