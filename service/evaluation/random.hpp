// Random numbers that are the same with every compiler and library.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <Eigen/Core>

namespace skylight::service {

/// Steele, Lea and Flood, "Fast splittable pseudorandom number generators" (2014); Box and Muller (1958).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  /// In [0, 1).
  double uniform() {
    std::uint64_t x = state_ += 0x9E3779B97F4A7C15U;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
    return static_cast<double>((x ^ (x >> 31U)) >> 11U) * 0x1.0p-53;
  }
  double exponential(double mean) { return -mean * std::log(1.0 - uniform()); }
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    const double angle = 2.0 * std::numbers::pi * uniform();
    return radius * std::cos(angle);
  }
  Eigen::Vector2d normal2() {
    const double x = normal();
    return {x, normal()};
  }

 private:
  std::uint64_t state_;
};

}  // namespace skylight::service
