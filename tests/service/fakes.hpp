// A source of frames and a clock that the tests hold in their hands.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "service/pipeline.hpp"
#include "tests/support/flat_scene.hpp"

namespace skylight::service::test {

inline constexpr Time kStart{std::chrono::seconds(1'700'000'000)};

/// What a FakeFrames gives; shared with the test, which fills it.
class Feed {
 public:
  void push(Frame frame) {
    const std::lock_guard lock(mutex_);
    frames_.push_back(std::move(frame));
    changed_.notify_all();
  }
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }
  void fail(const std::string& why) {
    const std::lock_guard lock(mutex_);
    error_ = why;
    ended_ = true;
    changed_.notify_all();
  }
  void count_bad() { ++bad_; }
  /// Until every frame was handed on: the capture thread has come back for the next one.
  void wait_until_taken() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return frames_.empty() && waiting_; });
  }

  std::optional<Frame> next() {
    std::unique_lock lock(mutex_);
    waiting_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return ended_ || !frames_.empty(); });
    waiting_ = false;
    if (!frames_.empty()) {
      Frame frame = std::move(frames_.front());
      frames_.pop_front();
      return frame;
    }
    if (!error_.empty()) throw SourceError(error_);
    return std::nullopt;
  }
  std::uint64_t bad() const { return bad_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> frames_;
  std::string error_;
  bool ended_ = false;
  bool waiting_ = false;
  std::atomic<std::uint64_t> bad_{0};
};

class FakeFrames final : public FrameSource {
 public:
  explicit FakeFrames(std::shared_ptr<Feed> feed) : feed_(std::move(feed)) {}
  std::optional<Frame> next() override { return feed_->next(); }
  std::uint64_t bad_frames() const override { return feed_->bad(); }

 private:
  std::shared_ptr<Feed> feed_;
};

/// Stands still until it is moved.
class FakeClock {
 public:
  Time now() const { return kStart + Duration(since_start_.load()); }
  void advance(Duration by) { since_start_ += by.count(); }
  Clock function() {
    return [this] { return now(); };
  }

 private:
  std::atomic<Duration::rep> since_start_{0};
};

/// A small room with one robot that is quick to draw: 1.8 x 1.3 m in 320 x 240 px.
inline skylight::test::FlatScene small_room(const Pose2& robot = {.x = 0.1, .y = -0.1, .yaw = 0.4}) {
  skylight::test::FlatScene scene{
      .width_px = 320, .height_px = 240, .focal_px = 250, .camera_height_m = 1.5, .noise = 1.0};
  scene.pictures.push_back({.image = skylight::test::corner_picture(7), .pose = robot});
  return scene;
}

inline RobotSpec robot_of(const skylight::test::FlatScene& scene, const std::string& id = "anna") {
  RobotSpec spec{.id = id, .appearance = appearance_of(scene.pictures.at(0), id)};
  spec.filter = WindowFilterConfig{.window_size = 4, .calibration_threshold = 0};
  spec.initial_pose = scene.pictures.at(0).pose;
  return spec;
}

/// A pipeline under one camera, `ceiling`, over a feed and a clock. Ends its feed before it stops.
struct Rig {
  explicit Rig(const skylight::test::FlatScene& room = small_room(), std::vector<RobotSpec> robots = {})
      : scene(room) {
    Tracker tracker({scene.camera()});
    for (const RobotSpec& robot : robots) tracker.add(robot);
    pipeline = std::make_unique<Pipeline>(PipelineParts{.source = std::make_shared<FakeFrames>(feed),
                                                        .cameras = {{"ceiling", scene.camera()}},
                                                        .tracker = std::move(tracker)},
                                          PipelineOptions{.clock = clock.function(), .log = {}});
  }
  ~Rig() {
    feed->end();
    pipeline->stop();
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  /// The scene at an instant, which the pipeline takes over as it is (the clock stands still).
  void push(Duration after_start) { feed->push(scene.render(kStart + after_start)); }
  /// The first snapshot that pleases; null after a minute without one.
  template <class Pleases>
  std::shared_ptr<const Snapshot> wait_for(Pleases pleases) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (std::chrono::steady_clock::now() < deadline) {
      auto snapshot = pipeline->snapshot();
      if (pleases(*snapshot)) return snapshot;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return nullptr;
  }
  std::shared_ptr<const Snapshot> wait_for_frames(std::uint64_t count) const {
    return wait_for([&](const Snapshot& s) { return s.cameras[0].frames == count; });
  }
  /// Pushes frames 33 ms apart, each only when the one before was tracked: none is dropped.
  std::shared_ptr<const Snapshot> track(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      push(std::chrono::milliseconds(33) * pushed_++);
      if (!wait_for_frames(pushed_)) return nullptr;
    }
    return pipeline->snapshot();
  }

  skylight::test::FlatScene scene;
  FakeClock clock;
  std::shared_ptr<Feed> feed = std::make_shared<Feed>();
  std::unique_ptr<Pipeline> pipeline;

 private:
  std::uint64_t pushed_ = 0;
};

}  // namespace skylight::service::test
