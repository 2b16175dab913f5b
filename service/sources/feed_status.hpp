// How the feed of one live camera fares.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tracker/types.hpp"

namespace skylight::service {

/// connecting: the first attempt, or no picture yet; running: new pictures come; frozen: pictures come and
/// are always the same; failed: the last attempt or the connection broke, another one follows.
enum class FeedState : std::uint8_t { connecting, running, frozen, failed };

struct FeedStatus {
  std::string kind;  ///< v4l2, stream or posted
  FeedState state = FeedState::connecting;
  Time since{};                     ///< in this state; frozen: when the picture last changed
  std::string reason;               ///< why it does not run, for people; empty where it does
  std::uint64_t reconnects = 0;     ///< how often it came back after it had failed
  std::uint64_t received = 0;       ///< handed on as new
  std::uint64_t lost = 0;           ///< that the driver's or the stream's own count says never came
  std::uint64_t unreadable = 0;     ///< that came and could not be decoded
  std::uint64_t repeats = 0;        ///< that were the one before once more
  std::uint64_t undated = 0;        ///< whose time could not be told, or was not after the one before
  std::uint64_t overtaken = 0;      ///< that nobody took before a newer one was there
  double frame_rate_hz = 0.0;       ///< of new pictures, over the last two seconds; 0 where none came
  std::optional<Duration> delay{};  ///< of the newest: from its exposure until it was here
  std::optional<Duration>
      clock_offset{};  ///< the camera's clock less ours, where it stamps Unix time by its own
};

inline std::string_view to_string(FeedState state) {
  switch (state) {
    case FeedState::connecting:
      return "connecting";
    case FeedState::running:
      return "running";
    case FeedState::frozen:
      return "frozen";
    case FeedState::failed:
      return "failed";
  }
  return "unknown";
}

}  // namespace skylight::service
