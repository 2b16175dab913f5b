// Eight numbers at a time. Plain IEEE 754 operations, rounded one way only, so the bytes are the same with
// any instruction set; functions that use them are compiled twice where that is faster (see rows.cpp).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

// Everything here is taken in where it is used: no vector is ever passed by a calling convention.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace skylight::sim {

inline constexpr int kLanes = 8;
using F8 = float __attribute__((vector_size(32)));
using I8 = std::int32_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline F8 load(const float* from) {
  F8 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
[[gnu::always_inline]] inline void store(float* to, const F8& v) {
  std::memcpy(to, &v, sizeof v);
}
[[gnu::always_inline]] inline F8 all(float value) {
  return F8{value, value, value, value, value, value, value, value};
}
[[gnu::always_inline]] inline F8 least(const F8& a, const F8& b) {
  return a < b ? a : b;
}
[[gnu::always_inline]] inline F8 most(const F8& a, const F8& b) {
  return a > b ? a : b;
}
[[gnu::always_inline]] inline F8 within(const F8& v, const F8& low, const F8& high) {
  return least(most(v, low), high);
}
[[gnu::always_inline]] inline F8 bits(const I8& v) {
  F8 f;
  std::memcpy(&f, &v, sizeof f);
  return f;
}
[[gnu::always_inline]] inline I8 bits(const F8& v) {
  I8 i;
  std::memcpy(&i, &v, sizeof i);
  return i;
}
/// The value where the mask (all ones or none) is set, else 0.
[[gnu::always_inline]] inline F8 only(const I8& mask, const F8& v) {
  return bits(mask & bits(v));
}
/// Away from 0, so that it can be divided by.
[[gnu::always_inline]] inline F8 divisible(const F8& v, float smallest) {
  const F8 low = all(smallest);
  const F8 away = v < 0.0F ? -low : low;
  return ((v < low) & (v > -low)) ? away : v;
}
[[gnu::always_inline]] inline F8 root(const F8& v) {
  F8 result;
#if defined(__SSE2__)
  __m128 low;
  __m128 high;
  std::memcpy(&low, &v, sizeof low);
  std::memcpy(&high, reinterpret_cast<const char*>(&v) + sizeof low, sizeof high);
  low = _mm_sqrt_ps(low);
  high = _mm_sqrt_ps(high);
  std::memcpy(&result, &low, sizeof low);
  std::memcpy(reinterpret_cast<char*>(&result) + sizeof low, &high, sizeof high);
#else
  for (int i = 0; i < kLanes; ++i) result[i] = std::sqrt(v[i]);
#endif
  return result;
}
/// Bit i: lane i of the mask is set.
[[gnu::always_inline]] inline unsigned lanes_of(const I8& mask) {
#if defined(__SSE2__)
  __m128 low;
  __m128 high;
  std::memcpy(&low, &mask, sizeof low);
  std::memcpy(&high, reinterpret_cast<const char*>(&mask) + sizeof low, sizeof high);
  return static_cast<unsigned>(_mm_movemask_ps(low)) | static_cast<unsigned>(_mm_movemask_ps(high)) << 4U;
#else
  unsigned result = 0;
  for (int i = 0; i < kLanes; ++i) result |= (mask[i] != 0 ? 1U : 0U) << static_cast<unsigned>(i);
  return result;
#endif
}
/// In a fixed order, whatever the instruction set.
[[gnu::always_inline]] inline float total(const F8& v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

}  // namespace skylight::sim
