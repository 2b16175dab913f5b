#include "service/camera_watcher.hpp"

#include <cstdio>
#include <utility>

namespace skylight::service {

CameraWatcher::CameraWatcher(const CameraWatchConfig& config, std::vector<std::string> cameras,
                             std::function<void(const std::string&)> log)
    : log_(std::move(log)) {
  for (std::string& id : cameras) cameras_.push_back({std::move(id), CameraWatch(config), {}, {}});
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
      lock.unlock();
      const CameraHold before = camera.watch.report().hold;
      const CameraWatchReport now = camera.watch.look(frame);
      if (log_ && now.hold != before) tell(camera, before, now);
      lock.lock();
      camera.report = now;
      looked = true;
    }
    if (!looked && !stopping_) wake_.wait(lock);
  }
}

void CameraWatcher::tell(const Camera& camera, CameraHold before, const CameraWatchReport& now) const {
  const std::string name = "camera '" + camera.id + "' ";
  if (now.hold == CameraHold::moved) {
    char shift[32];
    std::snprintf(shift, sizeof shift, "%.1f", now.shift_px);
    log_(name + "was moved: the floor is " + shift + " px from where it was; calibrate it again");
  } else if (now.hold == CameraHold::blind) {
    log_(name + "sees too little of the floor to tell whether it was moved");
  } else if (before != CameraHold::learning) {
    log_(name + "sees the floor where it was");
  }
}

}  // namespace skylight::service
