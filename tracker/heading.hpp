// Which way does a robot look whose picture is the same turned by 180 or 90 degrees?
#pragma once

#include <optional>

#include <Eigen/Core>

#include "tracker/types.hpp"

namespace skylight {

/// Chooses among the turns of a symmetric picture by the robot's own motion: after `distance_m` the turn
/// whose forward direction is nearest to where the robot went is kept. This takes a robot to drive
/// forward more than it backs up; until then (and for one that stands) the observations say that heading
/// is known up to heading_turns.
class HeadingResolver {
 public:
  /// `centre_m`: of the picture in base_link, about which the turns are.
  HeadingResolver(int turns, const Eigen::Vector2d& centre_m, double distance_m = 0.15)
      : turns_(turns), centre_m_(centre_m), distance_m_(distance_m) {}

  /// Turns the observation as settled, and sets its heading_turns. `expected` (if there is one) tells
  /// which of the turns carries on from before.
  void apply(Observation& observation, const std::optional<Pose2>& expected);
  /// Something else told the heading (a tag): from here on the turn nearest to what is expected is right.
  void settle() { settled_ = true; }
  /// The robot was lost: whatever was known of its turn is void.
  void forget();

 private:
  int turns_;
  Eigen::Vector2d centre_m_;
  double distance_m_;
  std::optional<Eigen::Vector2d> from_;
  bool settled_ = false;
};

}  // namespace skylight
