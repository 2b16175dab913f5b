#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "settings/text.hpp"
#include "sim/scenario/robot_model.hpp"
#include "sim/scenario/scenario_checks.hpp"

namespace skylight::sim {
namespace {

using settings::number_text;

/// Checks the steps of a program against the robot, the room and what the scenario names. Named programs are
/// followed where they are run: what one robot can do another cannot.
class ProgramCheck {
 public:
  ProgramCheck(const Scenario& scenario, const RobotSpec& robot)
      : scenario_(scenario), robot_(robot), model_(robot_model(robot.model)) {}

  std::optional<Problem> steps(const std::vector<ProgramStep>& steps, const std::string& path) const {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::string here = element(path, i);
      if (auto problem = std::visit([&](const auto& step) { return check(step, here); }, steps[i].action))
        return problem;
      if (never_ends(steps[i]) && i + 1 < steps.size())
        return Problem{element(path, i + 1), "is never reached: the step before it goes on for ever"};
    }
    return std::nullopt;
  }

 private:
  bool never_ends(const ProgramStep& step) const {
    const auto some = [&](const std::vector<ProgramStep>& steps) {
      return std::any_of(steps.begin(), steps.end(), [&](const ProgramStep& s) { return never_ends(s); });
    };
    if (const auto* repeat = std::get_if<RepeatStep>(&step.action))
      return repeat->times == 0 || some(repeat->steps);
    if (const auto* parallel = std::get_if<ParallelStep>(&step.action)) return some(parallel->steps);
    if (const auto* run = std::get_if<RunStep>(&step.action))
      return some(scenario_.programs.at(run->program));
    if (const auto* eight = std::get_if<FigureEightStep>(&step.action)) return eight->rounds == 0;
    if (const auto* wander = std::get_if<WanderStep>(&step.action)) return wander->for_s == 0.0;
    const auto* path = std::get_if<WaypointsStep>(&step.action);
    return path != nullptr && path->loop;
  }

  static std::optional<Problem> most(double value, double limit, const std::string& path,
                                     const std::string& unit) {
    if (std::abs(value) <= limit * (1.0 + 1e-9)) return std::nullopt;
    return Problem{path, number_text(value) + " " + unit + " is more than the robot can do, allowed up to " +
                             number_text(std::round(1000.0 * limit) / 1000.0) + " " + unit};
  }
  std::optional<Problem> speed(double value, const std::string& path) const {
    return most(value, model_.max_speed_mps, path + ".speed_mps", "m/s");
  }
  std::optional<Problem> rate(double degps, const std::string& path) const {
    const double limit = std::floor(10.0 * model_.max_yaw_rate_radps * 180.0 / std::numbers::pi + 0.5) / 10.0;
    return most(degps, limit, path, "deg/s");
  }
  std::optional<Problem> place(const std::array<double, 2>& point, const std::string& path) const {
    if (in_room(scenario_.room, point[0], point[1])) return std::nullopt;
    return Problem{path, "lies outside the room (" + room_range(scenario_.room) + ")"};
  }

