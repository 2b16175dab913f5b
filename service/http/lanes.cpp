#include "service/http/lanes.hpp"

#include <exception>
#include <utility>

namespace skylight::http {

WorkerLane::WorkerLane(std::size_t threads, std::size_t max_waiting, const Log& log)
    : max_jobs_(threads + max_waiting) {
  threads_.reserve(threads);
  for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this, log] { work(log); });
}

WorkerLane::~WorkerLane() {
  stop();
}

bool WorkerLane::post(Job& job) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_ || waiting_.size() + in_hand_ >= max_jobs_) return false;
    waiting_.push_back(std::move(job));
  }
  wake_.notify_one();
  return true;
}

void WorkerLane::work(const Log& log) {
  Seam seam(log);
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    Job job = std::move(waiting_.front());
    waiting_.pop_front();
    ++in_hand_;
    lock.unlock();
    try {
      job.done(seam.answer(job.request));
    } catch (const std::exception& thrown) {  // the answer is lost; the worker is not
      if (log) log(std::string("http: an answer is lost: ") + thrown.what());
    }
    job = {};  // the body goes before the next wait
    lock.lock();
    --in_hand_;
  }
}

void WorkerLane::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    waiting_.clear();
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

}  // namespace skylight::http
