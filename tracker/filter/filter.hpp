// What a tracker asks of a filter. Implementations: motion (the default), window (the paper's).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "tracker/types.hpp"

namespace skylight {

/// What one frame did to a filter.
struct FilterStep {
  TrackState state = TrackState::searching;
  std::optional<Estimate> estimate;  ///< none while searching, calibrating or lost
  bool accepted = false;             ///< the observation passed the gate
};

/// Where one camera sees a robot, against what all others that see it say together.
struct CameraOpinion {
  std::size_t camera = 0;
  Eigen::Vector2d off_m{0.0, 0.0};  ///< in `map`; zero where no other camera sees it
  double sigmas = 0.0;              ///< that, over what their calibrations allow (Mahalanobis)
  int refused = 0;                  ///< how many of its observations in a row were not believed
};

class Filter {
 public:
  virtual ~Filter() = default;

  /// One frame: its capture time, and what was observed in it (none: not detected). The step tells of the
  /// newest instant. A frame that came late is taken in at its own time where the filter can (up to
  /// smoothing_lag() behind the newest), else ignored.
  virtual FilterStep update(Time captured, const std::optional<Observation>& observation) = 0;

  /// What the robot says of its motion, at its own time. True where it was used.
  virtual bool odometry(const BodyVelocity& velocity) = 0;

  /// The state carried to `at`, covariance growing with the distance in time. None while there is no
  /// estimate, and for instants before the last update.
  virtual std::optional<Estimate> predict(Time at) const = 0;

  /// How much later data a smoothed estimate waits for until it is final; 0: this filter does not smooth.
  virtual Duration smoothing_lag() const = 0;

  /// The estimate for an instant with all later data used; none where the robot was not known then, and for
  /// instants further back than 1.5 smoothing_lag() or after the newest. At the newest it is the filtered
  /// one.
  virtual std::optional<Estimate> smoothed(Time at) const = 0;

  /// The same for every instant from `from` on at which something was told, in order of time: one pass
  /// where smoothed() takes one for each.
  virtual std::vector<Estimate> smoothed_from(Time from) const = 0;

  /// Of the cameras that saw the robot just now, where there is more than one; a filter that follows no
  /// offsets between cameras has none.
  virtual std::vector<CameraOpinion> opinions() const { return {}; }

  /// A camera was calibrated anew: what was known of it is of another camera.
  virtual void forget_camera(std::size_t camera) { static_cast<void>(camera); }

  /// Forgets everything: state `searching`.
  virtual void reset() = 0;

  /// An independent copy, for other threads to read.
  virtual std::unique_ptr<Filter> clone() const = 0;
};

}  // namespace skylight
