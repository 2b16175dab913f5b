#include "service/sources/live/live_cameras.hpp"

#include <algorithm>
#include <utility>

namespace skylight::service {

LiveCameras::LiveCameras(std::vector<Camera> cameras)
    : received_(cameras.size(), 0), overtaken_(cameras.size(), 0) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    cameras[i].options.camera = i;
    feeds_.push_back(std::make_unique<CameraFeed>(
        std::move(cameras[i].options), std::move(cameras[i].driver),
        CameraFeed::Listener{.frame = [this](Frame frame) { push(std::move(frame)); },
                             .changed = [this] { tell_watcher(); }}));
  }
}

LiveCameras::~LiveCameras() {
  interrupt();
  for (std::thread& thread : threads_) thread.join();
}

void LiveCameras::start() {
  for (const auto& feed : feeds_) threads_.emplace_back([&each = *feed] { each.run(); });
}

std::optional<Frame> LiveCameras::next() {
  std::unique_lock lock(mutex_);
  if (threads_.empty() && !interrupted_) start();
  wake_.wait(lock, [this] { return interrupted_ || !waiting_.empty(); });
  if (interrupted_) return std::nullopt;
  Frame frame = std::move(waiting_.front());
  waiting_.erase(waiting_.begin());
  return frame;
}

void LiveCameras::push(Frame frame) {
  {
    const std::lock_guard lock(mutex_);
    ++received_[frame.camera];
    const auto older = std::find_if(waiting_.begin(), waiting_.end(),
                                    [&](const Frame& waits) { return waits.camera == frame.camera; });
    if (older != waiting_.end()) {
      ++overtaken_[frame.camera];
      waiting_.erase(older);
    }
    waiting_.push_back(std::move(frame));
  }
  wake_.notify_all();
}

std::vector<FeedStatus> LiveCameras::feeds() const {
  std::vector<FeedStatus> out;
  out.reserve(feeds_.size());
  for (const auto& feed : feeds_) out.push_back(feed->status());
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].received = received_[i];
    out[i].overtaken = overtaken_[i];
  }
  return out;
}

void LiveCameras::watch(std::function<void()> changed) {
  const std::lock_guard lock(watcher_mutex_);
  watcher_ = std::move(changed);
}

void LiveCameras::tell_watcher() {
  const std::lock_guard lock(watcher_mutex_);
  if (watcher_) watcher_();
}

void LiveCameras::interrupt() {
  {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
  }
  wake_.notify_all();
  for (const auto& feed : feeds_) feed->interrupt();
}

}  // namespace skylight::service
