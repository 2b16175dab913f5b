#include "sim/world/program.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace skylight::sim {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kBrake = 0.4;          ///< m/s^2, how gently a motion comes to its end
constexpr double kTurnBrake = 1.5;      ///< rad/s^2, the same on the spot
constexpr double kCrossGain = 6.0;      ///< 1/m^2: curvature per metre beside the path
constexpr double kHeadingGain = 4.0;    ///< 1/m: curvature per radian off its direction (critically damped)
constexpr double kLookahead = 0.25;     ///< m, pure pursuit
constexpr double kArrived = 0.002;      ///< m, a place is reached
constexpr double kTurnArrived = 0.002;  ///< rad, a heading is reached

/// Speed at which braking by `brake` stops after `remaining`; a floor lets the end be reached.
double approach_speed(double speed, double remaining, double brake, double floor) {
  return std::min(speed, std::max(floor, std::sqrt(2.0 * brake * std::max(0.0, remaining))));
}

bool is_moving(const ProgramStep* step) {
  return step != nullptr && !std::holds_alternative<StopStep>(step->action) &&
         !std::holds_alternative<TurnStep>(step->action);
}

double sign_of(double value) {
  return value < 0.0 ? -1.0 : 1.0;
}

/// The arc from the robot's heading through the target; on the spot first when that lies aside or behind.
Command pursue(const Eigen::Vector2d& target, double v, const Pose2& pose) {
  const Eigen::Vector2d ahead = target - pose.position();
  const double off = wrap_angle(std::atan2(ahead.y(), ahead.x()) - pose.yaw);
  if (std::abs(off) > 1.0) return {0.0, sign_of(off) * std::min(1.2, 2.0 * std::abs(off))};
  return {v, v * 2.0 * std::sin(off) / ahead.norm()};
}

}  // namespace

Program::Program(std::vector<ProgramStep> steps, const DriveLimits& limits)
    : steps_(std::make_shared<const std::vector<ProgramStep>>(std::move(steps))), limits_(limits) {
  levels_.push_back({steps_.get()});
}

Command Program::command(double time_s, const Pose2& pose) {
  // A step may be over the moment it begins; the bound is for programs of nothing but such steps.
  for (int guard = 0; guard < 1000; ++guard) {
    if (!current_ && !begin_next(time_s, pose)) return {};
    current_->turned_rad += wrap_angle(pose.yaw - current_->last_yaw);
    current_->last_yaw = pose.yaw;
    const auto command =
        std::visit([&](const auto& step) { return follow(step, time_s, pose); }, current_->step->action);
    if (command) return limited(*command);
    current_.reset();
  }
  return {};
}

/// The next motion, repeats unrolled; none (and no levels) at the program's end.
const ProgramStep* Program::advance(std::vector<Level>& levels) {
  while (!levels.empty()) {
    Level& level = levels.back();
    if (level.next == level.steps->size()) {
      level.next = 0;
      if (level.rounds != 0 && --level.rounds == 0) levels.pop_back();
      continue;
    }
    const ProgramStep& step = (*level.steps)[level.next++];
    const auto* repeat = std::get_if<RepeatStep>(&step.action);
    if (repeat == nullptr) return &step;
    levels.push_back({&repeat->steps, 0, repeat->times});
  }
  return nullptr;
}

bool Program::begin_next(double time_s, const Pose2& pose) {
  const ProgramStep* step = advance(levels_);
  if (step == nullptr) return false;
  std::vector<Level> ahead = levels_;
  current_ = Progress{step, is_moving(advance(ahead)), time_s, pose, 0.0, pose.yaw, 0, pose.position()};
  return true;
}

std::optional<Command> Program::follow(const DriveStep& step, double time_s, const Pose2&) {
  if (time_s - current_->start_s >= step.for_s - 1e-9) return std::nullopt;
  return Command{step.v_mps, step.w_degps * kRadians};
}

std::optional<Command> Program::follow(const StopStep& step, double time_s, const Pose2&) {
  if (time_s - current_->start_s >= step.for_s - 1e-9) return std::nullopt;
  return Command{};
}

