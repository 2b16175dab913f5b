// Several live cameras as one source: a thread for each, their frames merged in the order of their arrival.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "service/sources/live/camera_feed.hpp"

namespace skylight::service {

/// Of each camera at most one frame waits, its newest: an older one that nobody took is dropped and counted.
class LiveCameras final : public FrameSource {
 public:
  struct Camera {
    FeedOptions options{};  ///< `camera` is set here: the place in the list
    std::unique_ptr<CameraDriver> driver;
  };

  /// The threads start with the first next().
  explicit LiveCameras(std::vector<Camera> cameras);
  ~LiveCameras() override;
  LiveCameras(const LiveCameras&) = delete;
  LiveCameras& operator=(const LiveCameras&) = delete;

  /// Waits for a frame of any camera; none after interrupt(), for good. Never throws for what a camera does:
  /// feeds() tells.
  std::optional<Frame> next() override;
  bool live() const override { return true; }
  std::vector<FeedStatus> feeds() const override;
  void watch(std::function<void()> changed) override;
  void interrupt() override;

 private:
  void start();
  void push(Frame frame);
  void tell_watcher();

  std::vector<std::unique_ptr<CameraFeed>> feeds_;
  std::vector<std::thread> threads_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Frame> waiting_;            ///< in order of arrival, at most one per camera
  std::vector<std::uint64_t> received_;   ///< per camera, all that ever waited
  std::vector<std::uint64_t> overtaken_;  ///< per camera
  bool interrupted_ = false;

  std::mutex watcher_mutex_;  ///< held while the watcher is told
  std::function<void()> watcher_;
};

}  // namespace skylight::service
