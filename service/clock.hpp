// The wall's clock as an argument, so that a test can hold it in its hands.
#pragma once

#include <chrono>
#include <functional>

#include "tracker/types.hpp"

namespace skylight::service {

using Clock = std::function<Time()>;

inline Time system_now() {
  return std::chrono::time_point_cast<Duration>(std::chrono::system_clock::now());
}

}  // namespace skylight::service
