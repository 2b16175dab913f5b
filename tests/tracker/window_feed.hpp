// Feeds a window filter frame by frame, at a steady rate.
#pragma once

#include <chrono>

#include "tracker/filter/window.hpp"

namespace skylight::test {

class WindowFeed {
 public:
  explicit WindowFeed(const WindowFilterConfig& config, double rate_hz = 30.0)
      : filter_(config), interval_(from_seconds(1.0 / rate_hz)) {}

  FilterStep at(double x, double y = 0.0, double yaw = 0.0, double sigma = 0.01) {
    Observation observation;
    observation.pose = {x, y, yaw};
    observation.covariance = Eigen::Vector3d(sigma * sigma, sigma * sigma, 1e-4).asDiagonal();
    return with(observation);
  }
  FilterStep with(Observation observation) {
    now_ += interval_;
    observation.captured = now_;
    return filter_.update(now_, observation);
  }
  FilterStep nothing() {
    now_ += interval_;
    return filter_.update(now_, std::nullopt);
  }
  /// Past calibration, standing at x = 0.
  FilterStep settle() {
    FilterStep step;
    for (int i = 0; i < 400 && step.state != TrackState::tracking; ++i) step = at(0.0);
    return step;
  }
  WindowFilter& filter() { return filter_; }
  Time now() const { return now_; }
  Duration interval() const { return interval_; }

 private:
  WindowFilter filter_;
  Duration interval_;
  Time now_{std::chrono::seconds(1'700'000'000)};
};

}  // namespace skylight::test
