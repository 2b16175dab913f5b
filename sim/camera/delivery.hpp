// What the way from sensor to program does to frames: the camera's own clock, delays, losses, compression.
// All of it follows from (seed, camera, sequence).
#pragma once

#include <cstdint>

#include <opencv2/core/mat.hpp>

#include "sim/scenario/camera.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Times from the scenario's start.
struct Delivered {
  Duration stamp{};  ///< of the exposure's midpoint by the camera's clock
  Duration at{};     ///< when the program gets it, true time
  bool lost = false;
};

/// The frames of one camera, in order.
class Delivery {
 public:
  Delivery(const CameraSpec& camera, std::uint64_t seed, std::uint64_t camera_index);

  /// The frame with this number, whose exposure's midpoint (the middle row's) is at `middle`, true time. It
  /// arrives `latency_s` and 0 to `jitter_s` after the end of the last row's exposure, and never before one
  /// that was delivered earlier.
  Delivered deliver(std::uint64_t sequence, Duration middle);

 private:
  CameraSpec camera_;
  std::uint64_t stream_;
  Duration latest_ = Duration::min();
};

/// What is left of a picture (CV_8UC3) after a JPEG file of this quality, 1 to 100.
void compress(int quality, cv::Mat& image);

}  // namespace skylight::sim
