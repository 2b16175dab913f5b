// The workers that run handlers: a lane is some threads and a queue.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "service/http/seam.hpp"

namespace skylight::http {

class WorkerLane {
 public:
  struct Job {
    ApiRequest request;
    std::function<void(std::string answer)> done;  ///< called on the worker
  };

  /// `max_waiting`: jobs beyond those that the threads have in hand.
  WorkerLane(std::size_t threads, std::size_t max_waiting, const Log& log);
  ~WorkerLane();
  WorkerLane(const WorkerLane&) = delete;
  WorkerLane& operator=(const WorkerLane&) = delete;

  /// False, and the job untouched, where the lane is full or has stopped.
  bool post(Job& job);
  /// Drops the jobs that wait and waits for those that run.
  void stop();

 private:
  void work(const Log& log);

  const std::size_t max_jobs_;  ///< in hand and waiting
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> waiting_;
  std::size_t in_hand_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace skylight::http
