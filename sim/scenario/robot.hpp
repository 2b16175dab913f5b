// A robot of a scenario: its kind, what is on its top, where it starts and what it does.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace skylight::sim {

/// waffle_pi, burger: TurtleBot3; differential: a round generic one; holonomic: one with omni-wheels.
enum class RobotModelName : std::uint8_t { waffle_pi, burger, differential, holonomic };

/// The picture on the robot's top plate.
struct PictureSpec {
  bool enabled = true;            ///< off: the bare plate
  std::string file;               ///< image file (with alpha where it has holes); empty: drawn from the seed
  std::uint64_t seed = 0;         ///< 0: by the robot's place in the list, so that each differs
  std::optional<double> width_m;  ///< width of the picture on the plate; absent: the plate's width
};

/// An AprilTag on the robot's top, over its picture if it has one.
struct TagSpec {
  std::string family = "36h11";
  int id = 0;
  double size_m = 0.08;       ///< between the corners that a detector reports: the border's outer edge
  std::optional<double> x_m;  ///< of its middle, from the plate's middle; both absent: the free place
  std::optional<double> y_m;  ///< nearest to the plate's middle; one absent: 0
  double yaw_deg = 0.0;       ///< of its x axis (to the right in the upright tag) from the robot's -y: 0 is
                              ///< upright, seen facing forward
};

struct StartSpec {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_deg = 0.0;
};

/// Wheel encoders. What they report is what the wheels turned; slip and wrong measures make it drift.
struct OdometrySpec {
  double rate_hz = 30.0;
  double ticks_per_turn = 4096.0;  ///< DYNAMIXEL XM430: 12-bit encoder
  double wheel_radius_error =
      0.005;  ///< the robot's own idea of its wheels is wrong by this share (standard deviation over robots)
  double separation_error = 0.01;  ///< the same for the distance between them
  double clock_offset_s = 0.0;     ///< of the robot's time stamps: stamp - true time
};

// Motion programs. A robot does its steps one after the other and stands still after the last.
struct ProgramStep;
struct LineStep {
  std::optional<double> distance_m;           ///< straight ahead; exactly one of the two
  std::optional<std::array<double, 2>> to_m;  ///< turns towards the place, then goes there
  double speed_mps = 0.2;
};
struct ArcStep {
  double radius_m = 1.0;
  double angle_deg = 90.0;  ///< positive: to the left
  double speed_mps = 0.2;
};
struct CircleStep {
  double radius_m = 1.0;
  double rounds = 1.0;
  double speed_mps = 0.2;
  bool right = false;  ///< clockwise
};
struct FigureEightStep {
  double radius_m = 0.6;  ///< of each of its two circles, the left one first
  int rounds = 1;         ///< 0: for ever
  double speed_mps = 0.2;
};
struct TurnStep {
  double angle_deg = 90.0;  ///< on the spot; positive: to the left
  double rate_degps = 60.0;
};
struct WaypointsStep {
  std::vector<std::array<double, 2>> points_m;
  double speed_mps = 0.2;
  bool loop = false;  ///< from the last point on to the first, for ever
};
/// Random wandering: turn rate and speed change at random; walls, things and other robots are avoided.
struct WanderStep {
  double for_s = 0.0;             ///< 0: for ever
  double speed_mps = 0.2;         ///< fastest
  double rate_degps = 60.0;       ///< fastest turn
  double changes_per_min = 25.0;  ///< of speed and turn rate, on average
  double stops = 0.1;             ///< share of the changes that are stops
  double avoid_m = 0.25;          ///< keeps so far from everything if it can; 0: it looks for nothing
  std::uint64_t seed = 0;         ///< 0: from the scenario's seed and the robot's place
};
struct DriveStep {
  double v_mps = 0.0;
  double side_mps = 0.0;  ///< to the left; holonomic robots only
  double w_degps = 0.0;
  double for_s = 1.0;
};
struct StopStep {
  double for_s = 1.0;
};
/// Stands still until the event of this name has happened.
struct WaitStep {
  std::string event;
  double at_most_s = 0.0;  ///< then goes on all the same; 0: waits for ever
};
struct RepeatStep {
  int times = 0;  ///< 0: for ever
  std::vector<ProgramStep> steps;
};
/// The steps at the same time, their speeds added (a holonomic robot that turns as it goes); over when all
/// are.
struct ParallelStep {
  std::vector<ProgramStep> steps;
};
/// The steps of one of the scenario's named programs.
struct RunStep {
  std::string program;
};
struct ProgramStep {
  std::variant<LineStep, ArcStep, CircleStep, FigureEightStep, TurnStep, WaypointsStep, WanderStep, DriveStep,
               StopStep, WaitStep, RepeatStep, ParallelStep, RunStep>
      action;
};

/// Further robots of the same kind: <id>-2 to <id>-n beside the first, in rows.
struct CopiesSpec {
  int count = 1;  ///< in all
  int per_row = 10;
  std::array<double, 2> spacing_m{0.5, 0.5};  ///< along map x within a row, along map y from row to row
};

struct RobotSpec {
  std::string id;
  RobotModelName model = RobotModelName::waffle_pi;
  PictureSpec picture;
  std::optional<TagSpec> tag;
  StartSpec start;
  OdometrySpec odometry;
  std::vector<ProgramStep> program;
  CopiesSpec copies;
};

}  // namespace skylight::sim
