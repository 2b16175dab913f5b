// What detectors saw of one robot along one route: the ground on which the experiments stand. Rendering and
// detecting is dear and does not depend on filters, so it is done once and kept; every table and figure is a
// replay over these.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tracker/filter/measurements.hpp"
#include "tracker/types.hpp"

namespace skylight::service::reproduce {

struct ObservedFrame {
  Time captured{};
  Pose2 truth;                                   ///< of base_link at `captured`
  bool in_view = false;                          ///< the middle of the robot's top lies in the picture
  double visible = 1.0;                          ///< share of its top that the camera sees
  std::vector<std::optional<Observation>> seen;  ///< one for each of ObservedRun::variants
};

struct ObservedRun {
  std::string route;  ///< the scenario's name without its folder: "line-1"
  std::uint64_t seed = 0;
  double frame_rate_hz = 0.0;
  int width_px = 0;
  int height_px = 0;
  /// Ways in which the same frames were looked at: "vertical" and "ray" of the paper's pipeline, "true" and
  /// "calibrated" cameras of Skylight's detector.
  std::vector<std::string> variants;
  std::vector<ObservedFrame> frames;   ///< in order of time
  std::vector<BodyVelocity> odometry;  ///< in order of time; empty where the robot sends none
};

}  // namespace skylight::service::reproduce
