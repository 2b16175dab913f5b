#include "sim/world/program.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

namespace skylight::sim {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kRound = 2.0 * std::numbers::pi;
constexpr double kBrake = 0.4;         ///< m/s^2, how gently a motion comes to its end
constexpr double kTurnBrake = 1.5;     ///< rad/s^2, the same on the spot
constexpr double kHeadingGain = 4.0;   ///< 1/m: curvature per radian off its direction (critically damped)
constexpr double kApproachGain = 1.5;  ///< rad/m: how much it heads back towards its path per metre beside it
constexpr double kSteepest = 1.2;      ///< rad, and at most
constexpr double kSideGain = 2.0;      ///< 1/s: speed back to the path per metre, sideways
constexpr double kLookahead = 0.25;    ///< m, pure pursuit
constexpr double kArrived = 0.002;     ///< m, a place is reached
constexpr double kTurnArrived = 0.002;  ///< rad, a heading is reached
constexpr double kAligned = 0.01;       ///< rad, it may set off
constexpr double kAlignRate = 1.2;      ///< rad/s

/// Speed at which braking by `brake` stops after `remaining`; a floor lets the end be reached.
double approach_speed(double speed, double remaining, double brake, double floor) {
  return std::min(speed, std::max(floor, std::sqrt(2.0 * brake * std::max(0.0, remaining))));
}

bool is_moving(const ProgramStep* step) {
  if (step == nullptr) return false;
  const auto& action = step->action;
  if (const auto* line = std::get_if<LineStep>(&action)) return !line->to_m;
  return !std::holds_alternative<StopStep>(action) && !std::holds_alternative<TurnStep>(action) &&
         !std::holds_alternative<WaitStep>(action) && !std::holds_alternative<ParallelStep>(action);
}

double sign_of(double value) {
  return value < 0.0 ? -1.0 : 1.0;
}

/// Yaw rate that leads back to a path from `beside` it (to its left) and `off` its direction.
double steer(double v, double beside, double off) {
  return -v * kHeadingGain * (off + std::clamp(kApproachGain * beside, -kSteepest, kSteepest));
}

/// The arc from the robot's heading through the target; on the spot first when that lies aside or behind.
Command pursue(const Eigen::Vector2d& target, double v, const Pose2& pose) {
  const Eigen::Vector2d ahead = target - pose.position();
  const double off = wrap_angle(std::atan2(ahead.y(), ahead.x()) - pose.yaw);
  if (std::abs(off) > 1.0) return {.w_radps = sign_of(off) * std::min(kAlignRate, 2.0 * std::abs(off))};
  return {.v_mps = v, .w_radps = v * 2.0 * std::sin(off) / ahead.norm()};
}

}  // namespace

std::vector<ProgramStep> with_runs_inlined(const std::vector<ProgramStep>& steps,
                                           const NamedPrograms& named) {
  std::vector<ProgramStep> result;
  for (const ProgramStep& step : steps) {
    if (const auto* run = std::get_if<RunStep>(&step.action)) {
      const auto inlined = with_runs_inlined(named.at(run->program), named);
      result.insert(result.end(), inlined.begin(), inlined.end());
    } else if (const auto* repeat = std::get_if<RepeatStep>(&step.action)) {
      result.push_back({RepeatStep{repeat->times, with_runs_inlined(repeat->steps, named)}});
    } else if (const auto* parallel = std::get_if<ParallelStep>(&step.action)) {
      // A program that runs beside other steps stays one of them: its steps follow each other.
      ParallelStep parts;
      for (const ProgramStep& part : parallel->steps)
        parts.steps.push_back({RepeatStep{1, with_runs_inlined({part}, named)}});
      result.push_back({std::move(parts)});
    } else {
      result.push_back(step);
    }
  }
  return result;
}

Program::Program(std::vector<ProgramStep> steps, const DriveLimits& limits, std::uint64_t seed)
    : steps_(std::make_shared<const std::vector<ProgramStep>>(std::move(steps))),
      limits_(limits),
      seed_(seed) {
  levels_.push_back({steps_.get()});
}

Command Program::command(const ProgramContext& context) {
  // A step may be over the moment it begins; the bound is for programs of nothing but such steps.
  for (int guard = 0; guard < 1000; ++guard) {
    if (!current_ && !begin_next(context)) return {};
    current_->turned_rad += wrap_angle(context.pose.yaw - current_->last_yaw);
    current_->last_yaw = context.pose.yaw;
    const auto command =
        std::visit([&](const auto& step) { return follow(step, context); }, current_->step->action);
    if (command) return limited(*command);
    current_.reset();
  }
  return {};
}

