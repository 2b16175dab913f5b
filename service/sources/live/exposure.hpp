// From a driver's time stamp to the exposure's midpoint.
//
// V4L2 says of each buffer what its stamp stands for (Linux Media User API, "Buffer flags"):
// V4L2_BUF_FLAG_TSTAMP_SRC_SOE, the start of the exposure; V4L2_BUF_FLAG_TSTAMP_SRC_EOF, the default, "when
// the last pixel of the frame has been received". A sensor with a rolling shutter exposes its rows one after
// the other over the readout time r, each for e; the midpoint of the middle row, which stands for the
// picture, is
//   start of exposure (of the first row) + r / 2 + e / 2
//   end of frame (of the last row)       - r / 2 - e / 2
// A global shutter has r = 0 as far as the exposure goes, but its pixels are read after it: for its end of
// frame the transfer time is a delay to be given as latency.
#pragma once

#include "tracker/types.hpp"

namespace skylight::service {

enum class StampSource : std::uint8_t { start_of_exposure, end_of_frame };

struct Exposure {
  Duration time{};     ///< for which a row is exposed; 0 where unknown
  Duration readout{};  ///< from the first row's start to the last one's; 0: global shutter, or unknown
};

template <class TimePoint>
TimePoint exposure_midpoint(TimePoint stamp, StampSource source, const Exposure& exposure) {
  const Duration half = (exposure.time + exposure.readout) / 2;
  return source == StampSource::start_of_exposure ? stamp + half : stamp - half;
}

}  // namespace skylight::service
