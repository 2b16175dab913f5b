// How long to wait before the next attempt: twice as long each time.
#pragma once

#include <algorithm>

#include "tracker/types.hpp"

namespace skylight::service {

class Backoff {
 public:
  Backoff(Duration shortest, Duration longest) : shortest_(shortest), longest_(longest), next_(shortest) {}

  Duration next() {
    const Duration now = std::min(next_, longest_);
    next_ = std::min(2 * now, longest_);
    return now;
  }
  void reset() { next_ = shortest_; }

 private:
  Duration shortest_;
  Duration longest_;
  Duration next_;
};

}  // namespace skylight::service
