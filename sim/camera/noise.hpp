// Sensor noise, fresh in every frame and the same in every run: a counter-based generator gives each value of
// a frame its own random number from (seed, camera, sequence, place), so that threads and order do not
// matter.
#pragma once

#include <cstdint>
#include <span>

#include <opencv2/core/mat.hpp>

#include "sim/camera/noise_rows.hpp"
#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

/// Which random numbers: one stream per scenario seed, camera, kind and frame.
struct NoiseStream {
  std::uint64_t seed = 0;
  std::uint64_t camera = 0;
  std::uint64_t sequence = 0;
  bool depth = false;
};

/// Steele, Lea and Flood, "Fast splittable pseudorandom number generators" (OOPSLA 2014): the mixing step.
std::uint64_t mix(std::uint64_t x);
NoiseKeys noise_keys(const NoiseStream& stream);

/// Grey levels in 1/128 (CV_16UC3), as the renderer accumulates them.
inline constexpr int kGreyOne = 128;

/// What one row of the picture is exposed with.
struct RowLight {
  float light = 1.0F;  ///< factor on the photons: the light's level, its flicker, a shorter exposure
  float gain = 1.0F;   ///< factor on signal and noise together: the amplifier behind the sensor
};

/// The light that falls on a sensor while it is exposed.
struct SensorLight {
  const cv::Mat& mean;             ///< CV_16UC3, 1/128 grey at a row light of 1 and 1
  std::span<const RowLight> rows;  ///< one for each row of `mean`, or none: 1 and 1 throughout
};

/// Standard deviation in grey levels at a mean of so many grey levels, before quantisation (SensorSpec).
double noise_sigma(const SensorSpec& sensor, double mean_grey);

/// image (CV_8UC3) = gain (mean light + noise), rounded and clipped to 0 to 255 (full well), with noise of
/// noise_sigma(mean light).
void expose(const SensorLight& light, const SensorSpec& sensor, const NoiseStream& stream, cv::Mat& image);

/// The same for a part of the rows of an image that has its size already.
void expose_rows(const SensorLight& light, const SensorSpec& sensor, const NoiseStream& stream,
                 const cv::Range& rows, cv::Mat& image);

}  // namespace skylight::sim