  std::optional<Problem> check(const LineStep& step, const std::string& path) const {
    if (step.to_m) {
      if (auto problem = place(*step.to_m, path + ".to_m")) return problem;
    }
    return speed(step.speed_mps, path);
  }
  std::optional<Problem> check(const ArcStep& step, const std::string& path) const {
    return speed(step.speed_mps, path);
  }
  std::optional<Problem> check(const CircleStep& step, const std::string& path) const {
    return speed(step.speed_mps, path);
  }
  std::optional<Problem> check(const FigureEightStep& step, const std::string& path) const {
    return speed(step.speed_mps, path);
  }
  std::optional<Problem> check(const TurnStep& step, const std::string& path) const {
    return rate(step.rate_degps, path + ".rate_degps");
  }
  std::optional<Problem> check(const WaypointsStep& step, const std::string& path) const {
    for (std::size_t i = 0; i < step.points_m.size(); ++i) {
      if (auto problem = place(step.points_m[i], element(path + ".points_m", i))) return problem;
    }
    return speed(step.speed_mps, path);
  }
  std::optional<Problem> check(const WanderStep& step, const std::string& path) const {
    if (auto problem = speed(step.speed_mps, path)) return problem;
    return rate(step.rate_degps, path + ".rate_degps");
  }
  std::optional<Problem> check(const DriveStep& step, const std::string& path) const {
    if (auto problem = most(step.v_mps, model_.max_speed_mps, path + ".v_mps", "m/s")) return problem;
    if (step.side_mps != 0.0 && !model_.holonomic)
      return Problem{path + ".side_mps", "only a holonomic robot can drive sideways: this must be 0"};
    if (auto problem = most(step.side_mps, model_.max_side_speed_mps, path + ".side_mps", "m/s"))
      return problem;
    return rate(step.w_degps, path + ".w_degps");
  }
  std::optional<Problem> check(const StopStep&, const std::string&) const { return std::nullopt; }
  std::optional<Problem> check(const WaitStep& step, const std::string& path) const {
    const auto event = std::find_if(scenario_.events.begin(), scenario_.events.end(),
                                    [&](const EventSpec& e) { return e.name == step.event; });
    if (event == scenario_.events.end())
      return Problem{path + ".event", "there is no event called \"" + step.event + "\""};
    const auto* done = event->when ? std::get_if<ProgramDone>(&event->when->is) : nullptr;
    if (done != nullptr && done->robot == robot_.id && step.at_most_s == 0.0)
      return Problem{path + ".event", "\"" + step.event + "\" happens only after this program's own end"};
    return std::nullopt;
  }
  std::optional<Problem> check(const RepeatStep& step, const std::string& path) const {
    return steps(step.steps, path + ".steps");
  }
  std::optional<Problem> check(const ParallelStep& step, const std::string& path) const {
    for (std::size_t i = 0; i < step.steps.size(); ++i) {
      const std::string here = element(path + ".steps", i);
      const auto problem =
          std::visit([&](const auto& one) { return check(one, here); }, step.steps[i].action);
      if (problem) return problem;
    }
    return std::nullopt;
  }
  std::optional<Problem> check(const RunStep& step, const std::string& path) const {
    const auto named = scenario_.programs.find(step.program);
    if (named == scenario_.programs.end())
      return Problem{path + ".program", "there is no program called \"" + step.program + "\""};
    return steps(named->second, "programs." + step.program);
  }

  const Scenario& scenario_;
  const RobotSpec& robot_;
  const RobotModel& model_;
};

/// Follows what named programs run, depth first.
class CycleCheck {
 public:
  explicit CycleCheck(const Scenario& scenario) : scenario_(scenario) {}

  std::optional<Problem> all() {
    for (const auto& [name, steps] : scenario_.programs) {
      if (auto problem = program(name)) return problem;
    }
    return std::nullopt;
  }

 private:
  std::optional<Problem> program(const std::string& name) {
    const auto on_the_way = std::find(way_.begin(), way_.end(), name);
    if (on_the_way != way_.end()) {
      std::string cycle;
      for (auto at = on_the_way; at != way_.end(); ++at) cycle += *at + " runs ";
      return Problem{"programs." + name, "runs itself for ever: " + cycle + name};
    }
    const auto named = scenario_.programs.find(name);
    if (named == scenario_.programs.end() || !clear_.insert(name).second) return std::nullopt;
    way_.push_back(name);
    auto problem = steps(named->second);
    way_.pop_back();
    return problem;
  }

  std::optional<Problem> steps(const std::vector<ProgramStep>& all) {
    for (const ProgramStep& step : all) {
      std::optional<Problem> problem;
      if (const auto* run = std::get_if<RunStep>(&step.action)) problem = program(run->program);
      if (const auto* repeat = std::get_if<RepeatStep>(&step.action)) problem = steps(repeat->steps);
      if (const auto* parallel = std::get_if<ParallelStep>(&step.action)) problem = steps(parallel->steps);
      if (problem) return problem;
    }
    return std::nullopt;
  }

  const Scenario& scenario_;
  std::vector<std::string> way_;
  std::set<std::string> clear_;  ///< looked at already, or under way
};

}  // namespace

std::optional<Problem> find_program_problem(const Scenario& scenario, const RobotSpec& robot,
                                            const std::string& path) {
  return ProgramCheck(scenario, robot).steps(robot.program, path);
}

std::optional<Problem> find_program_cycle(const Scenario& scenario) {
  return CycleCheck(scenario).all();
}

}  // namespace skylight::sim
