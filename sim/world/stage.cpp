#include "sim/world/stage.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "sim/scenario/outline.hpp"
#include "sim/scenario/scenario_checks.hpp"
#include "sim/world/actors.hpp"
#include "sim/world/program.hpp"
#include "sim/world/surroundings.hpp"

namespace skylight::sim {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
/// Programs steer this many steps apart (100 Hz); the motors see to the rest.
constexpr std::int64_t kStepsPerCommand = 5;
constexpr Duration kTryAgain = std::chrono::milliseconds(100);

// Streams of the scenario's seed.
constexpr std::uint64_t kProgramStream = 0x70726F6772616D00U;
constexpr std::uint64_t kOdometryStream = 0x6F646F6D65747279U;

Pose2 pose_of(const StartSpec& start) {
  return {start.x_m, start.y_m, wrap_angle(start.yaw_deg * kRadians)};
}

/// What somebody else does with a robot for a while.
struct Hold {
  Duration until{};
  Command command;
};

struct RobotRun {
  Program program;
  Odometry odometry;
  Outline outline;  ///< about base_link
  bool wanders = false;
  bool on = true;
  std::int64_t own_steps = 0;  ///< of its program's time
  Command asked;               ///< by its program
  std::optional<Hold> driven;
  std::optional<Duration> slips_until;
  std::optional<KidnapAction> carried;
  Duration back_at{};  ///< when it is to be put down
};

/// An event's action that found its place occupied.
struct Waiting {
  Duration again{};
  std::string name;
  Action action;
};

bool has_wander(const std::vector<ProgramStep>& steps) {
  return std::any_of(steps.begin(), steps.end(), [](const ProgramStep& step) {
    if (const auto* repeat = std::get_if<RepeatStep>(&step.action)) return has_wander(repeat->steps);
    if (const auto* parallel = std::get_if<ParallelStep>(&step.action)) return has_wander(parallel->steps);
    return std::holds_alternative<WanderStep>(step.action);
  });
}

RobotRun make_run(const Scenario& scenario, const RobotSpec& spec, std::size_t index) {
  const RobotModel& model = robot_model(spec.model);
  const auto steps = with_runs_inlined(spec.program, scenario.programs);
  const Outline outline = robot_outline(model);
  DriveLimits limits{model.max_speed_mps, model.max_side_speed_mps, model.max_yaw_rate_radps,
                     model.max_yaw_acceleration_radps2, 0.0};
  for (const Eigen::Vector2d& corner : outline) limits.reach_m = std::max(limits.reach_m, corner.norm());
  return {.program = Program(steps, limits, mixed(mixed(scenario.seed, kProgramStream), index)),
          .odometry = Odometry(spec.odometry, model, mixed(mixed(scenario.seed, kOdometryStream), index)),
          .outline = outline,
          .wanders = has_wander(steps)};
}

}  // namespace

struct Stage::Impl : Situation {
  explicit Impl(const Scenario& scenario_in);

  // Conditions of events.
  std::optional<Pose2> place_of(const std::string& robot) const override;
  bool touches_something(const std::string& robot) const override;
  bool program_done(const std::string& robot) const override;

  // One step.
  void let_events_happen();
  void end_what_is_over();
  void steer();
  void report();

  // Actions.
  void check(const Action& action) const;
  void perform(const std::string& name, const Action& action);
  bool can(const Action& action) const;
  void carry_out(const Action& action);
  void put_back_if_free(std::size_t robot);

  template <class Plain>
  void apply(const Plain& action) {
    effects.push_back({time, action});
  }
  void apply(const SignalAction&) {}
  void apply(const KidnapAction& action);
  void apply(const PowerAction& action);
  void apply(const SlipAction& action);
  void apply(const DriveAction& action);
  void apply(const PushAction& action);
  void apply(const PutAction& action);
  void apply(const RemoveAction& action);

  Scenario scenario;
  Actors actors;
  std::vector<RobotRun> runs;
  Director director;
  std::int64_t steps = 0;
  Duration time{};
  Timeline timeline;
  std::vector<Command> commands;
  std::vector<Waiting> waiting;
  std::vector<Effect> effects;
  std::vector<Happening> happenings;
  std::vector<OdometryReport> reports;
};

Stage::Impl::Impl(const Scenario& scenario_in)
    : scenario(scenario_in),
      actors(scenario),
      director(scenario.events),
      timeline(actors.states()),
      commands(actors.robots().size()) {
  for (std::size_t i = 0; i < actors.robots().size(); ++i)
    runs.push_back(make_run(scenario, actors.robots()[i], i));
  report();
}

// ---- Conditions of events.

