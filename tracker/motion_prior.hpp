// Where to look next: the last observation carried on at its velocity. Not a filter: it serves the
// detector alone, so that a slow or refused filter never makes the detector look in the wrong place.
// Each camera has its own last observation, for what lies between two cameras is no motion.
#pragma once

#include <optional>
#include <vector>

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
  /// A place that someone told; believed like an observation of every camera's.
  void place(const Pose2& pose, Time at);
  void forget() { seen_.clear(); }

  /// Where `camera` is to look: from its own last observation, where others have none that is clearly newer.
  /// None where nothing is known, or nothing recent enough.
  std::optional<Prior> at(Time time, std::size_t camera) const;
  bool empty() const { return seen_.empty(); }

 private:
  struct Seen {
    std::size_t camera = 0;
    Pose2 pose;
    Time at{};
    std::optional<Velocity2> velocity{};
  };

  MotionPriorConfig config_;
  std::vector<Seen> seen_;  ///< one per camera, the newest last
};

}  // namespace skylight
