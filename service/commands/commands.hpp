// The command line: one function per command, each adds itself to the parser.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "service/config.hpp"

namespace skylight::service {

/// What to run once the command line is parsed; returns the exit code: 0 done, 1 failed, 2 bad usage.
using Run = std::function<int()>;

void add_serve(CLI::App& app, Run& run);
void add_track(CLI::App& app, Run& run);
void add_simulate(CLI::App& app, Run& run);
void add_evaluate(CLI::App& app, Run& run);
void add_reproduce(CLI::App& app, Run& run);
void add_calibrate(CLI::App& app, Run& run);
void add_tags(CLI::App& app, Run& run);

/// A mistake of whoever called the program: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Options that set configuration values, over the file's and the environment's.
struct ConfigFlags {
  std::string file;
  std::vector<std::string> sets;

  void add_to(CLI::App& command, bool with_file = true);
  /// `more` go before the --set of the command line.
  Config load(const std::vector<Override>& more = {}) const;
};

/// The camera of the configuration file that the input's folder is named after, as `skylight simulate` writes
/// them; else its first.
std::string camera_of_input(const std::string& config_file, const std::string& input);

/// A line of progress on stderr, if that is a terminal; takes no time otherwise.
class Progress {
 public:
  /// `total` 0: unknown.
  Progress(std::string what, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void step();

 private:
  std::string what_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::chrono::steady_clock::time_point shown_{};
  bool terminal_;
};

}  // namespace skylight::service
