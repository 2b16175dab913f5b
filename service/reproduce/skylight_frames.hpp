// What Skylight's own detector sees along routes, at the camera's full rate: the other half of the
// experiments.
//
// The scenarios as they are shipped, 1920 x 1080 px and 30 frames/s, all picture effects at their defaults,
// without depth, which this detector does not use. Each frame is looked at by two trackers that know where
// nothing is at first:
//
//   true        with the camera as it is: the detector alone
//   calibrated  with a camera as a calibration leaves it: lens and pose wrong together, so that points of the
//               floor move by kCalibrationRms over the room (evaluation/camera_error.hpp); each seed of a
//               route has a calibration of its own
#pragma once

#include <string>
#include <vector>

#include "service/reproduce/jobs.hpp"
#include "service/reproduce/observed_run.hpp"
#include "service/sources/simulator.hpp"

namespace skylight::service::reproduce {

inline constexpr double kCalibrationRms = 0.0015;  ///< m

struct SkylightPlan {
  std::string folder = "paper";  ///< of the scenarios
  std::vector<std::string> routes;
  int seeds = 10;                    ///< of each route: 1, 2, ...
  std::vector<std::string> changes;  ///< over the scenario, `key.path=value`
  double at_most_s = 0.0;            ///< a run is cut off there; 0: whole routes
};

/// What the trackers see of a scenario's first robot by its first camera, and what the robot's wheels say.
/// Throws as SimulatorFrames.
ObservedRun skylight_run(const ScenarioRun& scenario, const std::string& route);

/// One job for each seed and route: all routes once, then again. Throws SourceError or settings::Error.
std::vector<Job> skylight_jobs(const SkylightPlan& plan);

}  // namespace skylight::service::reproduce
