#include "sim/world/chance.hpp"

#include <cmath>
#include <numbers>

namespace skylight::sim {
namespace {

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15U;

/// Steele, Lea and Flood, "Fast splittable pseudorandom number generators" (2014): the mixing step.
std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 30U;
  x *= 0xBF58476D1CE4E5B9U;
  x ^= x >> 27U;
  x *= 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

}  // namespace

std::uint64_t mixed(std::uint64_t seed, std::uint64_t stream) {
  return mix(mix(seed + kGolden) ^ (stream * kGolden));
}

Chance::Chance(std::uint64_t seed, std::uint64_t stream) : key_(mixed(seed, stream)) {}

double Chance::uniform() {
  const std::uint64_t bits = mix(key_ + kGolden * ++count_);
  return static_cast<double>(bits >> 11U) * 0x1.0p-53;
}

double Chance::normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

double Chance::exponential(double mean) {
  return -mean * std::log(1.0 - uniform());
}

}  // namespace skylight::sim