std::optional<Pose2> Stage::Impl::place_of(const std::string& robot) const {
  const BodyState state = actors.world.state(actors.robot(robot));
  return state.present ? std::optional(state.pose) : std::nullopt;
}
bool Stage::Impl::touches_something(const std::string& robot) const {
  return actors.world.in_contact(actors.robot(robot));
}
bool Stage::Impl::program_done(const std::string& robot) const {
  return runs[actors.robot(robot)].program.finished();
}

// ---- One step.

void Stage::Impl::let_events_happen() {
  for (const std::size_t event : director.due(time, *this))
    perform(director.events()[event].name, director.events()[event].action);
  std::vector<Waiting> again;
  again.swap(waiting);
  for (Waiting& one : again) {
    if (time >= one.again) {
      perform(one.name, one.action);
    } else {
      waiting.push_back(std::move(one));
    }
  }
}

void Stage::Impl::end_what_is_over() {
  for (std::size_t i = 0; i < runs.size(); ++i) {
    RobotRun& run = runs[i];
    if (run.driven && time >= run.driven->until) run.driven.reset();
    if (run.slips_until && time >= *run.slips_until) {
      run.slips_until.reset();
      actors.world.set_grip(i, 1.0);
    }
    if (run.carried && time >= run.back_at) put_back_if_free(i);
  }
}

/// Each robot's command for this step. A program's time goes on only while it has the robot.
void Stage::Impl::steer() {
  const bool programs_look = steps % kStepsPerCommand == 0;
  Surroundings surroundings;
  const bool needed =
      programs_look && std::any_of(runs.begin(), runs.end(), [](const RobotRun& run) { return run.wanders; });
  if (needed) surroundings = actors.look_around();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    RobotRun& run = runs[i];
    commands[i] = {};
    if (!run.on || run.carried) continue;
    if (run.driven) {
      commands[i] = run.driven->command;
      continue;
    }
    if (programs_look) {
      run.asked = run.program.command({.time_s = to_seconds(run.own_steps * World::kStep),
                                       .pose = actors.world.state(i).pose,
                                       .self = i,
                                       .surroundings = needed ? &surroundings : nullptr,
                                       .fired = &director.happened()});
    }
    commands[i] = run.asked;
    ++run.own_steps;
  }
}

void Stage::Impl::report() {
  for (std::size_t i = 0; i < runs.size(); ++i) {
    RobotRun& run = runs[i];
    if (!run.odometry.due(time)) continue;
    if (!run.on) {
      run.odometry.skip(time);
      continue;
    }
    reports.push_back(run.odometry.report(time));
    reports.back().robot = i;
    reports.back().at += from_seconds(scenario.start_unix_s);
  }
}

// ---- Actions.

/// What makes an action impossible, said by throwing.
void Stage::Impl::check(const Action& action) const {
  const auto* remove = std::get_if<RemoveAction>(&action);
  if (remove != nullptr) {
    if (!actors.present_thing(remove->object))
      throw std::invalid_argument("object: there is no thing called \"" + remove->object + "\" in the room");
    return;
  }
  if (const auto problem = find_action_problem(scenario, action, ""))
    throw std::invalid_argument(problem->path + ": " + problem->message);
  const auto* put = std::get_if<PutAction>(&action);
  if (put == nullptr) return;
  const ObjectSpec& thing = put->object;
  for (std::size_t i = 0; i < actors.count(); ++i) {
    const bool gone = i >= actors.thing(0) && !actors.world.state(i).present;
    if (!gone && actors.id(i) == thing.id)
      throw std::invalid_argument("object.id: \"" + thing.id + "\" is taken");
  }
  if (actors.hangs(thing)) return;
  if (!within(scenario.room, outline(thing)))
    throw std::invalid_argument("object: \"" + thing.id + "\" would stand outside the room or in its wall (" +
                                room_range(scenario.room) + ", with all of it)");
  if (const auto other = actors.occupant({outline(thing)}, World::kWall))
    throw std::invalid_argument("object: the place is occupied by " + actors.id(*other));
}

/// Whether an event's action can be done now; one that cannot waits.
bool Stage::Impl::can(const Action& action) const {
  if (!std::holds_alternative<PutAction>(action)) return true;
  try {
    check(action);
  } catch (const std::invalid_argument&) {
    return false;
  }
  return true;
}

void Stage::Impl::perform(const std::string& name, const Action& action) {
  if (can(action)) {
    happenings.push_back({Time{from_seconds(scenario.start_unix_s)} + time, name, action});
    carry_out(action);
  } else {
    waiting.push_back({time + kTryAgain, name, action});
  }
}

void Stage::Impl::carry_out(const Action& action) {
  std::visit([&](const auto& one) { apply(one); }, action);
}

