// Where frames come from. Implementations: simulator, video, folder, live cameras.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "service/sources/feed_status.hpp"

namespace skylight::service {

/// A source that cannot go on: what and where, for people.
struct SourceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Largest picture that is decoded at all: what claims more is refused before memory is taken for it.
inline constexpr long long kMaxPicturePixels = 64LL * 1024 * 1024;

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// The next frame in order of capture, as fast as it can be had; its image is its own (never reused).
  /// None: the source has ended. Throws SourceError where it breaks off.
  virtual std::optional<Frame> next() = 0;

  /// Frames that could not be read and were skipped so far.
  virtual std::uint64_t bad_frames() const { return 0; }

  // For running against the wall's clock.

  /// When the frame that next() gave last reaches the program, on the source's own time (of which its stamps
  /// tell as well as its cameras' clocks are right); Time::min(): with its capture.
  virtual Time delivered() const { return Time::min(); }
  /// How fast the source's time runs against the wall's; none: as the pipeline was told.
  virtual std::optional<double> speed() const { return std::nullopt; }
  /// The wall's time that the frame which next() gave last was stamped with.
  virtual void stamped(Time) {}
  /// From another thread: a next() that waits returns soon, without a frame.
  virtual void interrupt() {}

  // For live cameras, whose frames are stamped in Unix time and come when they come.

  /// Frames go on at once and keep their times: nothing is paced, and speed() does not count.
  virtual bool live() const { return false; }
  /// How each camera's feed fares, in the cameras' order; empty where the source has none. From any thread.
  virtual std::vector<FeedStatus> feeds() const { return {}; }
  /// Whom to tell that feeds() has another state, apart from frames that come; from any thread, one at a
  /// time. Empty: nobody; it is not running when this returns.
  virtual void watch(std::function<void()>) {}
};

}  // namespace skylight::service
