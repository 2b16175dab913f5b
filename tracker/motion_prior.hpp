// Where to look next: the last observation carried on at its velocity. Not a filter: it serves the
// detector alone, so that a slow or refused filter never makes the detector look in the wrong place.
#pragma once

#include <optional>

#include "tracker/detect/orb_detector.hpp"

namespace skylight {

struct MotionPriorConfig {
  double max_speed = 1.5;                   ///< m/s: how fast the place to search grows, > 0
  double max_yaw_rate = 6.0;                ///< rad/s: a faster turn is not carried on
  Duration keep = std::chrono::seconds(1);  ///< after this without an observation the whole floor is searched
  Duration carry_on = std::chrono::milliseconds(300);  ///< how long the velocity is believed
};

class MotionPrior {
 public:
  explicit MotionPrior(const MotionPriorConfig& config = {}) : config_(config) {}

  void observe(const Observation& observation);
  /// A place that someone told; believed like an observation.
  void place(const Pose2& pose, Time at);
  void forget() { last_.reset(); }

  /// None where nothing is known, or nothing recent enough.
  std::optional<Prior> at(Time time) const;
  const std::optional<Pose2>& last() const { return last_; }

 private:
  MotionPriorConfig config_;
  std::optional<Pose2> last_;
  Time last_time_{};
  Velocity2 velocity_;
};

}  // namespace skylight
