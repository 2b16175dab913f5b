// The room's light over time: its level, and the shadows that pass.
#pragma once

#include <vector>

#include "sim/render/rows.hpp"
#include "sim/scenario/event.hpp"
#include "sim/scenario/room.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Times count from the scenario's start; changes come in the order of their times.
class Lighting {
 public:
  Lighting(const LightSpec& light, const RoomSpec& room);

  /// From the level at `at`, evenly to the action's.
  void change(const LightAction& action, Duration at);
  /// A band that enters the room at `at`.
  void pass(const ShadowAction& action, Duration at);

  double level(Duration time) const;
  /// Those that lie over some of the room at this time.
  std::vector<PassingShadow> shadows(Duration time) const;

 private:
  struct Change {
    Duration at{};
    Duration over{};
    double from = 1.0;
    double to = 1.0;
  };
  struct Passing {
    Duration at{};
    ShadowAction shadow;
    double reach_m = 0.0;  ///< of the room from its middle, along the band's way
  };

  RoomSpec room_;
  std::vector<Change> changes_;
  std::vector<Passing> passing_;
};

}  // namespace skylight::sim
