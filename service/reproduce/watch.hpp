// A scenario looked at frame by frame: what became of it is an observed run.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "service/reproduce/observed_run.hpp"
#include "service/sources/simulator.hpp"

namespace skylight::service::reproduce {

/// What each variant sees of a frame, in their order.
using Look = std::function<std::vector<std::optional<Observation>>(const Frame& frame)>;

/// All frames of the first camera beside the truth of the first robot, and what its wheels say. The variants
/// name what `look` gives. Throws as SimulatorFrames.
ObservedRun watch(SimulatorFrames& simulator, const std::string& route, std::vector<std::string> variants,
                  const Look& look);

}  // namespace skylight::service::reproduce