void Program::moved_to(const Pose2& pose) {
  if (!current_) return;
  current_->leg_start = pose.position();
  for (Program& part : current_->parts) part.moved_to(pose);
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

bool Program::begin_next(const ProgramContext& context) {
  const ProgramStep* step = advance(levels_);
  if (step == nullptr) return false;
  std::vector<Level> ahead = levels_;
  const Pose2& pose = context.pose;
  current_ = Progress{.step = step,
                      .goes_on = is_moving(advance(ahead)),
                      .start_s = context.time_s,
                      .start = pose,
                      .last_yaw = pose.yaw,
                      .leg_start = pose.position()};
  const std::uint64_t seed = mixed(seed_, ++begun_);
  if (const auto* wander = std::get_if<WanderStep>(&step->action))
    current_->wanderer.emplace(*wander, limits_, wander->seed != 0 ? mixed(wander->seed, begun_) : seed,
                               context.time_s);
  if (const auto* parallel = std::get_if<ParallelStep>(&step->action)) {
    for (const ProgramStep& part : parallel->steps) {
      const std::uint64_t number = current_->parts.size() + 1;
      current_->parts.push_back(Program({part}, limits_, mixed(seed, number)));
      current_->parts.back().alone_ = false;
    }
  }
  return true;
}

std::optional<Command> Program::follow(const DriveStep& step, const ProgramContext& context) {
  if (context.time_s - current_->start_s >= step.for_s - 1e-9) return std::nullopt;
  return Command{step.v_mps, step.side_mps, step.w_degps * kRadians};
}

std::optional<Command> Program::follow(const StopStep& step, const ProgramContext& context) {
  if (context.time_s - current_->start_s >= step.for_s - 1e-9) return std::nullopt;
  return Command{};
}

std::optional<Command> Program::follow(const WaitStep& step, const ProgramContext& context) {
  if (context.fired != nullptr && context.fired->contains(step.event)) return std::nullopt;
  if (step.at_most_s > 0.0 && context.time_s - current_->start_s >= step.at_most_s - 1e-9)
    return std::nullopt;
  return Command{};
}

std::optional<Command> Program::follow(const RepeatStep&, const ProgramContext&) {
  return std::nullopt;  // advance() never hands one out
}

std::optional<Command> Program::follow(const RunStep&, const ProgramContext&) {
  return std::nullopt;  // inlined before
}

std::optional<Command> Program::follow(const ParallelStep&, const ProgramContext& context) {
  Command sum;
  bool all_over = true;
  for (Program& part : current_->parts) {
    const Command command = part.command(context);
    sum.v_mps += command.v_mps;
    sum.side_mps += command.side_mps;
    sum.w_radps += command.w_radps;
    all_over = all_over && part.finished();
  }
  if (all_over) return std::nullopt;
  return sum;
}

std::optional<Command> Program::follow(const WanderStep& step, const ProgramContext& context) {
  if (step.for_s > 0.0 && context.time_s - current_->start_s >= step.for_s - 1e-9) return std::nullopt;
  return current_->wanderer->next(context);
}

/// A differential drive steers back to the line. A holonomic one goes back sideways, whichever way it faces,
/// and keeps its heading unless another step of a parallel one turns it.
std::optional<Command> Program::follow(const LineStep& step, const ProgramContext& context) {
  const Pose2& pose = context.pose;
  const bool holonomic = limits_.max_side_mps > 0.0;
  Eigen::Vector2d along(std::cos(current_->start.yaw), std::sin(current_->start.yaw));
  double length = step.distance_m.value_or(0.0);
  if (step.to_m) {
    const Eigen::Vector2d way = Eigen::Vector2d((*step.to_m)[0], (*step.to_m)[1]) - current_->leg_start;
    length = way.norm();
    if (length < kArrived) return std::nullopt;
    along = way / length;
  }
  const double direction = std::atan2(along.y(), along.x());
  const double off = wrap_angle(pose.yaw - direction);
  if (step.to_m && !current_->aligned && (!holonomic || alone_)) {
    const double rate = std::min(kAlignRate, limits_.max_yaw_rate_radps);
    if (std::abs(off) > kAligned)
      return Command{.w_radps = -sign_of(off) * approach_speed(rate, std::abs(off), kTurnBrake, 0.03)};
    current_->aligned = true;
    current_->leg_start = pose.position();
  }
  const Eigen::Vector2d from = step.to_m ? current_->leg_start : current_->start.position();
  const Eigen::Vector2d travelled = pose.position() - from;
  const double remaining = length - travelled.dot(along);
  if (remaining < kArrived) return std::nullopt;
  const double beside = along.x() * travelled.y() - along.y() * travelled.x();
  const double v =
      current_->goes_on ? step.speed_mps : approach_speed(step.speed_mps, remaining, kBrake, 0.01);
  if (!holonomic) return Command{.v_mps = v, .w_radps = steer(v, beside, off)};
  const Eigen::Vector2d left(-along.y(), along.x());
  const Eigen::Vector2d velocity =
      Eigen::Rotation2Dd(-pose.yaw) * Eigen::Vector2d(v * along - kSideGain * beside * left);
  return Command{velocity.x(), velocity.y(), alone_ ? -2.0 * off : 0.0};
}

std::optional<Command> Program::follow(const ArcStep& step, const ProgramContext& context) {
  const double side = sign_of(step.angle_deg);
  const double remaining = std::abs(step.angle_deg) * kRadians - side * current_->turned_rad;
  return follow(Curve{side, step.radius_m, step.speed_mps, remaining, current_->goes_on}, context);
}

std::optional<Command> Program::follow(const CircleStep& step, const ProgramContext& context) {
  const double side = step.right ? -1.0 : 1.0;
  const double remaining = step.rounds * kRound - side * current_->turned_rad;
  return follow(Curve{side, step.radius_m, step.speed_mps, remaining, current_->goes_on}, context);
}

/// Both circles touch where the step began, however often it goes round: what it is off does not add up. Its
/// motors need a while to turn it the other way: it begins half of that while before.
std::optional<Command> Program::follow(const FigureEightStep& step, const ProgramContext& context) {
  const double change_s = 2.0 * step.speed_mps / step.radius_m / limits_.max_yaw_acceleration_radps2;
  for (int circle = 0; circle < 2; ++circle) {
    const bool last = current_->second_circle && step.rounds != 0 && current_->rounds + 1 == step.rounds;
    const double side = current_->second_circle ? -1.0 : 1.0;
    const double remaining = current_->second_circle ? current_->turned_rad : kRound - current_->turned_rad;
    const auto command =
        follow(Curve{side, step.radius_m, step.speed_mps, remaining, !last || current_->goes_on,
                     last ? 0.0 : 0.5 * change_s * step.speed_mps},
               context);
    if (command || last) return command;
    if (current_->second_circle) ++current_->rounds;
    current_->second_circle = !current_->second_circle;
  }
  return Command{};
}

std::optional<Command> Program::follow(const Curve& curve, const ProgramContext& context) const {
  const double remaining = curve.remaining_rad * curve.radius_m;
  if (remaining < std::max(kArrived, curve.early_m)) return std::nullopt;
  const Pose2& start = current_->start;
  const Eigen::Vector2d left(-std::sin(start.yaw), std::cos(start.yaw));
  const Eigen::Vector2d outward =
      context.pose.position() - (start.position() + curve.side * curve.radius_m * left);
  const double outside = outward.norm() - curve.radius_m;
  const double tangent = std::atan2(outward.y(), outward.x()) + curve.side * 0.5 * std::numbers::pi;
  const double off = wrap_angle(context.pose.yaw - tangent);
  const double v = curve.goes_on ? curve.speed_mps : approach_speed(curve.speed_mps, remaining, kBrake, 0.01);
  return Command{.v_mps = v,
                 .w_radps = v * curve.side / curve.radius_m + steer(v, -curve.side * outside, off)};
}

std::optional<Command> Program::follow(const TurnStep& step, const ProgramContext&) {
  const double side = sign_of(step.angle_deg);
  const double remaining = std::abs(step.angle_deg) * kRadians - side * current_->turned_rad;
  if (remaining < kTurnArrived) return std::nullopt;
  return Command{.w_radps = side * approach_speed(step.rate_degps * kRadians, remaining, kTurnBrake, 0.03)};
}

/// Pure pursuit (Coulter 1992): the arc through the point one lookahead further on the path.
std::optional<Command> Program::follow(const WaypointsStep& step, const ProgramContext& context) {
  const Pose2& pose = context.pose;
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

/// Within what the robot can do, the ratios of the speeds to each other (the path's curvature) kept.
Command Program::limited(Command command) const {
  if (limits_.max_side_mps <= 0.0) command.side_mps = 0.0;
  double over = std::max({1.0, std::abs(command.v_mps) / limits_.max_speed_mps,
                          std::abs(command.w_radps) / limits_.max_yaw_rate_radps});
  if (command.side_mps != 0.0) over = std::max(over, std::abs(command.side_mps) / limits_.max_side_mps);
  return {command.v_mps / over, command.side_mps / over, command.w_radps / over};
}

}  // namespace skylight::sim
