// Trajectories as people and other programs read them: CSV, TUM and JSON.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracker/tracker.hpp"

namespace skylight::service {

enum class TrajectoryFormat : std::uint8_t { csv, tum, json };

std::optional<TrajectoryFormat> trajectory_format(std::string_view name);  ///< "csv", "tum", "json"

struct TrajectoryPoint {
  Time captured{};
  TrackState state = TrackState::searching;
  PoseSource source = PoseSource::prediction;
  Pose2 pose;
  Covariance3 covariance = Covariance3::Identity();
  Velocity2 velocity;  ///< 0 where measured
  double score = 0.0;  ///< 0 where source is `prediction`
};

struct Trajectory {
  std::string robot;
  PoseKind kind = PoseKind::filtered;
  std::vector<TrajectoryPoint> points;
};

/// The poses of one kind (measured, filtered, smoothed) with from <= captured <= to; instants without such a
/// pose are left out. Of the smoothed ones the last are those that later frames may still change.
Trajectory make_trajectory(const RobotView& robot, PoseKind kind, Time from, Time to);

/// csv: a header line, then a line per pose: robot,captured,kind,state,source,x,y,yaw,vx,vy,yaw_rate,
///      cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,score (metres, radians, Unix seconds).
/// tum: `t x y z qx qy qz qw` per line, z = 0.
/// json: one object {robot, kind, points: [...]}.
void write_trajectory(std::ostream& out, const Trajectory& trajectory, TrajectoryFormat format);
/// The header line of csv, for files that hold several robots.
void write_csv_header(std::ostream& out);
void write_csv_rows(std::ostream& out, const Trajectory& trajectory);

}  // namespace skylight::service
