// Truth and results as MOTChallenge files, for outside evaluators. Frames, robots and pixels count from 1; a
// box begins at its outer edge, so that the box of the first pixel begins at 1.
#pragma once

#include <string>

#include "service/sources/simulator.hpp"
#include "tracker/tracker.hpp"

namespace skylight::service {

/// frame,id,left,top,width,height,1,1,visibility (Milan et al. 2016, "MOT16", section 4.4). Needs
/// truth.box_px.
std::string mot_truth_line(std::uint64_t sequence, std::size_t robot, const Truth& truth);

/// frame,id,left,top,width,height,confidence,x,y,z with the place on the floor in metres (Leal-Taixé et al.
/// 2015, "MOTChallenge 2015", section 3.3); the box is of the robot's top. Empty where the camera does not
/// see it.
std::string mot_result_line(const Frame& frame, std::size_t robot, const RobotSpec& spec, const Pose2& pose,
                            const CameraModel& camera);

}  // namespace skylight::service
