// The UTIAS MRCLAM data set (K. Y. K. Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu, "The UTIAS multi-robot
// cooperative localization and mapping dataset", Int. J. Robotics Research 30(8), 2011): five iRobot Create
// on a floor, their pose by Vicon and the velocity that they were commanded to have.
//
// A folder of text files, one for each robot and kind, each as it is or packed by xz:
//
//   Robot<n>_Groundtruth.dat[.xz]   time (s, Unix)   x (m)   y (m)   orientation (rad)
//   Robot<n>_Odometry.dat[.xz]      time (s, Unix)   forward velocity (m/s)   angular velocity (rad/s)
//
// Lines that begin with # are comments.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tracker/types.hpp"

namespace skylight::service::reproduce {

inline constexpr int kMrclamRobots = 5;

struct MrclamReading {
  Time at{};
  Pose2 pose;  ///< in the data set's own frame; yaw as it stands there
};

struct MrclamRobot {
  int robot = 0;                     ///< 1 to kMrclamRobots
  std::vector<MrclamReading> truth;  ///< rising in time, at least one; about 60 Hz, with holes
  /// Rising in time, at least one; about 67 Hz. Covariances are BodyVelocity's default: the data set has
  /// none.
  std::vector<BodyVelocity> odometry;
};

/// What is wrong with the data, one line: `Robot3_Odometry.dat.xz:7: time is no number: "1.2.3"`.
struct MrclamError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Robot 1 to kMrclamRobots (else std::invalid_argument). Throws MrclamError with file, line and reason where
/// a file is missing, damaged, empty, or has lines of another kind, values that are no finite numbers or
/// times that go back.
MrclamRobot read_mrclam_robot(const std::filesystem::path& folder, int robot);

/// Where it truly was, linear between the two readings beside it, yaw the shorter way round; none outside of
/// them and where they are more than 0.1 s apart.
std::optional<Pose2> truth_at(const MrclamRobot& robot, Time at);

}  // namespace skylight::service::reproduce
