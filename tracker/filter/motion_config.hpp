// What a motion filter may be told about its robot and its detector; defaults chosen by
// tests/tracker/filter/filter_study.cpp, one tuning for every rate and noise.
#pragma once

#include <string>

#include "tracker/filter/imm.hpp"

namespace skylight {

struct MotionFilterConfig {
  // The robot.
  double max_speed_mps = 3.0;         ///< m/s, 0.01 to 50: faster is not believed
  double max_accel_mps2 = 2.5;        ///< m/s^2, 0.01 to 100: what a manoeuvre is made of
  double max_yaw_rate_radps = 10.0;   ///< rad/s, 0.01 to 100
  double max_yaw_accel_radps2 = 3.2;  ///< rad/s^2, 0.01 to 1000
  bool holonomic = false;  ///< drives sideways as well as forward; else sideways is slipping, being carried
  double manoeuvre_every_s = 4.0;  ///< s between changes of speed or turn, on average, 0.1 to 1000

  // The detector.
  double observation_bias_m = 0.0002;    ///< its slow error per axis, one sigma, m, 0 to 1
  double observation_bias_rad = 0.0003;  ///< the same of yaw, rad, 0 to 1
  double bias_time_s = 2.0;              ///< over which that becomes another one, s, 0.01 to 1000
  double max_noise_scale =
      10.0;  ///< how many times its claims its noise may be found to be, 1 to 100; 1: believed
  /// Largest squared Mahalanobis distance of a pose that is believed, 1 to 1000; 16.3 leaves out one of 1000.
  double gate = 16.3;
  /// A robot that is being covered is detected with an error that grows up to this (one sigma, m, 0 to 1) ...
  double entry_bias_m = 0.01;
  double entry_s = 0.5;  ///< ... over the last of these seconds before a gap, 0 to 2

  // The track.
  int calibration_observations = 3;  ///< in agreement until there is an estimate, 1 to 100
  int reacquire_observations = 8;    ///< refused ones in agreement until they are believed, 2 to 1000
  double max_gap_s = 5.0;            ///< without an accepted observation until lost, s, 0.1 to 1000
  double max_sigma_m = 1.0;      ///< position's standard deviation beyond which it is lost, m, 0.001 to 100
  double smoothing_lag_s = 1.0;  ///< how far back smoothed() and late observations reach, s, 0 to 10

  friend bool operator==(const MotionFilterConfig&, const MotionFilterConfig&) = default;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const MotionFilterConfig& config);

namespace motion {

/// The models, in this order.
enum Model : std::size_t { kStanding = 0, kSteady = 1, kAdjusting = 2, kManoeuvring = 3, kSideways = 4 };

/// For what is observed: slow to give up a model, because each switch is judged by what is seen.
ModelBank model_bank(const MotionFilterConfig& config);

/// For what is not observed, gaps and the time ahead: as robots really change their minds, else predictions
/// claim to know more than they do.
ModelBank bank_ahead(const MotionFilterConfig& config);

}  // namespace motion
}  // namespace skylight
