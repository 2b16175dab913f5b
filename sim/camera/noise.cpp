#include "sim/camera/noise.hpp"

#include <algorithm>
#include <cmath>

namespace skylight::sim {
namespace {

/// A sum of eight random bytes less its mean: close to normal (excess kurtosis -0.15, out to 4.9 sigma).
constexpr int kSumMean = 1020;
constexpr double kSumSigma = 209.0215300;  // sqrt(8 (256^2 - 1) / 12)
constexpr int kScaleBits = 12;

struct Keys {
  std::uint32_t first;
  std::uint32_t second;
};

/// Steele, Lea and Flood, "Fast splittable pseudorandom number generators" (2014): the mixing step.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

Keys keys(const NoiseStream& stream) {
  const std::uint64_t x =
      mix(mix(mix(stream.seed) ^ (stream.camera * 2 + (stream.depth ? 1 : 0))) ^ stream.sequence);
  return {static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(x >> 32)};
}

/// Adds the four bytes of each of two words, as two 16-bit halves at a time.
__attribute__((always_inline)) inline std::int32_t byte_sum(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t pairs =
      (a & 0x00ff00ffU) + ((a >> 8) & 0x00ff00ffU) + (b & 0x00ff00ffU) + ((b >> 8) & 0x00ff00ffU);
  return static_cast<std::int32_t>((pairs & 0xffffU) + (pairs >> 16));
}

/// The random number of one place: a 32-bit mixer (multipliers of Wellons, "Prospecting for Hash Functions",
/// 2018), the second key put in halfway so that no two streams are shifted copies of each other.
__attribute__((always_inline)) inline std::int32_t normal(std::uint32_t place, Keys k) {
  std::uint32_t x = place + k.first;
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= k.second;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  x ^= x >> 16;
  std::uint32_t y = x * 0x9e3779b1U;
  y ^= y >> 15;
  return byte_sum(x, y) - kSumMean;
}

struct ExposeRow {
  const std::uint16_t* mean;
  const std::uint16_t* scale;
  std::uint8_t* out;
  int count;
  std::uint32_t place;
  Keys keys;
};

__attribute__((always_inline)) inline void expose_row(const ExposeRow& row) {
  const std::uint16_t* __restrict mean = row.mean;
  const std::uint16_t* __restrict scale = row.scale;
  std::uint8_t* __restrict out = row.out;
  const Keys k = row.keys;
  const std::uint32_t place = row.place;
  const int count = row.count;
  for (int i = 0; i < count; ++i) {
    const std::int32_t noise = normal(place + static_cast<std::uint32_t>(i), k) * scale[i];
    const std::int32_t grey = mean[i] + ((noise + (1 << (kScaleBits - 1))) >> kScaleBits);
    const std::int32_t rounded = (grey + kGreyOne / 2) >> 7;
    out[i] = static_cast<std::uint8_t>(rounded < 0 ? 0 : (rounded > 255 ? 255 : rounded));
  }
}

struct DepthRow {
  const float* metres;
  std::uint16_t* out;
  int count;
  std::uint32_t place;
  Keys keys;
  float noise_floor;   ///< mm per unit of the sum
  float noise_growth;  ///< mm per unit of the sum and m^2
  float max_range;     ///< mm
};

__attribute__((always_inline)) inline void depth_row(const DepthRow& row) {
  const float* __restrict metres = row.metres;
  std::uint16_t* __restrict out = row.out;
  const DepthRow r = row;
  for (int i = 0; i < r.count; ++i) {
    const float z = metres[i];
    const float beyond = z - 0.4F;
    const float sigma = r.noise_floor + r.noise_growth * beyond * beyond;
    const float noisy =
        1000.0F * z + sigma * static_cast<float>(normal(r.place + static_cast<std::uint32_t>(i), r.keys));
    // Whole numbers and masks: a choice between floats would keep the compiler from vectorising the loop.
    const float bounded = std::min(std::max(noisy, 0.0F), r.max_range);
    const auto rounded = static_cast<std::int32_t>(bounded + 0.5F);
    const std::int32_t reading = -static_cast<std::int32_t>(z > 0.0F) &
                                 -static_cast<std::int32_t>(noisy >= 1.0F) &
                                 -static_cast<std::int32_t>(noisy <= r.max_range);
    out[i] = static_cast<std::uint16_t>(rounded & reading);
  }
}

// The same loops for processors that have AVX2: whole numbers, and float operations that IEEE 754 rounds one
// way only, so the bytes are equal.
#if defined(__x86_64__)
__attribute__((target("avx2"))) void expose_row_avx2(const ExposeRow& row) {
  expose_row(row);
}
__attribute__((target("avx2"))) void depth_row_avx2(const DepthRow& row) {
  depth_row(row);
}
bool has_avx2() {
  return __builtin_cpu_supports("avx2") != 0;
}
#else
void expose_row_avx2(const ExposeRow& row) {
  expose_row(row);
}
void depth_row_avx2(const DepthRow& row) {
  depth_row(row);
}
bool has_avx2() {
  return false;
}
#endif

void expose_row_base(const ExposeRow& row) {
  expose_row(row);
}
void depth_row_base(const DepthRow& row) {
  depth_row(row);
}

}  // namespace

SensorNoise::SensorNoise(const SensorSpec& sensor) : sensor_(sensor) {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    const double sigma_grey = sigma((static_cast<double>(i) + 0.5) / 2.0);
    const double scale = sigma_grey * kGreyOne / kSumSigma * (1 << kScaleBits);
    table_[i] = static_cast<std::uint16_t>(std::clamp(std::round(scale), 0.0, 65535.0));
  }
}

double SensorNoise::sigma(double mean) const {
  if (!sensor_.noise) return 0.0;
  const double grey_per_electron = 255.0 * sensor_.gain / sensor_.full_well_e;
  const double read = sensor_.read_noise_e * grey_per_electron;
  return std::sqrt(grey_per_electron * mean + read * read);
}

void expose(const cv::Mat& mean, const cv::Mat& scale, const NoiseStream& stream, cv::Mat& image) {
  CV_Assert(mean.type() == CV_16UC3 && scale.type() == CV_16UC3 && mean.size() == scale.size());
  image.create(mean.size(), CV_8UC3);
  const auto row_function = has_avx2() ? expose_row_avx2 : expose_row_base;
  const Keys k = keys(stream);
  const int count = mean.cols * 3;
  for (int y = 0; y < mean.rows; ++y) {
    row_function({mean.ptr<std::uint16_t>(y), scale.ptr<std::uint16_t>(y), image.ptr<std::uint8_t>(y), count,
                  static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(count), k});
  }
}

void measure_depth(const cv::Mat& metres, const DepthSpec& spec, const NoiseStream& stream, cv::Mat& depth) {
  CV_Assert(metres.type() == CV_32FC1);
  depth.create(metres.size(), CV_16UC1);
  const auto row_function = has_avx2() ? depth_row_avx2 : depth_row_base;
  const double unit = spec.noise ? 1000.0 / kSumSigma : 0.0;
  const double farthest = std::min(1000.0 * spec.max_range_m, 65534.0);
  for (int y = 0; y < metres.rows; ++y) {
    row_function({metres.ptr<float>(y), depth.ptr<std::uint16_t>(y), metres.cols,
                  static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(metres.cols), keys(stream),
                  static_cast<float>(unit * spec.noise_floor_m.value_or(0.0012)),
                  static_cast<float>(unit * spec.noise_growth.value_or(0.0019)),
                  static_cast<float>(farthest)});
  }
}

}  // namespace skylight::sim
