// How everybody and everything on the stage looks: robots with their pictures and tags, things, people.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "sim/render/look.hpp"
#include "sim/scenario/event.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/simulation.hpp"
#include "sim/world/stage.hpp"

namespace skylight::sim {

class Cast {
 public:
  /// Throws std::invalid_argument where a robot's picture cannot be read, or its tag does not fit.
  Cast(const Scenario& scenario, const std::vector<RobotSpec>& robots);

  /// The artwork of a robot. Throws std::out_of_range.
  const RobotPicture& picture(std::size_t robot) const { return pictures_.at(robot); }

  /// Something lies on a robot's top from `at` on.
  void cover(std::size_t robot, const CoverAction& action, Duration at);

  /// How an actor of the stage looks at a time.
  std::shared_ptr<const Look> look(const Stage& stage, std::size_t actor, Duration time);

 private:
  struct Cover {
    std::size_t robot = 0;
    bool tag_only = true;
    Duration from{};
    std::optional<Duration> until;  ///< none: for good
    std::shared_ptr<const Look> look;
  };

  Scenario scenario_;  ///< its robots with their copies
  std::vector<RobotPicture> pictures_;
  std::vector<std::shared_ptr<const Look>> robots_;  ///< with nothing on top
  std::vector<Cover> covers_;
  std::map<std::size_t, std::shared_ptr<const Look>> others_;  ///< things and people, by actor
};

}  // namespace skylight::sim
