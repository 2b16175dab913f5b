// Sensor noise, fresh in every frame and the same in every run: a counter-based generator gives each value of
// a frame its own random number from (seed, camera, sequence, place), so that threads and order do not
// matter.
#pragma once

#include <array>
#include <cstdint>

#include <opencv2/core/mat.hpp>

#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

/// Which random numbers: one stream per scenario seed, camera, kind and frame.
struct NoiseStream {
  std::uint64_t seed = 0;
  std::uint64_t camera = 0;
  std::uint64_t sequence = 0;
  bool depth = false;
};

/// Grey levels in 1/128 (CV_16UC3), as the renderer accumulates them.
inline constexpr int kGreyOne = 128;

/// What the noise adds at each grey level.
class SensorNoise {
 public:
  explicit SensorNoise(const SensorSpec& sensor);

  /// Standard deviation in the noise functions' own fixed point, for a mean in 1/128 grey.
  std::uint16_t scale(std::uint16_t mean) const { return table_[mean / (kGreyOne / 2)]; }
  /// Standard deviation in grey levels at a mean of so many grey levels, before quantisation.
  double sigma(double mean) const;

 private:
  SensorSpec sensor_;
  std::array<std::uint16_t, 1024> table_{};  ///< per half grey level
};

/// image (CV_8UC3) = mean + noise, rounded and clipped to 0 to 255. `mean` is CV_16UC3 in 1/128 grey, `scale`
/// of the same size holds SensorNoise::scale() of each.
void expose(const cv::Mat& mean, const cv::Mat& scale, const NoiseStream& stream, cv::Mat& image);

/// depth (CV_16UC1, mm) = metres (CV_32FC1; 0 = nothing there) + noise, rounded; 0 beyond the range.
void measure_depth(const cv::Mat& metres, const DepthSpec& spec, const NoiseStream& stream, cv::Mat& depth);

}  // namespace skylight::sim
