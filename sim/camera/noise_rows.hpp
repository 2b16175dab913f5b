// The inner loops of the sensor, one row at a time: random numbers, and what they do to light and depth. For
// processors with AVX2 and, giving the same bytes, for all others.
#pragma once

#include <cstdint>
#include <vector>

namespace skylight::sim {

/// What makes a stream of random numbers its own.
struct NoiseKeys {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
};

/// Near-normal numbers: of 16 uniform random bytes the 16 sums with the signs of a Hadamard matrix. Its rows
/// are orthogonal, so the sums are uncorrelated; each is distributed as the sum of 16 bytes (excess kurtosis
/// -0.075, out to 6.9 sigma), for one random byte and four additions. The 16 lie a sixteenth of a row apart.
inline constexpr int kMixed = 16;
inline constexpr double kNoiseSigma = 295.6010826;  ///< of the numbers: sqrt(16 (256^2 - 1) / 12)

/// Distance of the 16 numbers that are mixed in a row of `count`; a row has room for 16 times this.
constexpr int mixing_distance(int count) {
  return (count + kMixed * 16 - 1) / (kMixed * 16) * 16;
}

/// Random numbers of one row.
struct NoiseRow {
  explicit NoiseRow(int count);
  int distance;
  std::vector<std::uint32_t> words;  ///< the bytes that are mixed
  std::vector<std::int16_t> values;  ///< mean 0, standard deviation kNoiseSigma
};

/// out = round(scale mean + sqrt(slope mean + floor) noise), 0 to 255.
struct ExposeRow {
  const std::uint16_t* mean;
  const std::int16_t* noise;
  std::uint8_t* out;
  int count;
  float scale;
  float slope;  ///< variance per unit of the mean, in units of the noise numbers
  float floor;
};

/// Standard deviation = sigma[0] + sigma[1] z + sigma[2] z^2 (mm per unit of the noise numbers, z in m).
struct DepthRow {
  const float* metres;
  const std::int16_t* noise;
  std::uint16_t* out;  ///< mm; 0: no reading
  int count;
  float sigma[3];
  float offset;       ///< mm; systematic
  float factor;       ///< mm per metre; 1000 and a systematic error
  float levels;       ///< in_disparity: readings are levels / 1, 2, 3 ... mm; else their number per mm
  bool in_disparity;  ///< steps that grow with the square of the distance
  float max_range;    ///< mm
};

struct RowFunctions {
  /// The numbers of the row whose first place has this number; rows of a stream must not share places.
  void (*random)(NoiseRow& row, std::uint32_t place, NoiseKeys keys);
  void (*expose)(const ExposeRow& row);
  void (*depth)(const DepthRow& row);
};

/// For any processor, and the fastest for this one. Both give the same bytes.
const RowFunctions& plain_rows();
const RowFunctions& fast_rows();

}  // namespace skylight::sim
