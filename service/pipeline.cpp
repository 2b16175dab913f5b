#include "service/pipeline.hpp"

#include <algorithm>
#include <utility>

#include "service/camera_doubt.hpp"
#include "service/event_kinds.hpp"

namespace skylight::service {
namespace {

// What a frame of a recorded or simulated source is on the wall's clock. A source that cannot keep up does
// not pile up a debt, nor one that was paused: what was lost is lost, and its time goes on from now.
class Pacer {
 public:
  explicit Pacer(Time now) : wall_(now) {}

  struct Due {
    Time captured;
    Time delivered;
  };

  /// `delivered` before all time: with its capture. A camera whose clock is wrong stamps wrongly, and is
  /// paced all the same by when its frames arrive.
  Due due(Time captured, Time delivered, Time now, double speed) {
    constexpr Duration kTolerated = std::chrono::milliseconds(200);
    const Time arrives = delivered == Time::min() ? captured : delivered;
    if (!begun_) source_ = arrives;
    begun_ = true;
    Due due{on_wall(captured, speed), on_wall(arrives, speed)};
    if (const Duration late = now - due.delivered; late > kTolerated) {
      due.captured += late;
      due.delivered += late;
    }
    source_ = arrives;
    wall_ = due.delivered;
    return due;
  }

 private:
  Time on_wall(Time source, double speed) const {
    return wall_ +
           Duration{static_cast<Duration::rep>(static_cast<double>((source - source_).count()) / speed)};
  }

  // The same instant on both clocks: the newest frame's.
  bool begun_ = false;
  Time source_{};
  Time wall_;
};

std::exception_ptr stopping() {
  return std::make_exception_ptr(std::runtime_error("the service is stopping"));
}

}  // namespace

const RobotSnapshot* Snapshot::robot(std::string_view id) const {
  const auto at = std::find_if(robots.begin(), robots.end(),
                               [&](const RobotSnapshot& robot) { return robot.view.id == id; });
  return at == robots.end() ? nullptr : &*at;
}

const CameraSnapshot* Snapshot::camera(std::string_view id) const {
  const auto at = std::find_if(cameras.begin(), cameras.end(),
                               [&](const CameraSnapshot& camera) { return camera.id == id; });
  return at == cameras.end() ? nullptr : &*at;
}

Pipeline::Pipeline(PipelineParts parts, PipelineOptions options)
    : options_(std::move(options)), source_(std::move(parts.source)), tracker_(std::move(parts.tracker)) {
  if (!options_.events) options_.events = std::make_shared<EventLog>(options_.clock);
  install(std::move(parts.cameras));
}

Pipeline::~Pipeline() {
  stop();
}

// Everything that is one per camera or robot, as at the beginning. Without threads.
void Pipeline::install(std::vector<NamedCamera> cameras) {
  newest_.clear();
  feeds_changed_ = false;
  source_state_ = SourceState::starting;
  source_error_.clear();
  dropped_.assign(cameras.size(), 0);
  unreadable_.assign(cameras.size(), 0);
  recent_.assign(cameras.size(), {});
  bad_source_frames_ = 0;
  odometry_.clear();
  next_ = Snapshot{.sequence = next_.sequence, .source_error = {}, .robots = {}, .cameras = {}};
  watcher_ = options_.watch ? std::make_unique<CameraWatcher>(*options_.watch, cameras.size()) : nullptr;
  agreements_ = CameraAgreements(cameras.size());
  for (NamedCamera& camera : cameras) {
    if (!camera.calibration)
      camera.calibration = std::make_shared<const CalibrationInUse>(
          CalibrationInUse{calibration_of(camera.model, tracker_.uncertainty(next_.cameras.size()))});
    next_.cameras.push_back({.id = std::move(camera.id),
                             .model = std::make_shared<const CameraModel>(camera.model),
                             .calibration = std::move(camera.calibration),
                             .image = {},
                             .floor_tags = std::move(camera.floor_tags)});
  }
  take_specs();
  publish();
}

void Pipeline::start() {
  const std::lock_guard running(running_mutex_);
  running_ = true;
  launch();
}

void Pipeline::stop() {
  const std::lock_guard running(running_mutex_);
  halt();
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  for (Change& change : changes_) change.done.set_exception(stopping());
  changes_.clear();
}

void Pipeline::restart(PipelineParts parts) {
  const std::lock_guard running(running_mutex_);
  halt();
  const std::unique_lock lock(mutex_);
  if (stopped_) std::rethrow_exception(stopping());
  source_ = std::move(parts.source);
  tracker_ = std::move(parts.tracker);
  install(std::move(parts.cameras));
  halting_ = false;
  if (running_) launch();
}

void Pipeline::launch() {
  source_->watch([this] {
    {
      const std::lock_guard lock(mutex_);
      feeds_changed_ = true;
    }
    wake_.notify_all();
  });
  capture_thread_ = std::thread([this] { capture(); });
  track_thread_ = std::thread([this] { track(); });
}

void Pipeline::halt() {
  {
    const std::lock_guard lock(mutex_);
    halting_ = true;
  }
  source_->interrupt();
  source_->watch({});
  wake_.notify_all();
  if (capture_thread_.joinable()) capture_thread_.join();
  if (track_thread_.joinable()) track_thread_.join();
}

std::shared_ptr<const Snapshot> Pipeline::snapshot() const {
  const std::lock_guard lock(published_mutex_);
  return published_;
}

void Pipeline::change(const std::function<void(Tracker&)>& change) {
  std::future<void> done;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) std::rethrow_exception(stopping());
    changes_.push_back({&change, {}});
    done = changes_.back().done.get_future();
  }
  wake_.notify_all();
  done.get();
}

