// The paper's window filter (Kononov et al., section 4, Eqs. 1-3; figures 4 and 5), in its closed form.
#pragma once

#include <deque>
#include <string>

#include "tracker/filter/filter.hpp"

namespace skylight {

/// Frame counts are in frames, whatever their rate: state the rate with every figure.
struct WindowFilterConfig {
  int window_size = 12;            ///< positions in the buffer, 2 to 1000
  double alpha = 0.3;              ///< gate: largest distance from the prediction, metres, > 0 to 100
  int calibration_threshold = 3;   ///< detections before calibration starts, 0 to 1000
  int frame_loss_threshold = 30;   ///< frames without an accepted position until calibration is cancelled, 1 to 100000
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const WindowFilterConfig& config);

/// State: a buffer of window_size positions, a predicted position, two counters. The paper filters x and y
/// only; yaw passes through from the last accepted observation.
class WindowFilter final : public Filter {
 public:
  /// Throws std::invalid_argument with check()'s message.
  explicit WindowFilter(const WindowFilterConfig& config = {});

  FilterStep update(Time captured, const std::optional<Observation>& observation) override;
  std::optional<Estimate> predict(Time at) const override;
  void reset() override;

 private:
  // (left to the implementation)
};

}  // namespace skylight
