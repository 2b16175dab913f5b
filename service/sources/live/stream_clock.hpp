// From the presentation times of a stream to Unix time.
//
// A stream's stamps count evenly, but from an instant that nobody knows; its arrivals are known, but late by
// encoder, network and buffers, each time differently. The smallest lateness of the last ten seconds ties the
// two together (service/clock_offset.hpp, the minimum filter of NTP): a stamp then has the jitter of the best
// arrival instead of its own. What even the quickest picture takes is the same for all of them and cannot be
// told from the arrivals: it is configured as latency_s and subtracted by the feed.
//
// At its beginning a stream empties its buffers: pictures come in a burst, all of them late. Their lateness
// would pass for the stream's own, so nothing is dated before it has been heard for a while.
#pragma once

#include <optional>

#include "service/clock_offset.hpp"

namespace skylight::service {

class StreamClock {
 public:
  /// Of arrivals, until the smallest lateness can be relied upon.
  static constexpr Duration kSettling = std::chrono::seconds(1);

  /// When the picture would have arrived by the quickest way; never after `arrived`. None where the stamp
  /// does not go with the others (service/clock_offset.hpp: 0.25 s off; after a second of such the clock was
  /// set).
  std::optional<Time> instant(Duration stamp, Time arrived) {
    if (!begun_) begun_ = arrived;
    const Time stamped{stamp};
    if (!offset_.hear(arrived, stamped)) return std::nullopt;
    return stamped - *offset_.offset();
  }

  /// The stamps' clock less ours; none before the first picture.
  std::optional<Duration> offset() const { return offset_.offset(); }

  bool settled(Time arrived) const { return begun_ && arrived - *begun_ >= kSettling; }

  /// Stamps begin anew.
  void reset() {
    offset_ = ClockOffset();
    begun_.reset();
  }

 private:
  ClockOffset offset_;
  std::optional<Time> begun_;
};

}  // namespace skylight::service
