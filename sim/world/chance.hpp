// Random numbers by counter: the n-th number of a stream is a function of (seed, stream, n) alone, the same
// with every compiler and standard library.
#pragma once

#include <cstdint>

namespace skylight::sim {

class Chance {
 public:
  /// Streams of one seed have nothing to do with each other.
  Chance(std::uint64_t seed, std::uint64_t stream);

  /// Evenly in [0, 1).
  double uniform();
  /// Normal, mean 0 and variance 1 (Box and Muller 1958).
  double normal();
  /// Time to the next of events that come independently of each other, so long apart on average.
  double exponential(double mean);

 private:
  std::uint64_t key_;
  std::uint64_t count_ = 0;
};

/// A seed for something within something that has a seed.
std::uint64_t mixed(std::uint64_t seed, std::uint64_t stream);

}  // namespace skylight::sim