// On the tracking thread between two frames: nobody sees one camera's new place beside another's old one.
void Pipeline::recalibrate(const std::vector<Recalibration>& cameras) {
  change([&](Tracker& tracker) {
    std::vector<std::size_t> indices;
    for (const Recalibration& each : cameras) {
      const CameraSnapshot* camera = next_.camera(each.camera);
      if (camera == nullptr) throw std::invalid_argument("there is no camera '" + each.camera + "'");
      indices.push_back(static_cast<std::size_t>(camera - next_.cameras.data()));
    }
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const CalibrationFile& document = cameras[i].calibration->document;
      const CameraModel model = camera_model(document);
      tracker.recalibrate(indices[i], model, uncertainty_of(document));
      CameraSnapshot& camera = next_.cameras[indices[i]];
      const auto before = std::exchange(camera.model, std::make_shared<const CameraModel>(model));
      camera.calibration = cameras[i].calibration;
      end_doubt(camera);
      events().add(calibration_event(camera, *before));
      if (!watcher_) continue;
      watcher_->relearn(indices[i]);
      camera.hold = watcher_->report(indices[i]);
    }
  });
}

void Pipeline::set_source(SourceState state, const std::string& error) {
  {
    const std::lock_guard lock(mutex_);
    source_state_ = state;
    source_error_ = error;
  }
  wake_.notify_all();
  events().add(source_event(state, error));
}

void Pipeline::capture() {
  try {
    set_source(SourceState::running, {});
    capture_frames();
  } catch (const std::exception& e) {
    set_source(SourceState::failed, e.what());
  }
}

void Pipeline::capture_frames() {
  Pacer pacer(now());
  std::size_t camera = 0;
  while (auto frame = source_->next()) {
    camera = frame->camera;
    Time delivered = Time::min();
    if (!source_->live()) {
      const auto due =
          pacer.due(frame->captured, source_->delivered(), now(), source_->speed().value_or(options_.speed));
      frame->captured = due.captured;
      delivered = due.delivered;
    }
    // In whole microseconds, as on the wire: an instant that a client read there is this very one.
    frame->captured = std::chrono::floor<std::chrono::microseconds>(frame->captured);
    if (!wait_until(delivered)) return;
    source_->stamped(frame->captured);
    hand_on(std::move(*frame));
    wake_.notify_all();
  }
  {
    const std::lock_guard lock(mutex_);
    count_unreadable(camera);
  }
  set_source(SourceState::ended, {});
}

// One that the tracking thread has not taken gives way to the newer one of the same camera.
void Pipeline::hand_on(Frame frame) {
  const std::lock_guard lock(mutex_);
  const std::size_t camera = frame.camera;
  if (std::erase_if(newest_, [&](const Frame& waits) { return waits.camera == camera; }) > 0 &&
      camera < dropped_.size())
    ++dropped_[camera];
  newest_.push_back(std::move(frame));
  count_unreadable(camera);
}

// Under the lock. What the source skipped counts for the camera whose frame came next, or last.
void Pipeline::count_unreadable(std::size_t camera) {
  const std::uint64_t so_far = source_->bad_frames();
  if (camera < unreadable_.size()) unreadable_[camera] += so_far - bad_source_frames_;
  bad_source_frames_ = so_far;
}

// False when the threads are to leave meanwhile.
bool Pipeline::wait_until(Time due) {
  std::unique_lock lock(mutex_);
  const Time at = now();
  if (due > at) wake_.wait_for(lock, due - at, [this] { return halting_; });
  return !halting_;
}

void Pipeline::track() {
  for (;;) {
    std::optional<Frame> frame;
    std::vector<Change> changes;
    {
      std::unique_lock lock(mutex_);
      const SourceState shown = next_.source;
      wake_.wait(lock, [&] {
        return halting_ || !newest_.empty() || !changes_.empty() || feeds_changed_ || source_state_ != shown;
      });
      if (halting_) return;  // changes wait for who comes next, or for stop()
      if (!newest_.empty()) {
        frame = std::move(newest_.front());
        newest_.erase(newest_.begin());
      }
      changes.swap(changes_);
      feeds_changed_ = false;
      next_.source = source_state_;
      next_.source_error = source_error_;
      for (std::size_t i = 0; i < dropped_.size(); ++i) {
        next_.cameras[i].dropped = dropped_[i];
        next_.cameras[i].bad_frames += std::exchange(unreadable_[i], 0);
      }
    }
    take_feeds();
    if (frame) process(*frame);
    if (changes.empty()) {
      publish();
    } else {
      run_changes(changes);
    }
  }
}

