// What detectors saw of one robot along one route: the ground on which the experiments stand. Rendering and
// detecting is dear and does not depend on filters, so it is done once and kept; every table and figure is a
// replay over these.
//
// A run is kept as one CSV file, so that people and other programs can read it:
//
//   skylight observed run,<format>,<key>     the key tells what the run came from, see jobs.hpp
//   route,seed,frame_rate_hz,width_px,height_px
//   variants,<name>...
//   odometry,<count>   a header line, and one line for each reading
//   frames,<count>     a header line, and one line for each frame; empty fields where nothing was seen
//   checksum,<FNV-1a of all lines above>
//
// Numbers are written so that they read back to the bit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tracker/types.hpp"

namespace skylight::service::reproduce {

struct ObservedFrame {
  Time captured{};
  Pose2 truth;                                   ///< of base_link at `captured`
  bool in_view = false;                          ///< the middle of the robot's top lies in the picture
  double visible = 1.0;                          ///< share of its top that the camera sees
  std::vector<std::optional<Observation>> seen;  ///< one for each of ObservedRun::variants
};

struct ObservedRun {
  std::string route;  ///< the scenario's name without its folder: "line-1"
  std::uint64_t seed = 0;
  double frame_rate_hz = 0.0;
  int width_px = 0;
  int height_px = 0;
  /// Ways in which the same frames were looked at: "vertical" and "ray" of the paper's pipeline, "true" and
  /// "calibrated" cameras of Skylight's detector.
  std::vector<std::string> variants;
  std::vector<ObservedFrame> frames;   ///< in order of time
  std::vector<BodyVelocity> odometry;  ///< in order of time; empty where the robot sends none
};

/// Its place in ObservedRun::variants. Throws std::invalid_argument where the run has no such variant.
std::size_t variant_index(const ObservedRun& run, std::string_view variant);

/// Counts up whenever the file changes its shape, or the same key would mean another run.
inline constexpr int kRunFormat = 2;

/// What is wrong with a run's file, one line: `line-1.csv:7: truth_x_m is no number: "1.2.3"`.
struct RunFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// 16 hexadecimal digits: the 64-bit FNV-1a hash of a text (G. Fowler, L. C. Noll, K.-P. Vo).
std::string fingerprint(std::string_view text);

/// The file's content. Names must be without commas, quotes and line breaks, and each frame must have one
/// place per variant, else std::invalid_argument.
std::string write_run(const ObservedRun& run, std::string_view key);

/// The run from such a text; `name` is how errors call it. Throws RunFileError with name, line and reason
/// where the text is cut short, damaged, of another format or made for another key.
ObservedRun parse_run(std::string_view text, std::string_view key, const std::string& name);

/// Writes the file, whole or not at all: under another name first (`path`.part), which is then changed.
/// Throws as write_run(), and RunFileError where it cannot be written.
void save_run(const std::filesystem::path& path, const ObservedRun& run, std::string_view key);

/// Reads it back. Throws as parse_run(), also where there is no such file.
ObservedRun load_run(const std::filesystem::path& path, std::string_view key);

}  // namespace skylight::service::reproduce
