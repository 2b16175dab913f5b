// One pixel's sixteen samples at once: rays, what they meet, the colours there.
#pragma once

#include <array>
#include <bit>

#include "sim/render/lanes.hpp"
#include "sim/render/placed.hpp"
#include "sim/render/print.hpp"
#include "sim/render/rays.hpp"
#include "sim/render/trace.hpp"

namespace skylight::sim {

/// Offsets of the samples from the pixel's centre, px.
struct alignas(32) SampleOffsets {
  std::array<F8, 2> x{}, y{};
  SampleOffsets() {
    for (std::size_t i = 0; i < kSamples; ++i) {
      x[i / kLanes][static_cast<int>(i % kLanes)] = static_cast<float>(sixteenth(static_cast<int>(i)) - 0.5);
      y[i / kLanes][static_cast<int>(i % kLanes)] = static_cast<float>(sixteenth(kRow[i]) - 0.5);
    }
  }
};

/// Directions of sixteen samples, in `map`.
struct alignas(32) SampleRays {
  std::array<F8, 2> x, y, z;
};

/// Rows of a ray plane above, at and below a pixel.
struct PlaneRows {
  const float* above;
  const float* at;
  const float* below;
};

[[gnu::always_inline]] inline F8 spread(const PlaneRows& rows, int x, const F8& offset_x,
                                        const F8& offset_y) {
  const float along_x = 0.5F * (rows.at[x + 1] - rows.at[x - 1]);
  const float along_y = 0.5F * (rows.below[x] - rows.above[x]);
  return rows.at[x] + along_x * offset_x + along_y * offset_y;
}

#if defined(__SSE2__)
/// Adds a texel and its right, lower and lower right neighbours; weights of an upper and a lower one in 16
/// bits each.
[[gnu::always_inline]] inline void add_texel(const std::uint32_t* at, int stride, std::int32_t left,
                                             std::int32_t right, __m128i& sum) {
  const __m128i upper = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(at));
  const __m128i lower = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(at + stride));
  const __m128i both = _mm_unpacklo_epi8(upper, lower);  // of each colour the upper texel's, the lower's
  const __m128i nothing = _mm_setzero_si128();
  sum = _mm_add_epi32(sum, _mm_madd_epi16(_mm_unpacklo_epi8(both, nothing), _mm_set1_epi32(left)));
  sum = _mm_add_epi32(sum, _mm_madd_epi16(_mm_unpackhi_epi8(both, nothing), _mm_set1_epi32(right)));
}
#endif

/// Adds the texels at sixteen places, weighted between their neighbours, in units of 1 / kWeightOne: blue,
/// green, red. Places in texels of the level; the samples in `wanted` count (bit i: sample i). Whole numbers:
/// the sum is the same on every processor.
[[gnu::always_inline]] inline void add_texels(const Print::Level& level, const std::array<F8, 2>& columns,
                                              const std::array<F8, 2>& rows, unsigned wanted,
                                              std::array<std::int32_t, 3>& sum) {
  alignas(32) std::array<std::int32_t, kSamples> place;
  alignas(32) std::array<std::int32_t, kSamples>
      left;  // weights of the upper and the lower texel, 16 bits each
  alignas(32) std::array<std::int32_t, kSamples> right;
  constexpr std::int32_t kOne = 1 << kPlaceBits;
  const F8 zero = all(0.0F);
  for (std::size_t h = 0; h < 2; ++h) {
    const F8 u =
        within(columns[h], zero, all(static_cast<float>(level.columns - 1))) * static_cast<float>(kOne);
    const F8 v = within(rows[h], zero, all(static_cast<float>(level.rows - 1))) * static_cast<float>(kOne);
    const I8 ui = __builtin_convertvector(u, I8);
    const I8 vi = __builtin_convertvector(v, I8);
    const I8 a = ui & (kOne - 1);
    const I8 b = vi & (kOne - 1);
    // A product of numbers below 2^24 is exact as floats, and quicker than one of whole numbers.
    const F8 row = __builtin_convertvector(vi >> kPlaceBits, F8) * static_cast<float>(level.stride);
    const I8 p = __builtin_convertvector(row, I8) + (ui >> kPlaceBits);
    const F8 fa = __builtin_convertvector(a, F8);
    const F8 fb = __builtin_convertvector(b, F8);
    const F8 one = all(static_cast<float>(kOne));
    const F8 low_high = one - fb;
    const I8 l = __builtin_convertvector((one - fa) * low_high, I8) |
                 __builtin_convertvector((one - fa) * fb, I8) << 16;
    const I8 r = __builtin_convertvector(fa * low_high, I8) | __builtin_convertvector(fa * fb, I8) << 16;
    std::memcpy(&place[h * kLanes], &p, sizeof p);
    std::memcpy(&left[h * kLanes], &l, sizeof l);
    std::memcpy(&right[h * kLanes], &r, sizeof r);
  }
  const std::uint32_t* texels = level.texels.data();
#if defined(__SSE2__)
  __m128i total_of = _mm_setzero_si128();
  if (wanted == 0xffffU) {
    for (std::size_t i = 0; i < kSamples; ++i)
      add_texel(texels + place[i], level.stride, left[i], right[i], total_of);
  } else {
    for (; wanted != 0; wanted &= wanted - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(wanted));
      add_texel(texels + place[i], level.stride, left[i], right[i], total_of);
    }
  }
  alignas(16) std::array<std::int32_t, 4> sums;
  _mm_store_si128(reinterpret_cast<__m128i*>(sums.data()), total_of);
  for (std::size_t c = 0; c < 3; ++c) sum[c] += sums[c];
#else
  for (; wanted != 0; wanted &= wanted - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(wanted));
    const std::uint32_t* at = texels + place[i];
    for (std::size_t c = 0; c < 3; ++c) {
      const auto texel = [&](const std::uint32_t* t) {
        return static_cast<std::int32_t>(*t >> (8 * c) & 255U);
      };
      sum[c] += texel(at) * (left[i] & 0xffff) + texel(at + level.stride) * (left[i] >> 16) +
                texel(at + 1) * (right[i] & 0xffff) + texel(at + level.stride + 1) * (right[i] >> 16);
    }
  }
#endif
}

/// From places on a plate to places in its print's level: column = origin.x - y * per_metre and likewise.
struct PrintPlaces {
  float origin_x, origin_y, per_x, per_y;
};
inline PrintPlaces print_places(const Look& look, const Print::Level& level) {
  const auto per_metre = static_cast<float>(1.0 / look.metres_per_px());
  // Pixels are areas: the outlines of all levels coincide, so that no level shifts the picture.
  return {(static_cast<float>(look.print_origin().x()) + 0.5F) * level.columns_per_full - 0.5F,
          (static_cast<float>(look.print_origin().y()) + 0.5F) * level.rows_per_full - 0.5F,
          per_metre * level.columns_per_full, per_metre * level.rows_per_full};
}

/// The rays in the axes of a body, at the samples' moments.
[[gnu::always_inline]] inline void turn_rays(const SampleRays& rays, const Stances& stances, std::size_t half,
                                             RayLanes& out) {
  const F8 c = load(&stances.cosine[half * kLanes]);
  const F8 s = load(&stances.sine[half * kLanes]);
  out.eye_x = load(&stances.eye_x[half * kLanes]);
  out.eye_y = load(&stances.eye_y[half * kLanes]);
  out.eye_z = all(stances.eye_z);
  out.x = c * rays.x[half] + s * rays.y[half];
  out.y = c * rays.y[half] - s * rays.x[half];
  out.z = rays.z[half];
  invert(out);
}

}  // namespace skylight::sim
