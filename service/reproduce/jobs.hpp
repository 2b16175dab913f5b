// Many independent runs on all cores, each kept in a file, so that whoever is interrupted goes on where he
// stopped.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "service/reproduce/observed_run.hpp"

namespace skylight::service::reproduce {

struct Job {
  /// For people, and the beginning of the file's name: "paper/line-1 seed 3".
  std::string name;
  /// Everything that decides the result: scenario, seed, camera, detector settings. Another key is another
  /// file, so that nothing stale is taken; kRunFormat is part of it without being told.
  std::string key;
  /// Runs on any thread, at the same time as others.
  std::function<ObservedRun()> run;
  double weight = 1.0;  ///< its share of the work, > 0, for the progress: its count of frames
};

struct Progress {
  std::size_t done = 0;    ///< jobs, reused ones included
  std::size_t reused = 0;  ///< of them: taken from their files
  std::size_t total = 0;
  double share = 0.0;  ///< of the weights, 0 to 1
  std::string job;     ///< that was done last; empty at the beginning
};

struct JobOptions {
  std::filesystem::path folder;  ///< where the files are kept; made where it is missing
  std::size_t threads = 0;       ///< 0: as many as the machine has cores
  /// Called at the beginning (with what is there already) and after each job, by one thread at a time.
  std::function<void(const Progress&)> progress;
};

/// A job that failed: its name and the reason.
struct JobError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Where a job's result is kept.
std::filesystem::path job_file(const std::filesystem::path& folder, const Job& job);

/// The results, in the order of the jobs, the same on any number of threads. A file that is damaged or of
/// another key counts as none. While they run OpenCV has one thread, for the whole program. A job that throws
/// ends it all with JobError once those that run are done; what was done stays. Two jobs with the same name
/// and key are refused with std::invalid_argument.
std::vector<ObservedRun> run_jobs(const std::vector<Job>& jobs, const JobOptions& options);

}  // namespace skylight::service::reproduce
