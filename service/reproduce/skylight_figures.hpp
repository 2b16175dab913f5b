// What Skylight's own runs come to: all figures of its half of the report, computed once.
#pragma once

#include <string>
#include <vector>

#include "service/reproduce/experiments.hpp"
#include "service/reproduce/scores.hpp"

namespace skylight::service::reproduce {

/// The routes with one camera. `all` pools linear and curved; its worst run is the worse of theirs.
struct RouteScores {
  PooledScore linear, curved, all;
};

/// Gaps of one path, pooled; means over those after which the robot was not lost.
struct Reappeared {
  std::size_t count = 0;
  std::size_t lost = 0;
  double hidden_s = 0.0;
  double mean_m = 0.0;
  double largest_m = 0.0;
  double stated_m = 0.0;  ///< mean of Reappearance::stated_m
};

struct BeamScore {
  std::string path;  ///< "line" or "arc"
  bool odometry = false;
  Reappeared reappeared;
};

/// Predicted poses with the true camera, the first two seeds of each route.
struct AheadScore {
  double ahead_s = 0.0;
  bool odometry = false;
  RobotScore line, circle, chaotic;
};

struct PartsScore {
  std::string name;
  ErrorParts parts;
};

/// What smoothing is worth to one detector.
struct SmoothingScore {
  std::string detector;
  Smoothing mean;

  double ratio() const { return mean.smoothed_m > 0.0 ? mean.filtered_m / mean.smoothed_m : 0.0; }
};

struct RouteScore {
  std::string route;
  RobotMetrics filtered;
};

struct SkylightFigures {
  RouteScores with_truth, with_calibration;
  std::vector<RouteScore> by_route;  ///< calibrated camera
  PooledScore chaotic;               ///< the chaotic routes, calibrated camera
  SmoothingScore white;              ///< white noise of the paper's size, at the full frame rate
  SmoothingScore paper;              ///< the paper's detections, straight down
  std::vector<SmoothingScore> other_smoothing;
  std::vector<BeamScore> beams;  ///< calibrated camera
  std::vector<AheadScore> ahead;
  std::vector<PartsScore> parts;
};

/// Throws std::invalid_argument where runs lack a variant.
SkylightFigures skylight_figures(const Gathered& gathered);

}  // namespace skylight::service::reproduce
