// The events that the pipeline raises, and what each of them says.
//
//   source.state     the source runs, has ended, or failed           data: state, reason
//   camera.state     a live camera connects, runs, froze, or failed  data: state, reason
//   camera.moved     a camera hangs elsewhere than before            data: since, shift_px, degrees
//   camera.back      it sees the floor where it was again            data: since
//   camera.blind     it sees too little of the floor to tell         data: since
//   calibration.changed  a camera has another calibration            data: shift_mm, turn_deg
//   cameras.disagree a camera sees robots elsewhere than the others  data: off_m, sigmas, robots, refused
//   cameras.agree    it sees them where the others do again          data: the same
//   camera.recalibrated, camera.recalibration_failed                 see self_calibration.cpp
//   robot.added, robot.changed, robot.removed
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "service/event_log.hpp"
#include "service/snapshot.hpp"

namespace skylight::service {

/// `reason`: why it failed; empty otherwise.
Event source_event(SourceState state, const std::string& reason);

Event feed_event(const std::string& camera, const FeedStatus& feed);

/// What the watch over `camera` has come to (`hold` is there), which was `before`; none where it has only
/// learnt what the floor looks like.
std::optional<Event> hold_event(const CameraSnapshot& camera, CameraHold before);

/// `camera` has its new calibration; `before`: what it was by the one before.
Event calibration_event(const CameraSnapshot& camera, const CameraModel& before);

Event agreement_event(const std::string& camera, const AgreementChange& change);

/// How far the camera was turned, to move the floor in its picture as far as it was moved, radians: about the
/// optical axis, and across it as though it had only been turned.
double turned_rad(const CameraWatchReport& hold, const Intrinsics& intrinsics);

using RobotSpecs = std::vector<std::shared_ptr<const RobotSpec>>;
std::vector<Event> robot_events(const RobotSpecs& before, const RobotSpecs& after);

}  // namespace skylight::service
