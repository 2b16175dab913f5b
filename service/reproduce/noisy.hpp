// Observed runs with other errors: what a smoother is worth depends on whether errors change from frame to
// frame or last.
#pragma once

#include <string_view>

#include "service/reproduce/replay.hpp"

namespace skylight::service::reproduce {

/// Of the size that the paper tells of its detections: mean distance 0.1 m (0.1 / sqrt(pi / 2) per axis),
/// none in 20 % of the frames.
struct WhiteNoise {
  double sigma_m = 0.0797885;    ///< per axis
  double sigma_rad = 0.1745329;  ///< 10 degrees
  double missed = 0.2;           ///< share of the frames, 0 to 1
};

/// Where the robots of `runs` truly were, `rate_hz` times a second (which must divide the runs' own rate), as
/// a detector with such errors sees it: variant "noisy", its covariance the truth. The run's seed is the
/// noise's.
Runs noisy(const Runs& runs, double rate_hz, const WhiteNoise& noise = {});

/// By how much the depth of a `vertical` variant of paper_run() is wrong on average, m: what fits the errors
/// of all runs best, by least squares. A point that is seen too deep lands further out, by its share of the
/// distance between camera and picture. 0 where nothing was seen.
double depth_error(const Runs& runs, std::string_view variant);
/// The runs as with depths that are that much shorter.
Runs without_depth_error(Runs runs, std::string_view variant, double error_m);

}  // namespace skylight::service::reproduce
