// The scenario's events: which of them happen now.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sim/scenario/event.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// An event of the scenario, or an action that was asked for, at the moment that it took place.
struct Happening {
  Time at{};
  std::string name;  ///< of the event, empty where it has none
  Action action;
};

/// What conditions ask about, answered by whoever runs the world.
class Situation {
 public:
  virtual ~Situation() = default;
  /// Where a robot stands; none while it is carried away.
  virtual std::optional<Pose2> place_of(const std::string& robot) const = 0;
  virtual bool touches_something(const std::string& robot) const = 0;
  virtual bool program_done(const std::string& robot) const = 0;
};

/// An event happens at the first step of the world at or after its time, or at which its condition holds:
/// once, or from then on every so often (at most once a step). Events that follow others without delay happen
/// in the same step, after them.
class Director {
 public:
  explicit Director(std::vector<EventSpec> events);

  /// Indices into events() of what happens at this step, in order. `time` (from the scenario's start) rises
  /// from call to call.
  std::vector<std::size_t> due(Duration time, const Situation& situation);

  const std::vector<EventSpec>& events() const { return events_; }
  /// Names of the events that have happened.
  const std::set<std::string>& happened() const { return happened_; }

 private:
  struct Progress {
    std::optional<Duration> first;  ///< when it happened first
    Duration next{};                ///< when it happens again, where it does
  };
  bool is_due(std::size_t event, Duration time, const Situation& situation) const;
  bool holds(const Condition& condition, Duration time, const Situation& situation) const;

  std::vector<EventSpec> events_;
  std::vector<Progress> progress_;
  std::set<std::string> happened_;
};

}  // namespace skylight::sim
