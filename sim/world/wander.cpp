#include "sim/world/wander.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/world/surroundings.hpp"

namespace skylight::sim {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kPlanEvery = 0.05;    ///< s
constexpr double kHorizon = 1.5;       ///< s, so far it looks ahead
constexpr double kSample = 0.1;        ///< m along an arc
constexpr double kSpare = 0.02;        ///< m kept beside avoid_m, for braking and between samples
constexpr double kGiven = 0.005;       ///< m of what is spare, at a time
constexpr double kTouching = 0.02;     ///< m: nearer than this it goes only away
constexpr double kSlowestTurn = 0.35;  ///< rad/s: it turns away at least as fast
constexpr double kForgetSide = 1.0;    ///< s
constexpr double kWatch = 3.0;         ///< s: that it does not get on is noticed after so long
constexpr double kStuckWay = 0.02;     ///< m: who moves and turns less does not get on
constexpr double kStuckTurn = 0.2;     ///< rad
constexpr double kBackOff = 1.0;       ///< s

}  // namespace

Wanderer::Wanderer(const WanderStep& step, const DriveLimits& limits, std::uint64_t seed, double now_s)
    : step_(step),
      limits_(limits),
      chance_(seed, 0),
      fastest_turn_(std::max(step.rate_degps * kRadians, kSlowestTurn)),
      next_change_s_(now_s),
      next_plan_s_(now_s),
      clear_since_s_(now_s),
      watched_since_s_(now_s),
      free_until_s_(now_s),
      back_until_s_(now_s) {}

/// The next speed and turn rate; gentle turns are likelier than sharp ones.
void Wanderer::draw() {
  const bool stops = chance_.uniform() < step_.stops;
  const double v = step_.speed_mps * (0.3 + 0.7 * chance_.uniform());
  const double turn = 2.0 * chance_.uniform() - 1.0;
  wanted_ = stops ? Arc{0.0, 0.0} : Arc{v, step_.rate_degps * kRadians * turn * std::abs(turn)};
  next_change_s_ += chance_.exponential(60.0 / step_.changes_per_min);
}

Command Wanderer::next(const ProgramContext& context) {
  while (context.time_s >= next_change_s_) {
    draw();
    next_plan_s_ = context.time_s;
  }
  if (const auto freeing = free_itself(context)) {
    next_plan_s_ = context.time_s;
    return {freeing->v, 0.0, freeing->w};
  }
  if (context.time_s >= next_plan_s_ - 1e-9) {
    next_plan_s_ = context.time_s + kPlanEvery;
    chosen_ = plan(context);
  }
  return {chosen_.v, 0.0, chosen_.w};
}

Wanderer::Arc Wanderer::plan(const ProgramContext& context) {
  if (step_.avoid_m <= 0.0 || context.surroundings == nullptr) return wanted_;
  const auto obstacles = near(context);
  const double keep = step_.avoid_m + kSpare;
  if (room_ahead(context, obstacles, wanted_, keep) >= keep) {
    if (context.time_s - clear_since_s_ > kForgetSide) side_ = 0;
    return wanted_;
  }
  clear_since_s_ = context.time_s;
  const double now = clearance(context, obstacles, context.pose.position(), 0.0);
  if (now >= step_.avoid_m && wanted_.v == 0.0) return wanted_;  // it stops; others see to their own way
  const Arc arc = best_arc(context, obstacles, now);
  if (side_ == 0 && arc.w != 0.0) side_ = arc.w > 0.0 ? 1 : -1;
  return arc;
}

/// What could matter within the horizon.
std::vector<const Obstacle*> Wanderer::near(const ProgramContext& context) const {
  std::vector<const Obstacle*> result;
  for (const Obstacle& obstacle : context.surroundings->obstacles) {
    if (obstacle.actor == context.self) continue;
    const double reach = limits_.reach_m + step_.avoid_m + kSpare + obstacle.radius_m +
                         kHorizon * (step_.speed_mps + obstacle.velocity.norm());
    if ((obstacle.middle - context.pose.position()).squaredNorm() < reach * reach)
      result.push_back(&obstacle);
  }
  return result;
}

