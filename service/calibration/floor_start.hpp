// A first pose for each camera and a first place for each sheet, whatever single points say.
#pragma once

#include "service/calibration/floor_fit.hpp"

namespace skylight::calibration {

/// Throws std::invalid_argument as calibrate_extrinsics().
FloorState floor_start(const ExtrinsicsInput& input);

}  // namespace skylight::calibration
