#include "service/pose_query.hpp"

#include <cmath>
#include <cstdio>

#include "service/camera_doubt.hpp"

namespace skylight::service {
namespace {

std::string seconds_text(double seconds) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6f", seconds);
  return text;
}

std::string why_no_pose(const RobotSnapshot& robot, TrackState state) {
  if (!robot.view.reason.empty()) return std::string(robot.view.reason);
  if (state == TrackState::calibrating) return "the filter is calibrating";
  if (state == TrackState::searching) return "just found, the filter has not begun to calibrate";
  return "the filter has no pose";
}

std::vector<std::string> camera_names(const Snapshot& snapshot, CameraSet cameras) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < snapshot.cameras.size(); ++i) {
    if ((cameras & camera_bit(i)) != 0) names.push_back(snapshot.cameras[i].id);
  }
  return names;
}

PublishedPose published(const Snapshot& snapshot, const HistoryPose& pose) {
  return {.kind = pose.kind,
          .source = pose.source,
          .estimate = pose.estimate,
          .captured = pose.captured,
          .horizon = {},
          .cameras = camera_names(snapshot, pose.estimate.cameras),
          .score = pose.score,
          .heading_turns = pose.heading_turns};
}

// The newest entry at or before an instant within the history.
const HistoryEntry& entry_at(const HistoryView& history, Time at) {
  const HistoryRange range = history.range(history.oldest().captured, at);
  return history[range.last - 1];
}

// A smoothed pose that later frames may still change: the filter knows it, the history what it came from.
HistoryAnswer unsettled(const RobotSnapshot& robot, Time at) {
  HistoryAnswer out = robot.view.history.pose(PoseKind::filtered, at);
  const auto smoothed = robot.view.filter->smoothed(at);
  if (!out.pose || !smoothed) return {.lookup = HistoryLookup::no_pose, .pose = {}};
  out.pose->kind = PoseKind::smoothed;
  out.pose->estimate = *smoothed;
  return out;
}

HistoryAnswer past_pose(const RobotSnapshot& robot, PoseKind kind, Time at) {
  HistoryAnswer found = robot.view.history.pose(kind, at);
  if (kind == PoseKind::smoothed && found.lookup == HistoryLookup::after_history && robot.view.filter)
    found = unsettled(robot, at);
  return found;
}

void look_up(const Snapshot& snapshot, const RobotSnapshot& robot, PoseKind kind, Time at, PoseAnswer& out) {
  const HistoryAnswer found = past_pose(robot, kind, at);
  if (found.lookup == HistoryLookup::before_history) {
    throw QueryError("at is " + seconds_text(unix_seconds(at)) +
                     ", before the oldest instant that is kept, " +
                     seconds_text(unix_seconds(robot.view.history.oldest().captured)));
  }
  const HistoryEntry& entry = entry_at(robot.view.history, at);
  out.state = entry.state;
  if (found.pose) {
    out.pose = published(snapshot, *found.pose);
  } else if (kind == PoseKind::measured) {
    out.reason = "the robot was not observed at that instant";
  } else {
    out.reason = "the filter had no pose at that instant (" + std::string(to_string(entry.state)) + ")";
  }
}

void predict(const Snapshot& snapshot, const RobotSnapshot& robot, Time at, const QueryContext& context,
             PoseAnswer& out) {
  const Time newest = robot.view.history.newest().captured;
  if (at - newest > context.horizon) {
    throw QueryError("at is " + seconds_text(unix_seconds(at)) + ", beyond the horizon of " +
                     seconds_text(to_seconds(context.horizon)) + " s after the newest frame at " +
                     seconds_text(unix_seconds(newest)));
  }
  const auto estimate = robot.view.filter ? robot.view.filter->predict(at) : std::nullopt;
  if (!estimate) {
    out.reason = why_no_pose(robot, out.state);
    return;
  }
  const HistoryAnswer basis = robot.view.history.pose(PoseKind::filtered, newest);
  out.pose = basis.pose ? published(snapshot, *basis.pose) : PublishedPose{.estimate = {}, .cameras = {}};
  out.pose->kind = PoseKind::predicted;
  out.pose->source = PoseSource::prediction;
  out.pose->estimate = *estimate;
  out.pose->cameras = camera_names(snapshot, estimate->cameras);
  out.pose->captured = newest;
  out.pose->horizon = at - newest;
}

