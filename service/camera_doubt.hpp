// What follows where a camera hangs elsewhere than it was calibrated: until it is seen back in its place or
// is calibrated again, what it tells counts as so much less certain, and says why.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "service/event_log.hpp"
#include "service/snapshot.hpp"

namespace skylight::service {

/// Takes the newest report of the watch over a camera, after its newest frame: tells the tracker (as an error
/// of the camera's rotation, one standard deviation the whole of what it was turned, added to what its
/// calibration leaves unknown) and the snapshot. The event, where there is one.
std::optional<Event> take_hold(const CameraWatchReport& hold, std::size_t index, CameraSnapshot& camera,
                               Tracker& tracker);

/// After a new calibration: poses of frames up to the camera's newest stay marked, later ones are not.
void end_doubt(CameraSnapshot& camera);

/// What is to be said of a pose that a camera's frame of that instant went into; empty: nothing.
std::string warning_of(const CameraSnapshot& camera, Time captured);

}  // namespace skylight::service
