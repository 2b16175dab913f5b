// Random wandering: speed and turn rate change at random instants; what would lead too near to something is
// replaced by the least different motion that does not.
//
// The look ahead is that of the dynamic window approach (Fox, Burgard and Thrun 1997): arcs of constant speed
// and turn rate, judged by the distance that they keep. The robot counts as a disc around base_link that
// holds its whole outline, so that it can always turn on the spot; everything else counts with its outline,
// going on as it goes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/scenario/robot.hpp"
#include "sim/world/chance.hpp"
#include "sim/world/command.hpp"

namespace skylight::sim {

class Wanderer {
 public:
  /// `now_s`: the program's time at which it begins.
  Wanderer(const WanderStep& step, const DriveLimits& limits, std::uint64_t seed, double now_s);

  /// The command for the next control period. Times rise from call to call.
  Command next(const ProgramContext& context);

 private:
  struct Arc {
    double v;
    double w;
  };
  void draw();
  Arc plan(const ProgramContext& context);
  std::vector<const Obstacle*> near(const ProgramContext& context) const;
  double room_ahead(const ProgramContext& context, const std::vector<const Obstacle*>& obstacles, Arc arc,
                    double good_enough) const;
  double clearance(const ProgramContext& context, const std::vector<const Obstacle*>& obstacles,
                   const Eigen::Vector2d& place, double ahead_s) const;
  Arc best_arc(const ProgramContext& context, const std::vector<const Obstacle*>& obstacles, double room_now);
  std::optional<Arc> free_itself(const ProgramContext& context);

  WanderStep step_;
  DriveLimits limits_;
  Chance chance_;
  double fastest_turn_;
  double next_change_s_;
  Arc wanted_{0.0, 0.0};
  Arc chosen_{0.0, 0.0};
  double next_plan_s_;
  int side_ = 0;          ///< to which it steers clear of something, 0: of nothing
  double clear_since_s_;  ///< what it wants has been clear since then
  // Where it was a while ago, to notice that it does not get on.
  double watched_since_s_;
  std::optional<Pose2> watched_;
  double free_until_s_;  ///< it is freeing itself: back, then round
  double back_until_s_;
  double way_back_ = -1.0;
  double way_round_ = 1.0;
};

}  // namespace skylight::sim
