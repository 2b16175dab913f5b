// What happens in a scenario besides the robots' programs: when, and what. The same actions can be asked for
// while a scenario runs.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>

#include "sim/scenario/robot.hpp"
#include "sim/scenario/room.hpp"

namespace skylight::sim {

// ---- Actions.

/// The room's light goes to another level.
struct LightAction {
  double level = 1.0;
  double over_s = 0.0;  ///< evenly in so long
};
/// A soft-edged band of shadow (a cloud, somebody before a window) crosses the room.
struct ShadowAction {
  double darkness = 0.5;  ///< share of the light missing in its middle
  double width_m = 1.5;
  double direction_deg = 0.0;  ///< towards which it moves, in map
  double speed_mps = 0.5;
};
/// Somebody knocks against the camera: it hangs otherwise from now on.
struct BumpAction {
  std::string camera;
  std::array<double, 3> by_mm{0.0, 0.0, 0.0};   ///< along map x, y, z
  std::array<double, 3> by_deg{0.0, 0.0, 0.0};  ///< about map x, y, z through its optical centre
};
/// Taken off the floor and, after a while, put down elsewhere.
struct KidnapAction {
  std::string robot;
  StartSpec to;
  double away_s = 1.0;  ///< 0: at once
};
/// Motors (and odometry) off: it stands where it is. On again: it goes on with its program.
struct PowerAction {
  std::string robot;
  bool on = false;
};
/// Something lies on the robot's top.
struct CoverAction {
  std::string robot;
  bool tag_only = true;  ///< the tag alone, else the whole top
  double for_s = 0.0;    ///< 0: for good
};
/// The camera repeats its last picture (with new time stamps) for a while.
struct FreezeAction {
  std::string camera;
  double for_s = 1.0;
};
/// The camera sends nothing for a while.
struct BlackoutAction {
  std::string camera;
  double for_s = 1.0;
};
/// The robot's tyres lose their grip (oil, a cable under the wheel).
struct SlipAction {
  std::string robot;
  double grip = 0.1;  ///< factor on its tyres' friction
  double for_s = 1.0;
};
/// Somebody drives it: its program waits meanwhile.
struct DriveAction {
  std::string robot;
  double v_mps = 0.0;
  double side_mps = 0.0;
  double w_degps = 0.0;
  double for_s = 0.5;
};
/// A knock from the side.
struct PushAction {
  std::string robot;
  std::array<double, 2> impulse_ns{0.5, 0.0};  ///< N s, in map
};
struct PutAction {
  ObjectSpec object;
};
struct RemoveAction {
  std::string object;
};

/// Nothing but its name: for programs that wait for it and events that follow it.
struct SignalAction {};

using Action =
    std::variant<SignalAction, LightAction, ShadowAction, BumpAction, KidnapAction, PowerAction, CoverAction,
                 FreezeAction, BlackoutAction, SlipAction, DriveAction, PushAction, PutAction, RemoveAction>;

/// An action by itself, as asked for while a scenario runs.
struct ActionSpec {
  Action action;
};

// ---- Conditions.

/// So long after another event.
struct AfterEvent {
  std::string event;
  double delay_s = 0.0;
};
/// A robot comes within a distance of a place.
struct RobotAt {
  std::string robot;
  std::array<double, 2> place_m{0.0, 0.0};
  double within_m = 0.2;
};
/// Two robots come within a distance of each other (their base_links).
struct RobotsNear {
  std::string robot;
  std::string other;
  double within_m = 0.5;
};
/// A robot touches something.
struct RobotTouches {
  std::string robot;
};
struct ProgramDone {
  std::string robot;
};

struct Condition {
  std::variant<AfterEvent, RobotAt, RobotsNear, RobotTouches, ProgramDone> is;
};

/// An event happens once: at its time, or the first time its condition holds.
struct EventSpec {
  std::string name;            ///< for programs that wait for it and events that follow it; may be empty
  std::optional<double> at_s;  ///< of the scenario's time; exactly one of the two
  std::optional<Condition> when;
  double every_s = 0.0;  ///< happens again and again, so long apart; 0: once
  Action action;
};

}  // namespace skylight::sim
