// Observed runs through a filter, scored by kind of pose: what `skylight evaluate` would print for them, from
// runs that are kept.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "service/reproduce/replay.hpp"
#include "tracker/metrics.hpp"

namespace skylight::service::reproduce {

struct ScoreOptions {
  FilterMaker filter;
  std::string variant;
  bool odometry = false;  ///< the filter hears what the robot's wheels say
  double ahead_s = 0.5;   ///< how far ahead `predicted` is
  bool smoothed = true;   ///< false: no smoothed poses, which cost more than all the rest
};

/// One run's frames, or several runs' pooled.
struct KindMetrics {
  RobotMetrics measured, filtered, smoothed, predicted;
  void merge(const KindMetrics& other);
};

/// The filter over one run: `smoothed` as it stands once the filter's lag of later data is there (at the
/// run's end: all there is), `predicted` from what was known `ahead_s` before. Throws std::invalid_argument
/// where the run has no such variant.
KindMetrics score(const ObservedRun& run, const ScoreOptions& options);

/// Runs pooled, and the one with the largest error.
struct PooledScore {
  KindMetrics kinds;
  std::string worst_run;  ///< "chaotic-2, seed 7": the largest filtered error, or without any pose
  double worst_error_m = 0.0;
};
PooledScore pooled(const std::vector<const ObservedRun*>& runs, const ScoreOptions& options);

/// A robot that was not observed for a while, and where it was taken to be when it was seen again.
struct Reappearance {
  std::string route;
  std::uint64_t seed = 0;
  double hidden_s = 0.0;  ///< from the last observation to the next
  double error_m = 0.0;   ///< of the pose predicted for the frame in which it is seen again
  double stated_m = 0.0;  ///< what its covariance says of that: root of the sum over both axes
  bool lost = false;      ///< there was no pose
};
/// The gaps of at least `least_s`.
std::vector<Reappearance> reappearances(const ObservedRun& run, const ScoreOptions& options, double least_s);

/// How smoothed poses compare with filtered ones, each run's mean error vector taken off: of what a smoother
/// can do something about.
struct Smoothing {
  double filtered_m = 0.0;  ///< mean distance
  double smoothed_m = 0.0;
};
Smoothing smoothing(const std::vector<const ObservedRun*>& runs, const ScoreOptions& options);

/// Where errors come from: the mean error vector, forward and to the left of the robot, and what is left
/// about each run's mean.
struct ErrorParts {
  Eigen::Vector2d measured_bias_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d filtered_bias_m = Eigen::Vector2d::Zero();  ///< forward and negative: it lags
  double measured_scatter_m = 0.0;  ///< root mean square about each run's mean vector in `map`
  double measured_mean_m = 0.0;
  double filtered_mean_m = 0.0;
};
ErrorParts error_parts(const std::vector<const ObservedRun*>& runs, const ScoreOptions& options);

}  // namespace skylight::service::reproduce
