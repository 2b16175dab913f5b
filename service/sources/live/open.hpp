// From a configuration to live cameras.
#pragma once

#include <memory>

#include "service/config.hpp"
#include "service/sources/live/live_cameras.hpp"
#include "service/sources/live/posted_cameras.hpp"

namespace skylight::service {

struct OpenedCameras {
  std::shared_ptr<LiveCameras> source;
  PostedCameras posted;
};

/// The cameras of a configuration whose source.type is cameras. Opens nothing yet: a camera that is not there
/// keeps nobody from starting, its feed tells. Throws SourceError only where the machine is out of
/// descriptors.
OpenedCameras open_cameras(const Config& config, const Clock& clock = system_now);

}  // namespace skylight::service
