#include "sim/camera/noise_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace skylight::sim {
namespace {

/// Two random words a place: a 32-bit mixer (multipliers of Wellons, "Prospecting for Hash Functions", 2018),
/// the second key put in halfway so that no two streams are shifted copies of each other.
__attribute__((always_inline)) inline void fill_words(NoiseRow& row, std::uint32_t place, NoiseKeys keys) {
  const std::size_t places = row.words.size() / 2;
  std::uint32_t* __restrict first = row.words.data();
  std::uint32_t* __restrict second = first + places;
  for (std::size_t i = 0; i < places; ++i) {
    std::uint32_t x = place + static_cast<std::uint32_t>(i) + keys.first;
    x ^= x >> 16;
    x *= 0x7feb352dU;
    x ^= keys.second;
    x ^= x >> 15;
    x *= 0x846ca68bU;
    x ^= x >> 16;
    std::uint32_t y = x * 0x9e3779b1U;
    y ^= y >> 15;
    first[i] = x;
    second[i] = y;
  }
}

/// Walsh and Hadamard's transform in place: after it value i is the sum with the signs of row i.
void transform(std::array<int, kMixed>& values) {
  for (std::size_t half = 1; half < kMixed; half *= 2) {
    for (std::size_t i = 0; i < kMixed; ++i) {
      if ((i & half) != 0) continue;
      const int sum = values[i] + values[i + half];
      values[i + half] = values[i] - values[i + half];
      values[i] = sum;
    }
  }
}

/// Bytes are -128 to 127, half a unit below 0 in the mean; only the first sum, all of whose signs are plus,
/// has that in it.
constexpr std::int16_t kMeanOfFirst = kMixed / 2;

void random_plain(NoiseRow& row, std::uint32_t place, NoiseKeys keys) {
  fill_words(row, place, keys);
  const auto* bytes = reinterpret_cast<const unsigned char*>(row.words.data());
  const auto apart = static_cast<std::size_t>(row.distance);
  for (std::size_t i = 0; i < apart; ++i) {
    std::array<int, kMixed> values{};
    for (std::size_t k = 0; k < kMixed; ++k) values[k] = static_cast<std::int8_t>(bytes[k * apart + i]);
    transform(values);
    values[0] += kMeanOfFirst;
    for (std::size_t k = 0; k < kMixed; ++k) row.values[k * apart + i] = static_cast<std::int16_t>(values[k]);
  }
}

// From here on the float operations of both versions are the same, one by one: IEEE 754 rounds each in one
// way only.

void expose_from(const ExposeRow& row, int begin) {
  for (int i = begin; i < row.count; ++i) {
    const auto mean = static_cast<float>(row.mean[i]);
    const float sigma = std::sqrt(mean * row.slope + row.floor);
    const float grey = (mean * row.scale + 0.5F) + sigma * static_cast<float>(row.noise[i]);
    row.out[i] = static_cast<std::uint8_t>(std::clamp(static_cast<int>(grey), 0, 255));
  }
}

constexpr float kFarthest = 1e6F;  ///< mm; beyond any range, within whole numbers

/// The nearest that the camera can tell.
float stepped(const DepthRow& row, float mm) {
  const float level = row.in_disparity ? row.levels / mm : row.levels * mm;
  const auto whole = static_cast<float>(static_cast<int>(level + 0.5F));
  return row.in_disparity ? row.levels / whole : whole / row.levels;
}

void depth_from(const DepthRow& row, int begin) {
  for (int i = begin; i < row.count; ++i) {
    const float z = row.metres[i];
    const float sigma = (row.sigma[2] * z + row.sigma[1]) * z + row.sigma[0];
    const float noisy = (z * row.factor + row.offset) + sigma * static_cast<float>(row.noise[i]);
    const float reading = stepped(row, std::clamp(noisy, 1.0F, kFarthest));
    const bool is_one = z > 0.0F && noisy >= 1.0F && reading <= row.max_range;
    row.out[i] = is_one ? static_cast<std::uint16_t>(static_cast<int>(reading + 0.5F)) : std::uint16_t{0};
  }
}

void expose_plain(const ExposeRow& row) {
  expose_from(row, 0);
}
void depth_plain(const DepthRow& row) {
  depth_from(row, 0);
}

constexpr RowFunctions kPlain{random_plain, expose_plain, depth_plain};

#if defined(__x86_64__)
#define SKYLIGHT_AVX2 __attribute__((target("avx2")))

SKYLIGHT_AVX2 void fill_words_avx2(NoiseRow& row, std::uint32_t place, NoiseKeys keys) {
  fill_words(row, place, keys);
}

/// One step of the transform; with its distance known beforehand it stays in registers.
template <std::size_t distance>
SKYLIGHT_AVX2 __attribute__((always_inline)) inline void butterflies(__m256i (&v)[kMixed]) {
  for (std::size_t pair = 0; pair < kMixed / 2; ++pair) {
    const std::size_t a = pair / distance * 2 * distance + pair % distance;
    const __m256i sum = _mm256_add_epi16(v[a], v[a + distance]);
    v[a + distance] = _mm256_sub_epi16(v[a], v[a + distance]);
    v[a] = sum;
  }
}

SKYLIGHT_AVX2 void random_avx2(NoiseRow& row, std::uint32_t place, NoiseKeys keys) {
  fill_words_avx2(row, place, keys);
  const auto* bytes = reinterpret_cast<const unsigned char*>(row.words.data());
  const auto apart = static_cast<std::size_t>(row.distance);
  std::int16_t* out = row.values.data();
  for (std::size_t i = 0; i < apart; i += 16) {
    __m256i v[kMixed];
    for (std::size_t k = 0; k < kMixed; ++k)
      v[k] = _mm256_cvtepi8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes + k * apart + i)));
    butterflies<1>(v);
    butterflies<2>(v);
    butterflies<4>(v);
    butterflies<8>(v);
    v[0] = _mm256_add_epi16(v[0], _mm256_set1_epi16(kMeanOfFirst));
    for (std::size_t k = 0; k < kMixed; ++k)
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + k * apart + i), v[k]);
  }
}