// What the newest frame says.
void newest(const Snapshot& snapshot, const RobotSnapshot& robot, PoseKind kind, PoseAnswer& out) {
  const HistoryEntry& entry = robot.view.history.newest();
  if (kind == PoseKind::measured && !entry.measured) {
    out.reason = why_no_pose(robot, out.state);
    return;
  }
  const HistoryAnswer found = past_pose(robot, kind, entry.captured);
  if (found.pose) {
    out.pose = published(snapshot, *found.pose);
  } else {
    out.reason = why_no_pose(robot, out.state);
  }
}

bool stale(const Snapshot& snapshot, const RobotSnapshot& robot, const QueryContext& context,
           PoseAnswer& out) {
  const Duration age = context.now - robot.view.history.newest().captured;
  if (age <= context.horizon) return false;
  out.state = TrackState::lost;
  char text[80];
  std::snprintf(text, sizeof text, "the newest frame is %.1f s old", to_seconds(age));
  out.reason = text;
  if (snapshot.source == SourceState::ended) out.reason += ": the source has ended";
  if (snapshot.source == SourceState::failed) out.reason += ": " + snapshot.source_error;
  return true;
}

}  // namespace

double unix_seconds(Time time) {
  return static_cast<double>(std::chrono::round<std::chrono::microseconds>(time.time_since_epoch()).count()) /
         1e6;
}

Time from_unix_seconds(double seconds) {
  return Time(std::chrono::duration_cast<Duration>(std::chrono::microseconds(std::llround(seconds * 1e6))));
}

namespace {

PoseAnswer without_warnings(const Snapshot& snapshot, const RobotSnapshot& robot, const PoseQuery& query,
                            const QueryContext& context) {
  PoseAnswer out{
      .robot = robot.view.id, .state = robot.view.state, .reason = {}, .last_seen = {}, .pose = {}};
  out.identity_confidence = 1.0 / robot.copies;
  if (robot.view.last_measured) out.last_seen = robot.view.last_measured->captured;
  if (query.kind == PoseKind::smoothed && robot.view.filter &&
      robot.view.filter->smoothing_lag() <= Duration::zero()) {
    throw QueryError(
        "kind is smoothed: this robot's filter has no smoother, allowed measured, filtered, predicted");
  }
  if (robot.view.history.empty()) {
    out.reason = snapshot.source == SourceState::failed ? snapshot.source_error : "no frame yet";
    return out;
  }
  const Time last = robot.view.history.newest().captured;
  const PoseKind past = query.kind.value_or(PoseKind::filtered);
  if (!query.at) {
    if (stale(snapshot, robot, context, out)) return out;
    if (past == PoseKind::predicted) {
      predict(snapshot, robot, std::max(context.now, last), context, out);
    } else {
      newest(snapshot, robot, past, out);
    }
    return out;
  }
  if (*query.at > last) {
    if (query.kind == PoseKind::measured || query.kind == PoseKind::smoothed) {
      throw QueryError("kind is " + std::string(to_string(*query.kind)) +
                       ", but at is after the newest frame at " + seconds_text(unix_seconds(last)));
    }
    predict(snapshot, robot, *query.at, context, out);
  } else if (query.kind == PoseKind::predicted) {
    throw QueryError("kind is predicted, but at is not after the newest frame at " +
                     seconds_text(unix_seconds(last)));
  } else {
    look_up(snapshot, robot, past, *query.at, out);
  }
  return out;
}

}  // namespace

PoseAnswer answer(const Snapshot& snapshot, const RobotSnapshot& robot, const PoseQuery& query,
                  const QueryContext& context) {
  PoseAnswer out = without_warnings(snapshot, robot, query, context);
  if (!out.pose) return out;
  for (const std::string& id : out.pose->cameras) {
    const CameraSnapshot* camera = snapshot.camera(id);
    std::string warning = camera != nullptr ? warning_of(*camera, out.pose->captured) : "";
    if (!warning.empty()) out.pose->warnings.push_back(std::move(warning));
  }
  return out;
}

}  // namespace skylight::service
