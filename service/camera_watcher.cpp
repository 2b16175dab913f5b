#include "service/camera_watcher.hpp"

#include <utility>

namespace skylight::service {

CameraWatcher::CameraWatcher(const CameraWatchConfig& config, std::size_t cameras) {
  for (std::size_t i = 0; i < cameras; ++i) cameras_.push_back({CameraWatch(config), {}, {}, false});
  thread_ = std::thread([this] { run(); });
}

CameraWatcher::~CameraWatcher() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void CameraWatcher::offer(const Frame& frame) {
  {
    const std::lock_guard lock(mutex_);
    if (frame.camera >= cameras_.size()) return;
    cameras_[frame.camera].waiting = frame;
  }
  wake_.notify_all();
}

void CameraWatcher::relearn(std::size_t camera) {
  const std::lock_guard lock(mutex_);
  cameras_.at(camera).anew = true;
  cameras_.at(camera).report = {};
}

CameraWatchReport CameraWatcher::report(std::size_t camera) const {
  const std::lock_guard lock(mutex_);
  return cameras_.at(camera).report;
}

void CameraWatcher::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    bool looked = false;
    for (Camera& camera : cameras_) {
      if (!camera.waiting || stopping_) continue;
      const Frame frame = *std::exchange(camera.waiting, std::nullopt);
      if (std::exchange(camera.anew, false)) camera.watch.relearn();
      lock.unlock();
      const CameraWatchReport now = camera.watch.look(frame);
      lock.lock();
      if (!camera.anew) camera.report = now;
      looked = true;
    }
    if (!looked && !stopping_) wake_.wait(lock);
  }
}

}  // namespace skylight::service
