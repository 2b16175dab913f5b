// What a tracker asks of a filter. Implementations: window (the paper's).
#pragma once

#include <optional>

#include "tracker/types.hpp"

namespace skylight {

/// What one frame did to a filter.
struct FilterStep {
  TrackState state = TrackState::searching;
  std::optional<Estimate> estimate;  ///< none while searching, calibrating or lost
  bool accepted = false;             ///< the observation passed the gate
};

class Filter {
 public:
  virtual ~Filter() = default;

  /// One frame: its capture time, and what was observed in it (none: not detected). Times must not go
  /// back; a frame that is not later than the one before is ignored (the last step is returned).
  virtual FilterStep update(Time captured, const std::optional<Observation>& observation) = 0;

  /// The state carried to `at`, covariance growing with the distance in time. None while there is no
  /// estimate, and for instants before the last update.
  virtual std::optional<Estimate> predict(Time at) const = 0;

  /// Forgets everything: state `searching`.
  virtual void reset() = 0;
};

}  // namespace skylight
