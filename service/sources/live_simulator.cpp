#include "service/sources/live_simulator.hpp"

#include <algorithm>
#include <utility>

namespace skylight::service {

std::string_view to_string(RunState state) {
  switch (state) {
    case RunState::running:
      return "running";
    case RunState::paused:
      return "paused";
    case RunState::ended:
      return "ended";
  }
  return "unknown";
}

/// Somebody's turn between two frames: the thread that takes frames, which would else take the lock again at
/// once, lets whoever waits go first.
class LiveSimulator::Turn {
 public:
  explicit Turn(LiveSimulator& live) : live_(live) {
    {
      const std::lock_guard lock(live_.mutex_);
      ++live_.waiting_;
    }
    live_.frames_mutex_.lock();
  }
  ~Turn() {
    live_.frames_mutex_.unlock();
    {
      const std::lock_guard lock(live_.mutex_);
      --live_.waiting_;
    }
    live_.wake_.notify_all();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  bool ended() const {
    const std::lock_guard lock(live_.mutex_);
    return live_.state_ == RunState::ended;
  }

 private:
  LiveSimulator& live_;
};

LiveSimulator::LiveSimulator(std::unique_ptr<SimulatorFrames> frames, double speed)
    : frames_(std::move(frames)), speed_(speed) {}

std::optional<Frame> LiveSimulator::next() {
  {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return interrupted_ || state_ == RunState::ended || may_go(); });
    if (interrupted_ || state_ == RunState::ended) return std::nullopt;
    if (state_ != RunState::running) --steps_;
  }
  const std::lock_guard world(frames_mutex_);
  auto arrived = first_to_arrive();
  hear();
  const std::lock_guard lock(mutex_);
  if (!arrived) {
    state_ = RunState::ended;
    return std::nullopt;
  }
  delivered_ = arrived->delivered;
  status_.truth = std::move(arrived->truth);
  status_.camera = arrived->frame.camera;
  source_captured_ = arrived->frame.captured;
  status_.captured = arrived->frame.captured;  // until it is stamped
  return std::move(arrived->frame);
}

// The world runs on until nothing that is still to be captured can arrive before it. None at the end.
std::optional<LiveSimulator::UnderWay> LiveSimulator::first_to_arrive() {
  const auto first = [this] {
    return std::min_element(under_way_.begin(), under_way_.end(),
                            [](const UnderWay& a, const UnderWay& b) { return a.delivered < b.delivered; });
  };
  while (under_way_.empty() || first()->delivered > frames_->now()) {
    if (!draw()) break;
  }
  if (under_way_.empty()) return std::nullopt;
  const auto at = first();
  UnderWay arrived = std::move(*at);
  under_way_.erase(at);
  return arrived;
}

bool LiveSimulator::draw() {
  auto frame = frames_->next();
  if (!frame) return false;
  under_way_.push_back({std::move(*frame), frames_->delivered(), frames_->truth()});
  return true;
}

// What the world told meanwhile, for readers.
void LiveSimulator::hear() {
  auto happenings = frames_->take_happenings();
  auto odometry = frames_->take_odometry();
  const std::lock_guard lock(mutex_);
  for (Happening& happening : happenings) happenings_.push_back(std::move(happening));
  if (happenings_.size() > kMaxHappenings) {
    const auto surplus = static_cast<std::ptrdiff_t>(happenings_.size() - kMaxHappenings);
    happenings_.erase(happenings_.begin(), happenings_.begin() + surplus);
  }
  for (Odometry& report : odometry) odometry_[report.robot] = std::move(report);
  status_.time = frames_->now() - frames_->start();
}

std::optional<double> LiveSimulator::speed() const {
  const std::lock_guard lock(mutex_);
  return speed_;
}

void LiveSimulator::stamped(Time at) {
  const std::lock_guard lock(mutex_);
  status_.captured = at;
}

void LiveSimulator::interrupt() {
  {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
  }
  wake_.notify_all();
}

SimulatorStatus LiveSimulator::status() const {
  const std::lock_guard lock(mutex_);
  SimulatorStatus out = status_;
  out.state = state_;
  out.speed = speed_;
  return out;
}

bool LiveSimulator::run() {
  {
    const std::lock_guard lock(mutex_);
    if (state_ == RunState::ended) return false;
    state_ = RunState::running;
    steps_ = 0;
  }
  wake_.notify_all();
  return true;
}

bool LiveSimulator::pause() {
  const std::lock_guard lock(mutex_);
  if (state_ == RunState::ended) return false;
  state_ = RunState::paused;
  return true;
}

bool LiveSimulator::step(int frames) {
  {
    const std::lock_guard lock(mutex_);
    if (state_ != RunState::paused) return false;
    steps_ += frames;
  }
  wake_.notify_all();
  return true;
}

void LiveSimulator::set_speed(double speed) {
  const std::lock_guard lock(mutex_);
  speed_ = speed;
}

std::optional<Duration> LiveSimulator::act(std::string_view json, const std::string& name) {
  const Turn turn(*this);
  if (turn.ended()) return std::nullopt;
  frames_->act(json, name);
  return frames_->now() - frames_->start();
}

std::optional<Duration> LiveSimulator::drive(const DriveCommand& command) {
  const Turn turn(*this);
  if (turn.ended()) return std::nullopt;
  frames_->drive(command);
  return frames_->now() - frames_->start();
}

std::vector<Happening> LiveSimulator::happenings() const {
  const std::lock_guard lock(mutex_);
  return happenings_;
}

std::optional<Odometry> LiveSimulator::odometry(const std::string& robot) const {
  const std::lock_guard lock(mutex_);
  const auto at = odometry_.find(robot);
  if (at == odometry_.end()) return std::nullopt;
  Odometry report = at->second;
  report.at = wall_time(report.at);
  return report;
}

// Under the lock: the newest frame tells how the source's time and the wall's go together.
Time LiveSimulator::wall_time(Time source) const {
  const auto since = static_cast<double>((source - source_captured_).count());
  return status_.captured + Duration{static_cast<Duration::rep>(since / speed_)};
}

}  // namespace skylight::service
