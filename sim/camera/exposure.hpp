// What each row of a frame is exposed with: when, how bright the room is then, and how the camera sets
// itself.
//
// Flicker: the lamps' light is 1 + depth sin(2 pi f t), t from the scenario's start. A row that is exposed
// for T around t sees its mean, 1 + depth sinc(f T) sin(2 pi f t) with sinc(x) = sin(pi x) / (pi x): an
// exposure of whole periods sees none. Under a rolling shutter each row has its own t, so that the picture
// has bands.
//
// Auto-exposure: the camera judges the mean grey of every picture that it took; the logarithm of its factor
// goes towards the target's by a first-order lag. It brightens by its gain, which makes the noise stronger
// with the signal, and darkens by exposing for a shorter time, which takes photons (the blur stays as it
// was).
#pragma once

#include <functional>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "sim/camera/noise.hpp"
#include "sim/scenario/camera.hpp"
#include "sim/scenario/room.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

class ExposureControl {
 public:
  ExposureControl(const CameraSpec& camera, const FlickerSpec& flicker);

  /// Level of the room's light, a factor, at a time from the scenario's start.
  using Level = std::function<double(Duration)>;

  /// One for each row of the frame whose exposure's midpoint (the middle row's, under a rolling shutter) is
  /// so long after the scenario's start.
  std::vector<RowLight> rows(Duration middle, const Level& level) const;

  /// The picture that the camera gave, CV_8UC3; the next ones are exposed accordingly. dt: since the one
  /// before, 0 or more.
  void observe(const cv::Mat& image, Duration dt);
  /// How many times brighter than its exposure and gain say the camera makes the picture.
  double factor() const { return factor_; }

 private:
  RowLight light(Duration row_middle, const Level& level) const;

  CameraSpec camera_;
  FlickerSpec flicker_;
  double factor_ = 1.0;
};

/// When a row is in the middle of its exposure, from the middle of the frame's: 0 for a global shutter, from
/// -readout_s / 2 in the first row to +readout_s / 2 in the last of a rolling one.
Duration row_delay(const CameraSpec& camera, double row);

}  // namespace skylight::sim
