#include "tracker/filter/motion_config.hpp"

#include <array>
#include <cmath>
#include <sstream>

namespace skylight {
namespace {

struct Range {
  const char* name;
  double value;
  double low;
  double high;
};

}  // namespace

std::string check(const MotionFilterConfig& c) {
  const std::array ranges{
      Range{"max_speed_mps", c.max_speed_mps, 0.01, 50.0},
      Range{"max_accel_mps2", c.max_accel_mps2, 0.01, 100.0},
      Range{"max_yaw_rate_radps", c.max_yaw_rate_radps, 0.01, 100.0},
      Range{"max_yaw_accel_radps2", c.max_yaw_accel_radps2, 0.01, 1000.0},
      Range{"manoeuvre_every_s", c.manoeuvre_every_s, 0.1, 1000.0},
      Range{"observation_bias_m", c.observation_bias_m, 0.0, 1.0},
      Range{"observation_bias_rad", c.observation_bias_rad, 0.0, 1.0},
      Range{"bias_time_s", c.bias_time_s, 0.01, 1000.0},
      Range{"max_noise_scale", c.max_noise_scale, 1.0, 100.0},
      Range{"gate", c.gate, 1.0, 1000.0},
      Range{"entry_bias_m", c.entry_bias_m, 0.0, 1.0},
      Range{"entry_s", c.entry_s, 0.0, 2.0},
      Range{"calibration_observations", static_cast<double>(c.calibration_observations), 1.0, 100.0},
      Range{"reacquire_observations", static_cast<double>(c.reacquire_observations), 2.0, 1000.0},
      Range{"max_gap_s", c.max_gap_s, 0.1, 1000.0},
      Range{"max_sigma_m", c.max_sigma_m, 0.001, 100.0},
      Range{"smoothing_lag_s", c.smoothing_lag_s, 0.0, 10.0},
  };
  for (const Range& r : ranges) {
    if (r.value >= r.low && r.value <= r.high) continue;
    std::ostringstream out;
    out << r.name << " is " << r.value << ", must lie in [" << r.low << ", " << r.high << "]";
    return out.str();
  }
  return {};
}

namespace motion {
namespace {

/// An Ornstein-Uhlenbeck velocity of this spread.
VelocityNoise held_to_zero(double sigma, double tau) {
  return {.density = 2.0 * sigma * sigma / tau, .pull = 1.0 / tau};
}

VelocityNoise wandering(double change_per_root_second) {
  return {.density = change_per_root_second * change_per_root_second, .pull = 0.0};
}

}  // namespace

ModelBank model_bank(const MotionFilterConfig& c) {
  // What wheels let through sideways: a point beside the turning axis, a little slip.
  const VelocityNoise slip = held_to_zero(0.0025, 0.15);
  // A change of speed is over in about this time, a change of turn in longer: white accelerations that come
  // to the same change as the greatest one held for that long.
  constexpr double kSpeedChange = 0.065;  // s
  constexpr double kTurnChange = 0.43;    // s
  const VelocityNoise strong = wandering(c.max_accel_mps2 * std::sqrt(kSpeedChange));
  const VelocityNoise strong_turn = wandering(c.max_yaw_accel_radps2 * std::sqrt(kTurnChange));

  ModelBank bank;
  bank.model[kStanding].stands = true;
  bank.model[kSteady] = {.forward = wandering(0.004), .sideways = slip, .turning = wandering(0.003)};
  bank.model[kAdjusting] = {.forward = wandering(0.0065), .sideways = slip, .turning = wandering(0.015)};
  bank.model[kManoeuvring] = {.forward = strong, .sideways = slip, .turning = strong_turn};
  bank.model[kSideways] = {.forward = strong, .sideways = strong, .turning = strong_turn};
  if (c.holonomic) {
    for (const std::size_t m : {kSteady, kAdjusting, kManoeuvring})
      bank.model[m].sideways = bank.model[m].forward;
  }
  for (MotionModel& model : bank.model) {
    model.place_walk = 2.0 * c.observation_bias_m * c.observation_bias_m / c.bias_time_s;
    model.yaw_walk = 2.0 * c.observation_bias_rad * c.observation_bias_rad / c.bias_time_s;
  }
  // The longer it has gone steadily, the longer it will: steady is entered through adjusting, and seldom
  // left.
  const double often = 1.0 / c.manoeuvre_every_s;
  bank.leave_rate = {3.0 * often, 0.1 * often, 1.6 * often, 0.6, 2.0};
  bank.share = {{{0.00, 0.05, 0.05, 0.89, 0.01},
                 {0.15, 0.00, 0.74, 0.10, 0.01},
                 {0.01, 0.28, 0.00, 0.70, 0.01},
                 {0.26, 0.04, 0.69, 0.00, 0.01},
                 {0.20, 0.20, 0.30, 0.30, 0.00}}};
  return bank;
}

ModelBank bank_ahead(const MotionFilterConfig& c) {
  ModelBank bank = model_bank(c);
  const double often = 1.0 / c.manoeuvre_every_s;
  bank.leave_rate = {often, often, often, 2.0, 2.0};
  bank.share = {{{0.00, 0.02, 0.03, 0.94, 0.01},
                 {0.03, 0.00, 0.02, 0.94, 0.01},
                 {0.03, 0.02, 0.00, 0.94, 0.01},
                 {0.10, 0.05, 0.84, 0.00, 0.01},
                 {0.20, 0.20, 0.30, 0.30, 0.00}}};
  return bank;
}

}  // namespace motion
}  // namespace skylight
