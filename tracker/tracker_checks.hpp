// What the tracker accepts. Each function throws std::invalid_argument naming what is wrong and what is
// allowed.
#pragma once

#include "tracker/tracker.hpp"

namespace skylight {

void check_spec(const RobotSpec& spec);
/// One entry for each camera, or none.
void check_calibration(const std::vector<CameraUncertainty>& calibration, std::size_t cameras);
void check_recalibration(const std::vector<CameraModel>& cameras, std::size_t camera,
                         const CameraModel& model, const CameraUncertainty& uncertainty);
void check_config(const TrackerConfig& config);
void check_frame(const Frame& frame, const std::vector<CameraModel>& cameras);

}  // namespace skylight
