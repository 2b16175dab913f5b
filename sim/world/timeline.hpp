// The recent motion of everything that moves, so that a camera can look at any instant of its exposure.
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

  /// The next step's states by actor (there may be more than before, never fewer), and who touched whom.
  void append(std::vector<BodyState> states, std::vector<Touch> touches = {});
  /// Forgets what lies more than a step before `time`.
  void forget_before(Duration time);

  Duration end() const;
  /// `time` must lie between what was forgotten and end(). An actor that had not come yet is absent; one that
  /// is taken away or put down in a step stays what it was until that step's end.
  BodyState at(std::size_t actor, Duration time) const;
  /// What an actor touched at the last step up to `time`: actors, and World::kWall last.
  std::vector<std::size_t> touches(std::size_t actor, Duration time) const;

 private:
  struct Step {
    std::vector<BodyState> states;
    std::vector<Touch> touches;
  };
  std::deque<Step> steps_;
  std::int64_t first_ = 0;  ///< step number of the front
};

}  // namespace skylight::sim
