// What a scenario file says: room, light, cameras, robots and their motion programs, things, events, what is
// expected, seed. Plain values with the defaults; *_fields.cpp describe each key (range, unit, help) and
// scenario_checks.cpp finds what no single key can show.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scenario/camera.hpp"
#include "sim/scenario/event.hpp"
#include "sim/scenario/robot.hpp"
#include "sim/scenario/room.hpp"

namespace skylight::sim {

/// What can be measured of a run; the names in the file are these words. Errors are in metres and degrees.
enum class Figure : std::uint8_t {
  mean_error_m,
  p95_error_m,
  p99_error_m,
  max_error_m,
  mean_yaw_error_deg,
  max_yaw_error_deg,
  availability,
  measured,
  usable,
  confident_wrong,
  nees_mean,
  find_mean_s,  ///< from when it came (back) into view until it was tracked; endless where it once was not
  find_worst_s,
  hidden_told,  ///< share of the frames in which it was hidden and the state said `occluded`
  id_switches,  ///< of all robots together, as the next two
  idf1,
  mota,
};

/// One line of what must come out: at most, at least, or both.
struct Expectation {
  Figure figure = Figure::mean_error_m;
  std::string robot;              ///< empty: each of them
  std::string kind = "filtered";  ///< of pose: measured, filtered, smoothed, predicted
  std::optional<double> at_most;
  std::optional<double> at_least;
};

/// Runs the scenario once with each value in place of a key's.
struct SweepSpec {
  std::string key;                 ///< "light.level", "robots[0].program[1].speed_mps"
  std::vector<double> values;      ///< exactly one of the two
  std::vector<std::string> names;  ///< for keys that take words
};

struct Scenario {
  Scenario();  // in scenario.cpp: seen through, it makes g++ 12 warn of uninitialised strings

  std::string name;         ///< from the file's name where the file does not say
  std::string description;  ///< one line: what the scenario is for
  std::uint64_t seed = 1;
  double start_unix_s = 1700000000.0;  ///< Unix time of the scenario's start
  double duration_s = 0.0;             ///< 0: endless
  RoomSpec room;
  LightSpec light;
  std::vector<CameraSpec> cameras{CameraSpec{}};
  std::map<std::string, std::vector<ProgramStep>> programs;  ///< that robots' programs can run by name
  std::vector<RobotSpec> robots;
  std::vector<ObjectSpec> objects;
  std::vector<PersonSpec> people;
  std::vector<EventSpec> events;
  std::vector<Expectation> expect;
  std::vector<SweepSpec> sweep;  ///< every value of one with every value of the others
  int repeats = 1;               ///< runs with seed, seed + 1, ...
  std::filesystem::path folder;  ///< picture files are relative to it; the scenario file's folder, no key
};

/// The robots with their copies, each with a count of 1.
std::vector<RobotSpec> all_robots(const Scenario& scenario);

/// What single keys cannot show: ids used twice, robots outside the room or overlapping, cameras below the
/// floor, a step without exactly one motion. Throws std::invalid_argument naming the key path and the bound.
void validate(const Scenario& scenario);

}  // namespace skylight::sim
