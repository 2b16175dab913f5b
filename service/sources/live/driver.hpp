// What a live camera must be able to do. Implementations: v4l2_camera, stream_camera, posted_camera, and the
// tests' own.
#pragma once

#include <optional>
#include <string>

#include "service/sources/source.hpp"

namespace skylight::service {

/// What a driver read: a picture, or why it could not be decoded.
struct Shot {
  cv::Mat image{};  ///< its own memory, CV_8UC1 or CV_8UC3 (BGR); empty where it could not be decoded
  std::string unreadable{};  ///< then why
  Time arrived{};            ///< when it was here, by our clock
  /// The exposure's midpoint by our clock, where the driver can tell it.
  std::optional<Time> captured{};
  /// Else its stamp by a clock of the source's own, from whatever instant that counts; none: it has no clock.
  std::optional<Duration> stamp{};
  /// The stamp is Unix time by a clock that may be wrong: how wrong is worth showing.
  bool stamp_is_unix = false;
  std::uint64_t lost = 0;  ///< that never came, between the one before and this
};

/// Used by one thread, but for interrupt(). After a SourceError, or after close(), open() may be called
/// again.
class CameraDriver {
 public:
  virtual ~CameraDriver() = default;

  /// Throws SourceError: what and why, one line for people, without secrets (passwords in addresses).
  virtual void open() = 0;
  /// Waits for the next picture. Throws SourceError where the camera is gone or is silent for too long.
  virtual Shot read() = 0;
  virtual void close() = 0;
  /// From another thread, for good: open() and read() that wait throw SourceError soon, later ones at once.
  virtual void interrupt() = 0;
};

}  // namespace skylight::service
