// A camera of a scenario: where it hangs, its lens, its sensor and what delays its frames.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace skylight::sim {

/// brown_conrady: pinhole with distortion k1 k2 p1 p2 k3; kannala_brandt: fisheye with k1 k2 k3 k4.
enum class Lens : std::uint8_t { brown_conrady, kannala_brandt };

/// Photon-transfer curve: at a mean of g grey levels, variance = gain_dn_per_e * g + (read noise in grey
/// levels)^2, with gain_dn_per_e = 255 * gain / full_well_e (EMVA Standard 1288, release 3.1, section 2.3).
struct SensorSpec {
  bool noise = true;
  double full_well_e = 14600.0;  ///< Sony IMX290 at 0 dB: 3.584 e- per 12-bit step (ZWO ASI290MM)
  double read_noise_e = 3.2;     ///< the same camera at 0 dB
  double gain = 1.0;             ///< analogue gain: full scale is full_well_e / gain electrons
};

/// The camera's own control of its gain. Each frame is judged by its mean grey; the next ones are brought
/// towards the target by a first-order lag, so that a change of light shows for a while.
struct AutoExposureSpec {
  bool enabled = false;
  double target_grey = 110.0;
  double lag_s = 0.3;       ///< time constant
  double max_factor = 8.0;  ///< it brightens at most so much and darkens at most to its reciprocal
};

enum class DepthModel : std::uint8_t { structured_light, stereo, time_of_flight };

/// structured_light: standard deviation = floor + growth * (z - 0.4 m)^2 (Nguyen, Izadi and Lovell, "Modeling
/// Kinect Sensor Noise for Improved 3D Reconstruction and Tracking", 3DIMPVT 2012, eq. 2). stereo: floor +
/// growth * z^2, disparity steps. time_of_flight: floor + growth * z.
struct DepthSpec {
  bool enabled = false;
  bool noise = true;
  DepthModel model = DepthModel::structured_light;
  std::optional<double> noise_floor_m;  ///< absent: the model's, from its data sheet
  std::optional<double> noise_growth;   ///< absent: the model's; unit by the model
  double step_mm = 1.0;                 ///< smallest difference of two readings at 1 m
  double holes =
      1.0;  ///< how far readings are missing beside edges: factor on the model's shadow width, 0: none
  double max_range_m = 10.0;  ///< no reading (0) beyond
};

enum class Shutter : std::uint8_t { global, rolling };

/// What the way from sensor to program does to frames.
struct DeliverySpec {
  double latency_s = 0.0;       ///< from the end of the exposure to the program
  double jitter_s = 0.0;        ///< further delay, 0 to this, evenly spread; frames never overtake each other
  double drop_share = 0.0;      ///< share of frames that are lost, at random
  double clock_offset_s = 0.0;  ///< of the camera's time stamps: stamp - true time
  double clock_drift_ppm = 0.0;     ///< the stamps run fast by so much
  std::optional<int> jpeg_quality;  ///< 1 to 100; absent: not compressed
};

struct CameraSpec {
  std::string id = "ceiling";
  std::array<double, 3> position_m{0.0, 0.0, 4.0};
  /// Roll, pitch, yaw (about fixed map x, y, z, in this order) away from a camera that looks straight down
  /// with its image's right side towards map x.
  std::array<double, 3> rpy_deg{0.0, 0.0, 0.0};
  int width_px = 1920;
  int height_px = 1080;
  Lens lens = Lens::brown_conrady;
  double fx_px = 700.0;
  double fy_px = 700.0;
  std::optional<double> cx_px;  ///< absent: (width_px - 1) / 2
  std::optional<double> cy_px;  ///< absent: (height_px - 1) / 2
  /// brown_conrady: k1 k2 p1 p2 k3; kannala_brandt: k1 k2 k3 k4 (the fifth unused).
  std::array<double, 5> distortion{-0.045, 0.010, 0.0004, -0.0003, 0.0};
  double frame_rate_hz = 30.0;
  double exposure_s = 0.008;
  Shutter shutter = Shutter::global;
  double readout_s = 0.015;    ///< rolling: from the first row's exposure to the last row's
  double first_frame_s = 0.0;  ///< start of the first exposure after the scenario's start
  double vignetting = 0.15;    ///< share of light missing in the corners of the picture
  SensorSpec sensor;
  AutoExposureSpec auto_exposure;
  DepthSpec depth;
  DeliverySpec delivery;
};

}  // namespace skylight::sim