void Stage::Impl::apply(const KidnapAction& action) {
  const std::size_t robot = actors.robot(action.robot);
  runs[robot].carried = action;
  runs[robot].back_at = time + from_seconds(action.away_s);
  if (action.away_s <= 0.0) {
    put_back_if_free(robot);
  } else {
    actors.world.take_away(robot);
  }
}

void Stage::Impl::put_back_if_free(std::size_t robot) {
  RobotRun& run = runs[robot];
  const Pose2 to = pose_of(run.carried->to);
  if (actors.occupant({placed(run.outline, to)}, robot)) {
    actors.world.take_away(robot);
    run.back_at = time + kTryAgain;
    return;
  }
  actors.world.take_away(robot);
  actors.world.put_down(robot, to);
  run.program.moved_to(to);
  run.carried.reset();
}

void Stage::Impl::apply(const PowerAction& action) {
  runs[actors.robot(action.robot)].on = action.on;
}

void Stage::Impl::apply(const SlipAction& action) {
  const std::size_t robot = actors.robot(action.robot);
  actors.world.set_grip(robot, action.grip);
  runs[robot].slips_until = time + from_seconds(action.for_s);
}

void Stage::Impl::apply(const DriveAction& action) {
  runs[actors.robot(action.robot)].driven =
      Hold{time + from_seconds(action.for_s), {action.v_mps, action.side_mps, action.w_degps * kRadians}};
}

void Stage::Impl::apply(const PushAction& action) {
  actors.world.push(actors.robot(action.robot), {action.impulse_ns[0], action.impulse_ns[1]});
}

void Stage::Impl::apply(const PutAction& action) {
  actors.put(action.object);
  effects.push_back({time, action});
}

void Stage::Impl::apply(const RemoveAction& action) {
  const auto thing = actors.present_thing(action.object);
  if (!thing) return;
  actors.world.take_away(*thing);
  effects.push_back({time, action});
}

// ---- The public class.

Stage::Stage(const Scenario& scenario) : impl_(std::make_unique<Impl>(scenario)) {}
Stage::~Stage() = default;
Stage::Stage(Stage&&) noexcept = default;
Stage& Stage::operator=(Stage&&) noexcept = default;

void Stage::advance() {
  Impl& my = *impl_;
  my.let_events_happen();
  my.end_what_is_over();
  my.steer();
  const Duration next = (my.steps + 1) * World::kStep;
  my.actors.walk(next);
  my.actors.world.step(my.commands);
  ++my.steps;
  my.time = next;
  for (std::size_t i = 0; i < my.runs.size(); ++i)
    my.runs[i].odometry.turn(my.actors.world.wheel_speeds(i), to_seconds(World::kStep));
  my.timeline.append(my.actors.states(), my.actors.world.touches());
  my.report();
}

Duration Stage::time() const {
  return impl_->time;
}
std::size_t Stage::actor_count() const {
  return impl_->actors.count();
}
Actor Stage::actor(std::size_t index) const {
  const Actors& actors = impl_->actors;
  if (index < actors.person(0)) return {ActorKind::robot, index};
  if (index < actors.thing(0)) return {ActorKind::person, index - actors.person(0)};
  return {ActorKind::thing, index - actors.thing(0)};
}
const std::string& Stage::id(std::size_t actor) const {
  return impl_->actors.id(actor);
}
const std::vector<RobotSpec>& Stage::robots() const {
  return impl_->actors.robots();
}
const std::vector<PersonSpec>& Stage::people() const {
  return impl_->actors.people();
}
const std::vector<ObjectSpec>& Stage::things() const {
  return impl_->actors.things();
}
const Timeline& Stage::timeline() const {
  return impl_->timeline;
}
void Stage::forget_before(Duration time) {
  impl_->timeline.forget_before(time);
}

std::vector<std::string> Stage::touches(std::size_t actor, Duration time) const {
  std::vector<std::string> ids;
  for (const std::size_t other : impl_->timeline.touches(actor, time))
    ids.push_back(other == World::kWall ? "wall" : impl_->actors.id(other));
  return ids;
}

bool Stage::program_done(std::size_t robot) const {
  return impl_->runs.at(robot).program.finished();
}
bool Stage::powered(std::size_t robot) const {
  return impl_->runs.at(robot).on;
}

void Stage::act(const Action& action) {
  impl_->check(action);
  impl_->perform("", action);
}

std::vector<Effect> Stage::take_effects() {
  return std::exchange(impl_->effects, {});
}
std::vector<Happening> Stage::take_happenings() {
  return std::exchange(impl_->happenings, {});
}
std::vector<OdometryReport> Stage::take_odometry() {
  return std::exchange(impl_->reports, {});
}

}  // namespace skylight::sim
