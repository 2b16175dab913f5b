#include "service/sources/live/camera_feed.hpp"

#include <utility>

namespace skylight::service {
namespace {

constexpr Duration kRateWindow = std::chrono::seconds(2);

std::string size_text(cv::Size size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height) + " px";
}

}  // namespace

CameraFeed::CameraFeed(FeedOptions options, std::unique_ptr<CameraDriver> driver, Listener listener)
    : options_(std::move(options)),
      driver_(std::move(driver)),
      listener_(std::move(listener)),
      freeze_(options_.frozen_after) {
  status_.kind = options_.kind;
  status_.since = options_.clock();
}

void CameraFeed::run() {
  Backoff backoff(options_.shortest_rest, options_.longest_rest);
  while (!interrupted()) {
    try {
      live_through_a_connection(backoff);
    } catch (const std::exception& e) {
      if (!interrupted()) note_state(FeedState::failed, options_.clock(), e.what());
    }
    driver_->close();
    if (interrupted() || !rest(backoff.next())) return;
  }
}

// Leaves by what the driver throws, or by interrupt().
void CameraFeed::live_through_a_connection(Backoff& backoff) {
  stream_clock_.reset();
  freeze_.reconnected();
  driver_->open();
  while (!interrupted()) {
    if (take(driver_->read())) backoff.reset();
  }
}

// True where it was a new picture.
bool CameraFeed::take(Shot picture) {
  count(&FeedStatus::lost, picture.lost);
  sequence_ += 1 + picture.lost;
  if (picture.image.empty()) {
    count(&FeedStatus::unreadable);
    return false;
  }
  if (!options_.size_px.empty() && picture.image.size() != options_.size_px) {
    throw SourceError("gives pictures of " + size_text(picture.image.size()) +
                      ", the camera is calibrated for " + size_text(options_.size_px));
  }
  const auto captured = instant_of(picture);
  if (!freeze_.fresh(picture.image, picture.stamp, picture.arrived)) {
    count(&FeedStatus::repeats);
    if (freeze_.frozen()) note_state(FeedState::frozen, freeze_.since(), freeze_.reason());
    return false;
  }
  if (!captured || *captured <= last_captured_) {
    count(&FeedStatus::undated);
    return false;
  }
  last_captured_ = *captured;
  Frame frame{.camera = options_.camera, .sequence = sequence_ - 1, .captured = *captured};
  frame.image = std::move(picture.image);
  note_fresh(frame, picture.arrived);
  note_state(FeedState::running, options_.clock(), {});
  listener_.frame(std::move(frame));
  return true;
}

std::optional<Time> CameraFeed::instant_of(const Shot& picture) {
  std::optional<Time> instant = picture.captured;
  if (picture.stamp) {
    const auto mapped = stream_clock_.instant(*picture.stamp, picture.arrived);
    const bool reliable = picture.stamp_is_unix || stream_clock_.settled(picture.arrived);
    if (!instant && reliable) instant = mapped;
    if (!instant) return std::nullopt;
    const std::lock_guard lock(mutex_);
    if (picture.stamp_is_unix) status_.clock_offset = stream_clock_.offset();
  }
  return instant.value_or(picture.arrived) - options_.latency;
}

void CameraFeed::note_fresh(const Frame& frame, Time arrived) {
  const std::lock_guard lock(mutex_);
  ++status_.received;
  status_.delay = arrived - frame.captured;
  arrivals_.push_back(arrived);
  while (arrived - arrivals_.front() > kRateWindow) arrivals_.pop_front();
}

void CameraFeed::note_state(FeedState state, Time since, const std::string& reason) {
  {
    const std::lock_guard lock(mutex_);
    if (status_.state == state && status_.reason == reason) return;
    if (status_.state == FeedState::failed && state == FeedState::running) ++status_.reconnects;
    if (status_.state != state) status_.since = since;
    status_.state = state;
    status_.reason = reason;
  }
  if (listener_.changed) listener_.changed();
}

void CameraFeed::count(std::uint64_t FeedStatus::*what, std::uint64_t by) {
  const std::lock_guard lock(mutex_);
  status_.*what += by;
}

FeedStatus CameraFeed::status() const {
  const Time now = options_.clock();
  const std::lock_guard lock(mutex_);
  FeedStatus out = status_;
  const bool comes = arrivals_.size() > 1 && now - arrivals_.back() <= kRateWindow;
  const double span = comes ? to_seconds(arrivals_.back() - arrivals_.front()) : 0.0;
  if (span > 0.0) out.frame_rate_hz = static_cast<double>(arrivals_.size() - 1) / span;
  return out;
}

bool CameraFeed::rest(Duration duration) {
  if (options_.rest) return options_.rest(duration) && !interrupted();
  std::unique_lock lock(mutex_);
  return !wake_.wait_for(lock, duration, [this] { return interrupted_; });
}

bool CameraFeed::interrupted() const {
  const std::lock_guard lock(mutex_);
  return interrupted_;
}

void CameraFeed::interrupt() {
  {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
  }
  wake_.notify_all();
  driver_->interrupt();
}

}  // namespace skylight::service
