// People: where somebody is on his way.
#pragma once

#include <optional>

#include "sim/scenario/room.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Where a person walks at this time (from the scenario's start), facing where he goes; none before he enters
/// and after his path's end.
std::optional<Pose2> person_at(const PersonSpec& person, Duration time);

}  // namespace skylight::sim