/// From the disc around the robot to the nearest thing or wall, negative where they overlap.
double Wanderer::clearance(const ProgramContext& context, const std::vector<const Obstacle*>& obstacles,
                           const Eigen::Vector2d& place, double ahead_s) const {
  const auto& room = context.surroundings->room_m;
  double least = std::min(0.5 * room[0] - std::abs(place.x()), 0.5 * room[1] - std::abs(place.y()));
  for (const Obstacle* obstacle : obstacles) {
    const Eigen::Vector2d then = place - obstacle->velocity * ahead_s;
    if ((then - obstacle->middle).norm() - obstacle->radius_m >= least) continue;
    least = std::min(least, distance(obstacle->outline, then));
  }
  return least - limits_.reach_m;
}

/// The least clearance on an arc's way, or the first that is below `good_enough`.
double Wanderer::room_ahead(const ProgramContext& context, const std::vector<const Obstacle*>& obstacles,
                            Arc arc, double good_enough) const {
  const int samples = std::clamp(static_cast<int>(std::abs(arc.v) * kHorizon / kSample) + 1, 5, 40);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 1; i <= samples && least >= good_enough; ++i) {
    const double t = kHorizon * i / samples;
    const double half = 0.5 * arc.w * t;  // the chord of the arc
    const double chord = arc.v * t * (std::abs(half) > 1e-9 ? std::sin(half) / half : 1.0);
    const double direction = context.pose.yaw + half;
    const Eigen::Vector2d place =
        context.pose.position() + chord * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    least = std::min(least, clearance(context, obstacles, place, t));
  }
  return least;
}

/// The arc that costs least: differing from what is wanted, and, where there is no way round it, coming near.
Wanderer::Arc Wanderer::best_arc(const ProgramContext& context, const std::vector<const Obstacle*>& obstacles,
                                 double room_now) {
  const double keep = step_.avoid_m + kSpare;
  const bool strict = room_now >= step_.avoid_m;
  const double fastest = std::max(wanted_.v, 0.3 * step_.speed_mps);
  Arc best{0.0, (side_ != 0 ? side_ : (wanted_.w < 0.0 ? -1 : 1)) * fastest_turn_};
  double least_cost = std::numeric_limits<double>::infinity();
  for (const double speed : {1.0, 0.5, 0.0, -0.5}) {
    for (int turn = -4; turn <= 4; ++turn) {
      const Arc arc{speed * fastest, 0.25 * turn * fastest_turn_};
      if (speed <= 0.0 && (turn == 0 || (turn != 4 && turn != -4)) && (speed == 0.0 || turn != 0)) continue;
      if (strict && speed < 0.0) continue;
      double cost =
          std::abs(arc.v - fastest) / step_.speed_mps + 0.5 * std::abs(arc.w - wanted_.w) / fastest_turn_;
      if (side_ * arc.w < 0.0) cost += 0.6;
      if (cost >= least_cost) continue;
      const double room = speed == 0.0 ? room_now : room_ahead(context, obstacles, arc, -1e9);
      if (strict && room < std::min(keep, std::max(step_.avoid_m, room_now - kGiven))) continue;
      if (room < std::min(kTouching, room_now)) continue;
      cost += 4.0 * std::max(0.0, (keep - room) / keep);
      if (cost >= least_cost) continue;
      least_cost = cost;
      best = arc;
    }
  }
  return best;
}

/// What wants to go but does not get on backs off and turns, whatever holds it.
std::optional<Wanderer::Arc> Wanderer::free_itself(const ProgramContext& context) {
  const double t = context.time_s;
  if (t < back_until_s_) return Arc{way_back_ * 0.5 * step_.speed_mps, 0.0};
  if (t < free_until_s_) return Arc{0.0, way_round_ * fastest_turn_};
  const bool moves = chosen_.v != 0.0 || chosen_.w != 0.0;
  if (!moves || !watched_ || (context.pose.position() - watched_->position()).norm() > kStuckWay ||
      std::abs(wrap_angle(context.pose.yaw - watched_->yaw)) > kStuckTurn) {
    watched_ = context.pose;
    watched_since_s_ = t;
    return std::nullopt;
  }
  if (t - watched_since_s_ < kWatch) return std::nullopt;
  way_back_ = chosen_.v < 0.0 ? 1.0 : -1.0;
  way_round_ = chance_.uniform() < 0.5 ? -1.0 : 1.0;
  side_ = 0;
  back_until_s_ = t + kBackOff;
  free_until_s_ = back_until_s_ + (1.0 + chance_.uniform()) * 1.2 / fastest_turn_;
  watched_.reset();
  return Arc{way_back_ * 0.5 * step_.speed_mps, 0.0};
}

}  // namespace skylight::sim