SKYLIGHT_AVX2 inline __m256 floats(const std::int16_t* values) {
  return _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(values))));
}
SKYLIGHT_AVX2 inline __m256 floats(const std::uint16_t* values) {
  return _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(values))));
}
/// Eight greys from place i on, not yet clipped.
SKYLIGHT_AVX2 inline __m256i greys(const ExposeRow& row, int i) {
  const __m256 mean = floats(row.mean + i);
  const __m256 sigma = _mm256_sqrt_ps(
      _mm256_add_ps(_mm256_mul_ps(mean, _mm256_set1_ps(row.slope)), _mm256_set1_ps(row.floor)));
  const __m256 level = _mm256_add_ps(_mm256_mul_ps(mean, _mm256_set1_ps(row.scale)), _mm256_set1_ps(0.5F));
  return _mm256_cvttps_epi32(_mm256_add_ps(level, _mm256_mul_ps(sigma, floats(row.noise + i))));
}
/// Packing goes by halves of the registers: this puts its result in order.
SKYLIGHT_AVX2 inline __m256i in_order(__m256i packed) {
  return _mm256_permute4x64_epi64(packed, 0xd8);
}

SKYLIGHT_AVX2 void expose_avx2(const ExposeRow& row) {
  int i = 0;
  for (; i + 32 <= row.count; i += 32) {
    const __m256i low = in_order(_mm256_packs_epi32(greys(row, i), greys(row, i + 8)));
    const __m256i high = in_order(_mm256_packs_epi32(greys(row, i + 16), greys(row, i + 24)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(row.out + i), in_order(_mm256_packus_epi16(low, high)));
  }
  expose_from(row, i);
}

SKYLIGHT_AVX2 inline __m256 stepped(const DepthRow& row, __m256 mm) {
  const __m256 levels = _mm256_set1_ps(row.levels);
  const __m256 half = _mm256_set1_ps(0.5F);
  const __m256 level = row.in_disparity ? _mm256_div_ps(levels, mm) : _mm256_mul_ps(levels, mm);
  const __m256 whole = _mm256_cvtepi32_ps(_mm256_cvttps_epi32(_mm256_add_ps(level, half)));
  return row.in_disparity ? _mm256_div_ps(levels, whole) : _mm256_div_ps(whole, levels);
}
/// Eight readings from place i on, mm; 0: none.
SKYLIGHT_AVX2 inline __m256i readings(const DepthRow& row, int i) {
  const __m256 z = _mm256_loadu_ps(row.metres + i);
  const __m256 grown =
      _mm256_add_ps(_mm256_mul_ps(_mm256_set1_ps(row.sigma[2]), z), _mm256_set1_ps(row.sigma[1]));
  const __m256 sigma = _mm256_add_ps(_mm256_mul_ps(grown, z), _mm256_set1_ps(row.sigma[0]));
  const __m256 exact =
      _mm256_add_ps(_mm256_mul_ps(z, _mm256_set1_ps(row.factor)), _mm256_set1_ps(row.offset));
  const __m256 noisy = _mm256_add_ps(exact, _mm256_mul_ps(sigma, floats(row.noise + i)));
  const __m256 one = _mm256_set1_ps(1.0F);
  const __m256 reading = stepped(row, _mm256_min_ps(_mm256_max_ps(noisy, one), _mm256_set1_ps(kFarthest)));
  const __m256 is_one = _mm256_and_ps(
      _mm256_and_ps(_mm256_cmp_ps(z, _mm256_setzero_ps(), _CMP_GT_OQ), _mm256_cmp_ps(noisy, one, _CMP_GE_OQ)),
      _mm256_cmp_ps(reading, _mm256_set1_ps(row.max_range), _CMP_LE_OQ));
  const __m256i rounded = _mm256_cvttps_epi32(_mm256_add_ps(reading, _mm256_set1_ps(0.5F)));
  return _mm256_and_si256(rounded, _mm256_castps_si256(is_one));
}

SKYLIGHT_AVX2 void depth_avx2(const DepthRow& row) {
  int i = 0;
  for (; i + 16 <= row.count; i += 16) {
    const __m256i packed = in_order(_mm256_packus_epi32(readings(row, i), readings(row, i + 8)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(row.out + i), packed);
  }
  depth_from(row, i);
}

constexpr RowFunctions kAvx2{random_avx2, expose_avx2, depth_avx2};
#undef SKYLIGHT_AVX2
#endif

}  // namespace

NoiseRow::NoiseRow(int count)
    : distance(mixing_distance(count)),
      words(static_cast<std::size_t>(distance) * kMixed / 4),
      values(static_cast<std::size_t>(distance) * kMixed) {}

const RowFunctions& plain_rows() {
  return kPlain;
}

const RowFunctions& fast_rows() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") != 0) return kAvx2;
#endif
  return kPlain;
}

}  // namespace skylight::sim
