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
};

}  // namespace skylight::service