// How live cameras fare, and what they dropped and could not read themselves.
void Pipeline::take_feeds() {
  std::vector<FeedStatus> feeds = source_->feeds();
  for (std::size_t i = 0; i < std::min(feeds.size(), next_.cameras.size()); ++i) {
    CameraSnapshot& camera = next_.cameras[i];
    FeedStatus& feed = feeds[i];
    camera.dropped += feed.overtaken;
    camera.bad_frames += feed.unreadable - (camera.feed ? camera.feed->unreadable : 0);
    const bool other = !camera.feed || camera.feed->state != feed.state || camera.feed->reason != feed.reason;
    if (other) events().add(feed_event(camera.id, feed));
    camera.feed = std::move(feed);
  }
}

void Pipeline::process(const Frame& frame) {
  const auto begin = std::chrono::steady_clock::now();
  for (const HeardOdometry& said : odometry_.take(frame.captured))
    tracker_.odometry(said.robot, said.velocity);
  try {
    tracker_.process(frame);
  } catch (const std::exception& e) {  // a bad frame is counted and skipped, never fatal
    if (frame.camera < next_.cameras.size()) ++next_.cameras[frame.camera].bad_frames;
    if (options_.log) options_.log(std::string("frame skipped: ") + e.what());
    return;
  }
  CameraSnapshot& camera = next_.cameras[frame.camera];
  std::vector<Time>& recent = recent_[frame.camera];
  recent.push_back(frame.captured);
  std::erase_if(recent, [&](Time t) { return frame.captured - t > std::chrono::seconds(1); });
  const double span = to_seconds(recent.back() - recent.front());
  camera.frame_rate_hz = span > 0 ? static_cast<double>(recent.size() - 1) / span : 0.0;
  ++camera.frames;
  camera.captured = frame.captured;
  camera.image = frame.image;
  camera.depth = tracker_.floor_fit(frame.camera);
  if (watcher_) {
    watcher_->offer(frame);
    if (auto event = take_hold(watcher_->report(frame.camera), frame.camera, camera, tracker_))
      events().add(std::move(*event));
  }
  next_.captured = std::max(next_.captured, frame.captured);
  next_.tracker_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  next_.processed = now();
}

void Pipeline::compare_cameras(const std::vector<RobotView>& views) {
  if (next_.cameras.size() < 2) return;
  const std::vector<AgreementChange> changes = agreements_.see(next_.captured, views);
  for (std::size_t i = 0; i < next_.cameras.size(); ++i) {
    next_.cameras[i].agreement = agreements_.of(i);
    next_.cameras[i].disagrees = agreements_.disagrees(i);
  }
  for (const AgreementChange& change : changes)
    events().add(agreement_event(next_.cameras[change.camera].id, change));
}

// Every change is answered after it shows: whoever added a robot finds it.
void Pipeline::run_changes(std::vector<Change>& changes) {
  std::vector<std::exception_ptr> failures;
  for (const Change& change : changes) {
    const auto before = specs_;
    try {
      (*change.run)(tracker_);
      failures.emplace_back();
    } catch (...) {
      failures.push_back(std::current_exception());
    }
    take_specs();
    for (Event& event : robot_events(before, specs_)) events().add(std::move(event));
  }
  publish();
  for (std::size_t i = 0; i < changes.size(); ++i) {
    failures[i] ? changes[i].done.set_exception(failures[i]) : changes[i].done.set_value();
  }
}

void Pipeline::take_specs() {
  specs_.clear();
  std::set<std::string> ids;
  for (const RobotSpec& spec : tracker_.robots()) {
    specs_.push_back(std::make_shared<const RobotSpec>(spec));
    ids.insert(spec.id);
  }
  odometry_.keep_only(ids);
}

void Pipeline::publish() {
  std::vector<RobotView> views = tracker_.views();
  compare_cameras(views);
  next_.robots.clear();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto copies = std::count_if(specs_.begin(), specs_.end(), [&](const auto& spec) {
      return spec == specs_[i] || (spec->appearance && spec->appearance == specs_[i]->appearance);
    });
    next_.robots.push_back({specs_[i], std::move(views[i]), static_cast<int>(copies)});
  }
  ++next_.sequence;
  auto snapshot = std::make_shared<const Snapshot>(next_);
  const std::lock_guard lock(published_mutex_);
  published_ = std::move(snapshot);
}

}  // namespace skylight::service
