// The recent motion of all robots, so that a camera can look at any instant of its exposure.
#pragma once

#include <deque>
#include <vector>

#include "sim/world/world.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// States at the world's steps; between them, poses lie on straight lines (over 2 ms a robot's path bends by
/// less than a micrometre). Times count from the scenario's start.
class Timeline {
 public:
  explicit Timeline(std::vector<BodyState> at_start);

  /// The next step's states.
  void append(std::vector<BodyState> states);
  /// Forgets what lies more than a step before `time`.
  void forget_before(Duration time);

  Duration end() const;
  /// `time` must lie between what was forgotten and end().
  BodyState at(std::size_t robot, Duration time) const;

 private:
  std::deque<std::vector<BodyState>> steps_;
  std::int64_t first_ = 0;  ///< step number of the front
};

}  // namespace skylight::sim
