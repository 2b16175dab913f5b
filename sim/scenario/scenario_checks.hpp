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

// Its parts, one file each.

/// program_checks.cpp: a robot's motion program against the robot, the room, the named programs and events.
std::optional<Problem> find_program_problem(const Scenario& scenario, const RobotSpec& robot,
                                            const std::string& path);
/// The named programs: that none runs itself.
std::optional<Problem> find_program_cycle(const Scenario& scenario);

/// event_checks.cpp: names that events use, and what they wait for.
std::optional<Problem> find_event_problem(const Scenario& scenario);
/// An action by itself, as asked for while the scenario runs; paths begin with `path`.
std::optional<Problem> find_action_problem(const Scenario& scenario, const Action& action,
                                           const std::string& path);

// For messages.
std::string element(const std::string& list, std::size_t index);
std::string room_range(const RoomSpec& room);  ///< "x within -3 to 3 m, y within -3 to 3 m"
bool in_room(const RoomSpec& room, double x_m, double y_m);

}  // namespace skylight::sim
