// Motion programs: what a robot is told to do, turned into commands of speed and yaw rate. A program steers
// by the robot's true pose, as a person who drives it would; what the wheels make of it is the world's
// affair.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/scenario/scenario.hpp"
#include "sim/world/command.hpp"
#include "sim/world/wander.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Programs that others can run, by name.
using NamedPrograms = std::map<std::string, std::vector<ProgramStep>>;

/// The steps with every run step replaced by the named program's steps. The names must be known and run
/// themselves nowhere, as validate() wants them.
std::vector<ProgramStep> with_runs_inlined(const std::vector<ProgramStep>& steps, const NamedPrograms& named);

class Program {
 public:
  /// The steps must be as validate() wants them (no empty repeat, no path without points), without run steps.
  /// `seed`: of what it does at random.
  Program(std::vector<ProgramStep> steps, const DriveLimits& limits, std::uint64_t seed = 1);

  /// The command for the next control period, given where the robot is. Call once a period, times rising.
  Command command(const ProgramContext& context);

  /// The robot has been put elsewhere: it goes on to where it was going.
  void moved_to(const Pose2& pose);

  /// Whether the last step is over. A program that repeats for ever never is.
  bool finished() const { return !current_ && levels_.empty(); }

 private:
  /// A list of steps under way: the program itself, or a repeat within it.
  struct Level {
    const std::vector<ProgramStep>* steps;
    std::size_t next = 0;
    int rounds = 1;  ///< still to do, this one included; 0: for ever
  };
  /// A motion under way: where and when it began.
  struct Progress {
    const ProgramStep* step;
    bool goes_on = false;  ///< another motion follows: no need to come to rest
    double start_s = 0.0;
    Pose2 start;
    double turned_rad = 0.0;  ///< by the robot since the start
    double last_yaw = 0.0;
    std::size_t waypoint = 0;    ///< the one being approached
    Eigen::Vector2d leg_start;   ///< where the way to it began
    bool aligned = false;        ///< with the line to a place
    bool second_circle = false;  ///< of a figure eight
    int rounds = 0;              ///< of it, done
    std::optional<Wanderer> wanderer;
    std::vector<Program> parts;  ///< of a parallel step
  };
  /// A circle to be followed, and how far it still goes.
  struct Curve {
    double side;  ///< 1: to the left, -1: to the right
    double radius_m;
    double speed_mps;
    double remaining_rad;
    bool goes_on;
    double early_m = 0.0;  ///< it is left so long before its end
  };

  static const ProgramStep* advance(std::vector<Level>& levels);
  bool begin_next(const ProgramContext& context);
  std::optional<Command> follow(const LineStep& step, const ProgramContext& context);
  std::optional<Command> follow(const ArcStep& step, const ProgramContext& context);
  std::optional<Command> follow(const CircleStep& step, const ProgramContext& context);
  std::optional<Command> follow(const FigureEightStep& step, const ProgramContext& context);
  std::optional<Command> follow(const TurnStep& step, const ProgramContext& context);
  std::optional<Command> follow(const WaypointsStep& step, const ProgramContext& context);
  std::optional<Command> follow(const WanderStep& step, const ProgramContext& context);
  std::optional<Command> follow(const DriveStep& step, const ProgramContext& context);
  std::optional<Command> follow(const StopStep& step, const ProgramContext& context);
  std::optional<Command> follow(const WaitStep& step, const ProgramContext& context);
  std::optional<Command> follow(const RepeatStep& step, const ProgramContext& context);
  std::optional<Command> follow(const ParallelStep& step, const ProgramContext& context);
  std::optional<Command> follow(const RunStep& step, const ProgramContext& context);
  std::optional<Command> follow(const Curve& curve, const ProgramContext& context) const;
  Command limited(Command command) const;

  std::shared_ptr<const std::vector<ProgramStep>> steps_;  ///< shared: copies of a program point into it
  DriveLimits limits_;
  std::uint64_t seed_;
  std::uint64_t begun_ = 0;    ///< motions
  bool alone_ = true;          ///< not a part of a parallel step
  std::vector<Level> levels_;  ///< outermost first
  std::optional<Progress> current_;
};

}  // namespace skylight::sim
