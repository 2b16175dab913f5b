// Whether a scenario's expectations are kept by what was scored.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "service/evaluation/contest.hpp"

namespace skylight::service {

struct Judgement {
  Expected expected;
  /// Whose figure `value` is; empty for those of all robots together. Where each robot must keep it: the one
  /// that is furthest on the wrong side, or nearest to it.
  std::string robot;
  std::optional<double> value;  ///< none where there was nothing to measure (no pose at all): not kept
  bool kept = false;
};

/// A robot's figure by its name in scenarios; errors in metres and degrees. None where nothing was measured,
/// or for a name of another kind of figure.
std::optional<double> robot_figure(const std::string& figure, const RobotScore& score);

/// In their order. "Each robot" leaves out those that nothing tells apart: the tracker cannot know them.
/// Throws std::invalid_argument where a kind of pose that is needed was not scored, or a robot is unknown.
std::vector<Judgement> judge(const std::vector<Expected>& expected, const RunScore& run);

/// "kept   max_error_m of anna (filtered): 0.0031, at most 0.005"
std::string judgement_line(const Judgement& judgement);

}  // namespace skylight::service
