// A camera's calibration while the service runs.
#pragma once

#include <filesystem>
#include <vector>

#include "service/calibration/file.hpp"

namespace skylight::service {

struct CalibrationInUse {
  CalibrationFile document;  ///< with its map_from_camera
  /// Where it is kept, with its versions. Empty: nowhere, it is lost when the service ends.
  std::filesystem::path file{};
  /// Of one that is kept nowhere: what was in use before, the oldest first.
  std::vector<CalibrationFile> earlier{};
};

}  // namespace skylight::service
