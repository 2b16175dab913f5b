#include "service/reproduce/jobs.hpp"

#include <algorithm>
#include <cctype>
#include <mutex>
#include <optional>
#include <set>
#include <system_error>
#include <thread>

#include <opencv2/core/utility.hpp>

namespace skylight::service::reproduce {
namespace {

namespace fs = std::filesystem;

/// Each job has one core: what OpenCV does on several would depend on what runs beside it.
class OneThreadForOpenCv {
 public:
  OneThreadForOpenCv() { cv::setNumThreads(1); }
  ~OneThreadForOpenCv() { cv::setNumThreads(before_); }
  OneThreadForOpenCv(const OneThreadForOpenCv&) = delete;
  OneThreadForOpenCv& operator=(const OneThreadForOpenCv&) = delete;

 private:
  int before_ = cv::getNumThreads();
};

std::string full_key(const Job& job) {
  return "format " + std::to_string(kRunFormat) + "\n" + job.key;
}

/// The jobs that are left, handed out one at a time.
class Queue {
 public:
  Queue(const std::vector<Job>& jobs, const JobOptions& options)
      : jobs_(jobs), options_(options), results_(jobs.size()) {
    progress_.total = jobs.size();
    for (const Job& job : jobs) weights_ += job.weight;
  }

  void reuse() {
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      try {
        results_[i] = load_run(job_file(options_.folder, jobs_[i]), full_key(jobs_[i]));
      } catch (const RunFileError&) {  // there is none, or none that can be trusted
        left_.push_back(i);
        continue;
      }
      count(i);
      ++progress_.reused;
    }
    tell();
  }
  std::size_t left() const { return left_.size(); }

  void work() {
    while (const auto i = take()) {
      const Job& job = jobs_[*i];
      try {
        ObservedRun run = job.run();
        save_run(job_file(options_.folder, job), run, full_key(job));
        const std::lock_guard lock(mutex_);
        results_[*i] = std::move(run);
        count(*i);
        progress_.job = job.name;
        tell();
      } catch (const std::exception& error) {
        fail(job.name + ": " + error.what());
      } catch (...) {
        fail(job.name + ": unknown error");
      }
    }
  }

  std::vector<ObservedRun> results() {
    if (failure_) throw JobError(*failure_);
    std::vector<ObservedRun> out;
    for (auto& result : results_) out.push_back(std::move(result.value()));
    return out;
  }

 private:
  std::optional<std::size_t> take() {
    const std::lock_guard lock(mutex_);
    if (failure_ || next_ == left_.size()) return std::nullopt;
    return left_[next_++];
  }
  void fail(const std::string& reason) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = reason;
  }
  void count(std::size_t i) {
    ++progress_.done;
    done_weight_ += jobs_[i].weight;
    progress_.share = progress_.done == progress_.total ? 1.0 : done_weight_ / weights_;
  }
  void tell() const {
    if (options_.progress) options_.progress(progress_);
  }

  const std::vector<Job>& jobs_;
  const JobOptions& options_;
  std::vector<std::optional<ObservedRun>> results_;
  std::vector<std::size_t> left_;
  std::mutex mutex_;
  std::size_t next_ = 0;
  Progress progress_;
  double weights_ = 0.0;
  double done_weight_ = 0.0;
  std::optional<std::string> failure_;
};

void check_different(const std::vector<Job>& jobs, const fs::path& folder) {
  std::set<fs::path> files;
  for (const Job& job : jobs) {
    if (!files.insert(job_file(folder, job)).second)
      throw std::invalid_argument("two jobs are called \"" + job.name + "\" and have the same key");
  }
}

}  // namespace

fs::path job_file(const fs::path& folder, const Job& job) {
  std::string name;
  for (const char c : job.name.substr(0, 80))
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' ? c : '_';
  return folder / (name + "-" + fingerprint(full_key(job)) + ".csv");
}

std::vector<ObservedRun> run_jobs(const std::vector<Job>& jobs, const JobOptions& options) {
  check_different(jobs, options.folder);
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (error) throw JobError(options.folder.string() + ": cannot be made: " + error.message());

  const OneThreadForOpenCv one_thread;
  Queue queue(jobs, options);
  queue.reuse();
  const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t count = std::min(options.threads > 0 ? options.threads : cores, queue.left());
  {
    std::vector<std::jthread> helpers;
    for (std::size_t i = 1; i < count; ++i) helpers.emplace_back([&queue] { queue.work(); });
    queue.work();
  }
  return queue.results();
}

}  // namespace skylight::service::reproduce