std::optional<Command> Program::follow(const RepeatStep&, double, const Pose2&) {
  return std::nullopt;  // advance() never hands one out
}

std::optional<Command> Program::follow(const LineStep& step, double, const Pose2& pose) {
  const Eigen::Vector2d along(std::cos(current_->start.yaw), std::sin(current_->start.yaw));
  const Eigen::Vector2d travelled = pose.position() - current_->start.position();
  const double remaining = step.distance_m.value_or(0.0) - travelled.dot(along);
  if (remaining < kArrived) return std::nullopt;
  const double beside = along.x() * travelled.y() - along.y() * travelled.x();
  const double off = wrap_angle(pose.yaw - current_->start.yaw);
  const double v =
      current_->goes_on ? step.speed_mps : approach_speed(step.speed_mps, remaining, kBrake, 0.01);
  return Command{v, -v * (kCrossGain * beside + kHeadingGain * off)};
}

std::optional<Command> Program::follow(const ArcStep& step, double, const Pose2& pose) {
  const double side = sign_of(step.angle_deg);
  const double remaining_rad = std::abs(step.angle_deg) * kRadians - side * current_->turned_rad;
  const double remaining = remaining_rad * step.radius_m;
  if (remaining < kArrived) return std::nullopt;
  const Eigen::Vector2d left(-std::sin(current_->start.yaw), std::cos(current_->start.yaw));
  const Eigen::Vector2d centre = current_->start.position() + side * step.radius_m * left;
  const Eigen::Vector2d outward = pose.position() - centre;
  const double beside = outward.norm() - step.radius_m;  // outside the circle
  const double tangent = std::atan2(outward.y(), outward.x()) + side * 0.5 * std::numbers::pi;
  const double off = wrap_angle(pose.yaw - tangent);
  const double v =
      current_->goes_on ? step.speed_mps : approach_speed(step.speed_mps, remaining, kBrake, 0.01);
  return Command{v, v * (side / step.radius_m + side * kCrossGain * beside - kHeadingGain * off)};
}

std::optional<Command> Program::follow(const TurnStep& step, double, const Pose2&) {
  const double side = sign_of(step.angle_deg);
  const double remaining = std::abs(step.angle_deg) * kRadians - side * current_->turned_rad;
  if (remaining < kTurnArrived) return std::nullopt;
  return Command{0.0, side * approach_speed(step.rate_degps * kRadians, remaining, kTurnBrake, 0.03)};
}

/// Pure pursuit (Coulter 1992): the arc through the point one lookahead further on the path.
std::optional<Command> Program::follow(const WaypointsStep& step, double, const Pose2& pose) {
  const std::size_t count = step.points_m.size();
  for (std::size_t tries = 0; tries <= count; ++tries) {
    const auto& point = step.points_m[current_->waypoint];
    const Eigen::Vector2d to(point[0], point[1]);
    const bool last = !step.loop && current_->waypoint + 1 == count;
    const Eigen::Vector2d leg = to - current_->leg_start;
    const Eigen::Vector2d along =
        leg.norm() > 1e-9 ? Eigen::Vector2d(leg.normalized()) : Eigen::Vector2d::Zero();
    const double remaining = (to - pose.position()).dot(along);
    if (remaining > (last ? kArrived : 0.6 * kLookahead)) {
      const double v = last && !current_->goes_on ? approach_speed(step.speed_mps, remaining, kBrake, 0.01)
                                                  : step.speed_mps;
      return pursue(to + along * (kLookahead - remaining) * (last || remaining > kLookahead ? 1.0 : 0.0), v,
                    pose);
    }
    if (last) return std::nullopt;
    current_->leg_start = to;
    current_->waypoint = (current_->waypoint + 1) % count;
  }
  return Command{};  // a loop of points that lie on one another: there is nowhere to go
}

/// Within what the robot can do, the ratio of speed to yaw rate (the path's curvature) kept.
Command Program::limited(Command command) const {
  const double over = std::max({1.0, std::abs(command.v_mps) / limits_.max_speed_mps,
                                std::abs(command.w_radps) / limits_.max_yaw_rate_radps});
  return {command.v_mps / over, command.w_radps / over};
}

}  // namespace skylight::sim
