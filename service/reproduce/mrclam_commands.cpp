#include <algorithm>
#include <cmath>
#include <vector>

#include "service/reproduce/mrclam.hpp"

namespace skylight::service::reproduce {
namespace {

constexpr Duration kAside = std::chrono::milliseconds(100);
constexpr Duration kStep = std::chrono::milliseconds(50);
constexpr int kSteps = 10;

struct Motion {
  Time at{};
  double forward = 0.0;   ///< m/s
  double yaw_rate = 0.0;  ///< rad/s
};

/// By the truth a little before and after each frame.
std::vector<Motion> true_motion(const MrclamRun& run) {
  std::vector<Motion> out;
  for (const MrclamFrame& frame : run.frames) {
    const auto before = truth_at(run.robot, frame.captured - kAside);
    const auto after = truth_at(run.robot, frame.captured + kAside);
    if (!frame.truth || !before || !after) continue;
    const double seconds = to_seconds(2 * kAside);
    const Eigen::Vector2d way = after->position() - before->position();
    out.push_back(
        {.at = frame.captured,
         .forward =
             way.dot(Eigen::Vector2d(std::cos(frame.truth->yaw), std::sin(frame.truth->yaw))) / seconds,
         .yaw_rate = wrap_angle(after->yaw - before->yaw) / seconds});
  }
  return out;
}

MrclamCommands at_lead(const MrclamRun& run, const std::vector<Motion>& motion, Duration lead) {
  MrclamCommands out{.lead_s = to_seconds(lead)};
  double turns = 0.0;
  double turned = 0.0;
  double speeds = 0.0;
  double sped = 0.0;
  auto next = run.robot.odometry.begin();
  for (const Motion& one : motion) {
    while (next != run.robot.odometry.end() && next->at + lead <= one.at) ++next;
    if (next == run.robot.odometry.begin()) continue;
    const BodyVelocity& said = *std::prev(next);
    out.yaw_rate_rms += (one.yaw_rate - said.yaw_rate) * (one.yaw_rate - said.yaw_rate);
    turns += said.yaw_rate * said.yaw_rate;
    turned += said.yaw_rate * one.yaw_rate;
    speeds += said.forward * said.forward;
    sped += said.forward * one.forward;
  }
  out.yaw_rate_rms =
      std::sqrt(out.yaw_rate_rms / static_cast<double>(std::max<std::size_t>(1, motion.size())));
  out.yaw_scale = turns > 0.0 ? turned / turns : 0.0;
  out.forward_scale = speeds > 0.0 ? sped / speeds : 0.0;
  return out;
}

}  // namespace

MrclamCommands judge_commands(const MrclamRun& run) {
  const std::vector<Motion> motion = true_motion(run);
  MrclamCommands best = at_lead(run, motion, Duration::zero());
  for (int i = 1; i <= kSteps; ++i) {
    const MrclamCommands one = at_lead(run, motion, i * kStep);
    if (one.yaw_rate_rms < best.yaw_rate_rms) best = one;
  }
  return best;
}

}  // namespace skylight::service::reproduce
