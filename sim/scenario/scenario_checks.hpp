// The checks of a scenario that look at more than one key.
#pragma once

#include <optional>
#include <string>

#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

struct Problem {
  std::string path;  ///< of the key that is wrong: robots[1].start
  std::string message;
};

/// The first contradiction in a scenario whose single values are within their ranges.
std::optional<Problem> find_problem(const Scenario& scenario);

}  // namespace skylight::sim
