// Motion programs: what a robot is told to do, turned into commands of speed and yaw rate. A program steers
// by the robot's true pose, as a person who drives it would; what the wheels make of it is the world's
// affair.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sim/scenario/scenario.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// What is asked of a differential drive: forward speed (m/s) and yaw rate (rad/s, counter-clockwise).
struct Command {
  double v_mps = 0.0;
  double w_radps = 0.0;
  friend bool operator==(const Command&, const Command&) = default;
};

struct DriveLimits {
  double max_speed_mps = 0.26;
  double max_yaw_rate_radps = 1.82;
};

class Program {
 public:
  /// The steps must be as validate() wants them (no empty repeat, no path without points).
  Program(std::vector<ProgramStep> steps, const DriveLimits& limits);

  /// The command for the next control period, given where the robot is. Call once a period, times rising.
  Command command(double time_s, const Pose2& pose);

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
    std::size_t waypoint = 0;   ///< the one being approached
    Eigen::Vector2d leg_start;  ///< where the way to it began
  };

  static const ProgramStep* advance(std::vector<Level>& levels);
  bool begin_next(double time_s, const Pose2& pose);
  std::optional<Command> follow(const LineStep& step, double time_s, const Pose2& pose);
  std::optional<Command> follow(const ArcStep& step, double time_s, const Pose2& pose);
  std::optional<Command> follow(const TurnStep& step, double time_s, const Pose2& pose);
  std::optional<Command> follow(const WaypointsStep& step, double time_s, const Pose2& pose);
  std::optional<Command> follow(const DriveStep& step, double time_s, const Pose2& pose);
  std::optional<Command> follow(const StopStep& step, double time_s, const Pose2& pose);
  std::optional<Command> follow(const RepeatStep& step, double time_s, const Pose2& pose);
  template <class Step>
  std::optional<Command> follow(const Step&, double, const Pose2&) {
    return std::nullopt;
  }
  Command limited(Command command) const;

  std::shared_ptr<const std::vector<ProgramStep>> steps_;  ///< shared: copies of a program point into it
  DriveLimits limits_;
  std::vector<Level> levels_;  ///< outermost first
  std::optional<Progress> current_;
};

}  // namespace skylight::sim
