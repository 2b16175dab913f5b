// Real robots: the five of MRCLAM data set 6 (mrclam_data.hpp) as a camera at 10 Hz would have seen them.
// Their truth is taken at 10 Hz, made noisy, and left out here and there; window filter and motion filter,
// with and without the robots' odometry, are judged by that truth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "service/report/document.hpp"
#include "service/reproduce/mrclam_data.hpp"
#include "tracker/metrics.hpp"
#include "tracker/types.hpp"

namespace skylight::service::reproduce {

inline constexpr double kMrclamRateHz = 10.0;

/// What stands between the truth and an observation. The filters are told the variance of both parts
/// together, and nothing of how long the slow part lasts.
struct MrclamNoise {
  double white_m = 0.010;     ///< per axis, one sigma, m, 0.0001 to 1
  double white_rad = 0.0349;  ///< of yaw, one sigma, rad (2 degrees), 0.0001 to 1
  double slow_m = 0.003;      ///< slow part per axis, one sigma, m, 0 to 1: first-order Gauss-Markov ...
  double slow_time_s = 2.0;   ///< ... with this time constant, s, 0.1 to 1000
  double single_miss = 0.05;  ///< share of frames in which the robot is not detected, 0 to 0.9
  double gap_s = 2.0;         ///< all frames over so long, s, 0.2 to 4
  double gap_every_s = 20.0;  ///< from one gap's begin to the next's, on average, s, gap_s + 4 to 1000
  std::uint64_t seed = 1;
};

/// One picture that a camera could have taken.
struct MrclamFrame {
  Time captured{};
  std::optional<Pose2> truth;       ///< none in a hole of Vicon's
  std::optional<Observation> seen;  ///< none in gaps, single misses and without truth
  bool in_gap = false;
  bool ends_gap = false;  ///< the last frame of a gap: the newest observation is gap_s back, or a little more
};

/// From the first instant with truth and odometry to the last, at kMrclamRateHz.
struct MrclamRun {
  MrclamRobot robot;
  std::vector<MrclamFrame> frames;
};

/// The same seed gives the same run everywhere; robots differ. `seconds` ends it early; 0: not. Throws
/// std::invalid_argument naming what is out of range.
MrclamRun make_mrclam_run(MrclamRobot robot, const MrclamNoise& noise, double seconds = 0.0);

/// kMotionTold is told how large the slow part is (MotionFilterConfig::observation_bias_m); else defaults.
enum MrclamFilter : std::size_t { kWindow = 0, kMotion, kMotionOdometry, kMotionTold, kMrclamFilters };

/// How the odometry, which is commands, agrees with what the robot then did.
struct MrclamCommands {
  double lead_s = 0.0;  ///< by which turns are commanded before they are made: 0 to 0.5, in steps of 0.05
  double yaw_rate_rms = 0.0;  ///< rad/s, of the difference with that lead taken off
  double yaw_scale = 0.0;     ///< turn rate made over commanded, least squares, at that lead; 0: never turned
  double forward_scale = 0.0;  ///< the same of the speed
};
MrclamCommands judge_commands(const MrclamRun& run);

/// Of one filter. A filter's first second counts in none.
struct MrclamScore {
  RobotScore filtered;    ///< outside of gaps, single misses included
  RobotScore smoothed;    ///< the same frames, each once 1.0 to 1.4 s later; nothing of the window filter
  RobotScore half_ahead;  ///< told 0.5 s before, each half second, from frames outside of gaps
  RobotScore one_ahead;   ///< told 1 s before
  RobotScore gap_end;     ///< at the last frame of each gap
  RobotScore all;         ///< every frame with a truth: `availability` is the share with a pose
};

struct MrclamScores {
  int robot = 0;            ///< 0: all of them, pooled
  double moving = 0.0;      ///< share of time in which it goes faster than 0.02 m/s
  MrclamCommands commands;  ///< of one robot; not of all
  RobotScore measured;      ///< observations, without any filter
  std::array<MrclamScore, kMrclamFilters> filters;
};

/// Every frame of one robot, for plots.
struct MrclamTrace {
  int robot = 0;
  std::vector<MrclamFrame> frames;
  std::array<std::vector<std::optional<Pose2>>, kMrclamFilters> filtered;  ///< one for each frame
  std::array<std::vector<std::optional<Pose2>>, kMrclamFilters> smoothed;
};

struct MrclamResults {
  MrclamNoise noise;
  double seconds = 0.0;  ///< of all robots together
  MrclamScores pooled;
  std::vector<MrclamScores> robots;
  std::vector<MrclamTrace> traces;  ///< in the order of `robots`
};

struct MrclamOptions {
  MrclamNoise noise;
  double seconds = 200.0;   ///< of each robot; 0: all there is, about 13 minutes
  std::size_t threads = 0;  ///< 0: as many as the machine has cores; the results are the same on any number
};

/// Reads the folder and replays it through all filters, at their defaults. Throws as read_mrclam_robot() and
/// make_mrclam_run().
MrclamResults run_mrclam(const std::filesystem::path& folder, const MrclamOptions& options = {});

/// One table, two plots, and what they tell.
report::Section mrclam_section(const MrclamResults& results);

}  // namespace skylight::service::reproduce
