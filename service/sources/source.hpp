// Where frames come from. Implementations: simulator, video, folder.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>

#include "tracker/types.hpp"

namespace skylight::service {

/// A source that cannot go on: what and where, for people.
struct SourceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

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
};

}  // namespace skylight::service
