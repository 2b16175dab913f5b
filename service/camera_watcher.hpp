// The watch over all cameras (tracker/camera_watch.hpp) on a thread of its own: a look takes some
// milliseconds, and tracking waits for nobody.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "tracker/camera_watch.hpp"

namespace skylight::service {

class CameraWatcher {
 public:
  CameraWatcher(const CameraWatchConfig& config, std::size_t cameras);
  ~CameraWatcher();
  CameraWatcher(const CameraWatcher&) = delete;
  CameraWatcher& operator=(const CameraWatcher&) = delete;

  /// Never waits for a look: a frame that comes while one is under way takes the place of the one that waits.
  /// Its image must not be written to any more.
  void offer(const Frame& frame);

  /// After a new calibration: what the camera sees from now on is right. Its report is that of the beginning
  /// at once. Any thread.
  void relearn(std::size_t camera);

  /// As of the newest look. Any thread.
  CameraWatchReport report(std::size_t camera) const;

 private:
  struct Camera {
    CameraWatch watch;
    std::optional<Frame> waiting;
    CameraWatchReport report;
    bool anew = false;  ///< the watch is to begin again before its next look
  };

  void run();

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::vector<Camera> cameras_;  ///< `watch` belongs to the thread, the rest is under the lock
  std::thread thread_;
};

}  // namespace skylight::service
