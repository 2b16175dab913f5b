// The threads: one captures, one tracks; clients read snapshots.
//
//   capture  -- newest frame -->  track  -- snapshot -->  any number of readers
//
// The capture thread hands on the newest frame of each camera only, in order of arrival: one that was not
// taken in time is dropped and counted. The tracking thread never waits for readers; changes (add a robot,
// ...) run on it between frames. What robots say of themselves waits in an inbox of its own for the frame
// that is as new: nobody who says it waits.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "service/calibration/in_use.hpp"
#include "service/camera_agreement.hpp"
#include "service/camera_watcher.hpp"
#include "service/clock.hpp"
#include "service/event_log.hpp"
#include "service/odometry_inbox.hpp"
#include "service/snapshot.hpp"
#include "service/sources/source.hpp"

namespace skylight::service {

struct NamedCamera {
  std::string id;
  CameraModel model;
  /// What the model was made from; null: nothing but the model, which is known as well as the tracker says.
  std::shared_ptr<const CalibrationInUse> calibration{};
  std::vector<FloorTag> floor_tags{};  ///< by which it may be calibrated by itself
};

/// A camera's new calibration.
struct Recalibration {
  std::string camera;
  std::shared_ptr<const CalibrationInUse> calibration;
};

/// What a pipeline runs over: the source, its cameras and the tracker for them, in the same order.
struct PipelineParts {
  std::shared_ptr<FrameSource> source;
  std::vector<NamedCamera> cameras;
  Tracker tracker;
};

struct PipelineOptions {
  Clock clock = system_now;
  double speed = 1.0;  ///< of a recorded source against real time, > 0; where the source has no speed itself
  std::function<void(const std::string&)> log = {};  ///< of what is no event
  std::shared_ptr<EventLog> events = {};             ///< where events go; none: to one of its own
  std::optional<CameraWatchConfig> watch = {};       ///< none: cameras are not watched for having been moved
};

class Pipeline {
 public:
  Pipeline(PipelineParts parts, PipelineOptions options);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  void start();
  void stop();
  /// Goes on over something else, running if it ran: readers find the new cameras and robots in the next
  /// snapshot, older snapshots stay whole. Changes that wait are made to the new tracker. Throws
  /// std::runtime_error when the pipeline is stopped.
  void restart(PipelineParts parts);

  std::shared_ptr<const Snapshot> snapshot() const;
  Time now() const { return options_.clock(); }
  EventLog& events() const { return *options_.events; }

  /// Runs `change` on the tracking thread between two frames and returns when it is done and shows in the
  /// snapshot; rethrows what it throws. Throws std::runtime_error when the pipeline is stopped. Before
  /// start() it waits.
  void change(const std::function<void(Tracker&)>& change);

  /// Takes new calibrations into use, all between the same two frames: tracker, snapshots and the watch over
  /// the cameras follow. Throws std::invalid_argument for a camera that is not there or has pictures of
  /// another size, and as change().
  void recalibrate(const std::vector<Recalibration>& cameras);

  /// What robots say of their motion; handed to the tracker before the first frame that is as new. Robots
  /// that are gone are forgotten, all of them by restart().
  OdometryInbox& odometry() { return odometry_; }

 private:
  struct Change {
    const std::function<void(Tracker&)>* run;
    std::promise<void> done;
  };

  void launch();
  void halt();
  void install(std::vector<NamedCamera> cameras);
  void capture();
  void capture_frames();
  void count_unreadable(std::size_t camera);
  void track();
  void process(const Frame& frame);
  void run_changes(std::vector<Change>& changes);
  void take_specs();
  void publish();
  bool wait_until(Time due);
  void hand_on(Frame frame);
  void take_feeds();
  void compare_cameras(const std::vector<RobotView>& views);
  void set_source(SourceState state, const std::string& error);

  PipelineOptions options_;
  OdometryInbox odometry_;
  std::shared_ptr<FrameSource> source_;
  Tracker tracker_;

  std::mutex running_mutex_;  ///< held to start, stop or restart
  bool running_ = false;

  mutable std::mutex mutex_;  ///< guards what stands between here and the threads
  std::condition_variable wake_;
  std::vector<Frame> newest_;  ///< in order of arrival, at most one per camera
  std::vector<Change> changes_;
  SourceState source_state_ = SourceState::starting;
  std::string source_error_;
  std::vector<std::uint64_t> dropped_;     ///< per camera
  std::vector<std::uint64_t> unreadable_;  ///< per camera, not yet in a snapshot
  bool feeds_changed_ = false;
  bool halting_ = false;  ///< the threads are to leave
  bool stopped_ = false;  ///< for good

  mutable std::mutex published_mutex_;  ///< held only to copy or swap the pointer
  std::shared_ptr<const Snapshot> published_;

  std::uint64_t bad_source_frames_ = 0;  ///< of the capture thread alone

  // Of the tracking thread alone.
  Snapshot next_;
  std::vector<std::shared_ptr<const RobotSpec>> specs_;
  std::unique_ptr<CameraWatcher> watcher_;
  CameraAgreements agreements_{0};
  std::vector<std::vector<Time>> recent_;  ///< capture times of the last second, per camera

  std::thread capture_thread_;
  std::thread track_thread_;
};

}  // namespace skylight::service
