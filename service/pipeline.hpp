// The threads: one captures, one tracks; clients read snapshots.
//
//   capture  -- newest frame -->  track  -- snapshot -->  any number of readers
//
// The capture thread hands on the newest frame only: one that was not taken in time is dropped and counted.
// The tracking thread never waits for readers; changes (add a robot, ...) run on it between frames.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "service/snapshot.hpp"
#include "service/sources/source.hpp"

namespace skylight::service {

using Clock = std::function<Time()>;
Time system_now();

struct NamedCamera {
  std::string id;
  CameraModel model;
};

struct PipelineOptions {
  Clock clock = system_now;
  double speed = 1.0;  ///< of a recorded or simulated source against real time, > 0
  std::function<void(const std::string&)> log = {};
};

class Pipeline {
 public:
  /// `cameras` in the order of the tracker's.
  Pipeline(std::unique_ptr<FrameSource> source, std::vector<NamedCamera> cameras, Tracker tracker,
           PipelineOptions options);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  void start();
  void stop();

  std::shared_ptr<const Snapshot> snapshot() const;
  Time now() const { return options_.clock(); }

  /// Runs `change` on the tracking thread between two frames and returns when it is done and shows in the
  /// snapshot; rethrows what it throws. Throws std::runtime_error when the pipeline is stopped. Before
  /// start() it waits.
  void change(const std::function<void(Tracker&)>& change);

 private:
  struct Change {
    const std::function<void(Tracker&)>* run;
    std::promise<void> done;
  };

  void capture();
  void capture_frames();
  void count_unreadable(std::size_t camera);
  void track();
  void process(const Frame& frame);
  void run_changes(std::vector<Change>& changes);
  void publish();
  bool wait_until(Time due);
  void set_source(SourceState state, const std::string& error);

  PipelineOptions options_;
  std::unique_ptr<FrameSource> source_;
  Tracker tracker_;

  mutable std::mutex mutex_;  ///< guards what stands between here and the threads
  std::condition_variable wake_;
  std::optional<Frame> newest_;
  std::vector<Change> changes_;
  SourceState source_state_ = SourceState::starting;
  std::string source_error_;
  std::vector<std::uint64_t> dropped_;     ///< per camera
  std::vector<std::uint64_t> unreadable_;  ///< per camera, not yet in a snapshot
  bool stopping_ = false;

  mutable std::mutex published_mutex_;  ///< held only to copy or swap the pointer
  std::shared_ptr<const Snapshot> published_;

  std::uint64_t bad_source_frames_ = 0;  ///< of the capture thread alone

  // Of the tracking thread alone.
  Snapshot next_;
  std::vector<std::shared_ptr<const RobotSpec>> specs_;
  std::vector<std::vector<Time>> recent_;  ///< capture times of the last second, per camera

  std::thread capture_thread_;
  std::thread track_thread_;
};

}  // namespace skylight::service
