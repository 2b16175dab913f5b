// One camera's life: connect, read, date, hand on; and when it breaks, again after a while.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

#include <opencv2/core/types.hpp>

#include "service/clock.hpp"
#include "service/sources/live/backoff.hpp"
#include "service/sources/live/driver.hpp"
#include "service/sources/live/freeze_watch.hpp"
#include "service/sources/live/stream_clock.hpp"

namespace skylight::service {

struct FeedOptions {
  std::size_t camera = 0;  ///< index into the tracker's cameras
  std::string kind{};      ///< as in FeedStatus
  cv::Size size_px{};      ///< that the camera is calibrated for; another one is refused. Empty: any
  Duration latency{};      ///< what even the quickest picture takes; subtracted from the time it is given
  Duration frozen_after = std::chrono::seconds(2);          ///< 0: never
  Duration shortest_rest = std::chrono::milliseconds(500);  ///< between attempts; doubles
  Duration longest_rest = std::chrono::seconds(10);
  Clock clock = system_now;
  /// Waits so long; false when the feed is to end. Empty: against the wall's clock.
  std::function<bool(Duration)> rest{};
};

class CameraFeed {
 public:
  struct Listener {
    std::function<void(Frame)> frame;    ///< a new picture, with its time
    std::function<void()> changed = {};  ///< status() has another state
  };

  CameraFeed(FeedOptions options, std::unique_ptr<CameraDriver> driver, Listener listener);

  /// Until interrupt(). Never throws for what a camera does. The listener is called on this thread.
  void run();
  /// From another thread, for good.
  void interrupt();

  /// From any thread.
  FeedStatus status() const;

 private:
  void live_through_a_connection(Backoff& backoff);
  bool take(Shot picture);
  std::optional<Time> instant_of(const Shot& picture);
  void note_fresh(const Frame& frame, Time arrived);
  void note_state(FeedState state, Time since, const std::string& reason);
  void count(std::uint64_t FeedStatus::*what, std::uint64_t by = 1);
  bool rest(Duration duration);
  bool interrupted() const;

  FeedOptions options_;
  std::unique_ptr<CameraDriver> driver_;
  Listener listener_;

  // Of the thread that runs.
  FreezeWatch freeze_;
  StreamClock stream_clock_;
  std::uint64_t sequence_ = 0;
  Time last_captured_ = Time::min();

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool interrupted_ = false;
  FeedStatus status_;
  std::deque<Time> arrivals_;  ///< of new pictures, over kRateWindow
};

}  // namespace skylight::service
