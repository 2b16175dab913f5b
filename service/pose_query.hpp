// "Where was, is, will robot r be?": answers from a snapshot.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "service/snapshot.hpp"

namespace skylight::service {

struct PoseQuery {
  std::optional<Time> at;        ///< none: now, which is the newest frame (or the present, for `predicted`)
  std::optional<PoseKind> kind;  ///< none: filtered; predicted for instants after the newest frame
};

/// What stands around a query.
struct QueryContext {
  Time now{};
  Duration horizon = std::chrono::seconds(2);  ///< how far a prediction may reach beyond the newest frame
};

/// A pose as it goes out.
struct PublishedPose {
  PoseKind kind = PoseKind::filtered;
  PoseSource source = PoseSource::prediction;
  Estimate estimate;
  Time captured{};     ///< of the newest frame that went into it
  Duration horizon{};  ///< from there to the pose's own instant; 0 unless predicted
  std::vector<std::string> cameras;
  double score = 0.0;
  int heading_turns = 1;
  std::vector<std::string> warnings{};  ///< why it may be worse than it looks, for people
};

/// A robot that is searched for or lost is no error: no pose, but state and reason.
struct PoseAnswer {
  std::string robot;
  TrackState state = TrackState::searching;
  std::string reason;             ///< why there is no pose; empty where there is one
  std::optional<Time> last_seen;  ///< when it was last observed
  std::optional<PublishedPose> pose;
  /// 1 where no other robot looks the same; among n copies that nothing tells apart 1 / n.
  double identity_confidence = 1.0;
};

/// A query that has no answer; what() says why, with the bound. (422 over HTTP.)
struct QueryError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// `smoothed` uses all that was told after that instant so far: once smoothing_lag() has passed it is final,
/// at the newest frame it is the filtered pose.
/// Throws QueryError: before the history (names the oldest instant), beyond the horizon, `measured` or
/// `smoothed` after the newest frame, `predicted` before it, `smoothed` where the robot's filter has no
/// smoother. A newest frame older than the horizon yields no pose: nothing stale looks fresh.
PoseAnswer answer(const Snapshot& snapshot, const RobotSnapshot& robot, const PoseQuery& query,
                  const QueryContext& context);

/// Unix seconds to the microsecond.
double unix_seconds(Time time);
Time from_unix_seconds(double seconds);

}  // namespace skylight::service
