#include "service/camera_doubt.hpp"

#include <algorithm>

#include "service/event_kinds.hpp"

namespace skylight::service {
namespace {

/// A camera that was turned by so much more than was allowed for was bumped again.
constexpr double kFurther = 1.1;
constexpr std::size_t kMostSpans = 100;

CameraUncertainty doubted(const CameraSnapshot& camera, double turned) {
  CameraUncertainty out = uncertainty_of(camera.calibration->document);
  out.covariance.diagonal().segment<3>(kCameraRotation).array() += turned * turned;
  return out;
}

}  // namespace

std::optional<Event> take_hold(const CameraWatchReport& hold, std::size_t index, CameraSnapshot& camera,
                               Tracker& tracker) {
  const CameraHold before = camera.hold ? camera.hold->hold : CameraHold::learning;
  camera.hold = hold;
  if (hold.hold == CameraHold::moved) {
    const double turned = turned_rad(hold, camera.model->intrinsics());
    if (turned > kFurther * camera.doubt_rad) {
      tracker.recalibrate(index, *camera.model, doubted(camera, turned));
      if (camera.doubt_rad == 0.0) {
        if (camera.moved.size() == kMostSpans) camera.moved.erase(camera.moved.begin());
        camera.moved.push_back({.from = hold.since});
      }
      camera.doubt_rad = turned;
    }
  } else if (hold.hold == CameraHold::steady && camera.doubt_rad > 0.0) {
    tracker.recalibrate(index, *camera.model, doubted(camera, 0.0));
    end_doubt(camera);
  }
  return hold.hold == before ? std::nullopt : hold_event(camera, before);
}

void end_doubt(CameraSnapshot& camera) {
  if (camera.doubt_rad > 0.0) camera.moved.back().until = camera.captured;
  camera.doubt_rad = 0.0;
}

std::string warning_of(const CameraSnapshot& camera, Time captured) {
  const bool moved = std::any_of(camera.moved.begin(), camera.moved.end(), [&](const MovedSpan& span) {
    return span.from <= captured && captured <= span.until;
  });
  return moved ? "camera " + camera.id + " was moved" : "";
}

}  // namespace skylight::service
