#include "service/event_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "service/config.hpp"
#include "service/wire.hpp"
#include "settings/fields.hpp"

namespace skylight::service {
namespace {

Json state_json(std::string_view state, const std::string& reason) {
  return {{"state", state}, {"reason", reason.empty() ? Json(nullptr) : Json(reason)}};
}

std::string because(const std::string& reason) {
  return reason.empty() ? reason : ": " + reason;
}

Event robot_event(const char* what, const std::string& robot) {
  return {.kind = std::string("robot.") + what, .robot = robot, .message = "robot " + robot + " was " + what};
}

// What a robot is told to be like, to tell whether that has changed.
std::string settings_of(const RobotSpec& spec) {
  return settings::write(robot_config(spec));
}

const RobotSpec* find(const RobotSpecs& specs, const std::string& id) {
  const auto at = std::find_if(specs.begin(), specs.end(), [&](const auto& spec) { return spec->id == id; });
  return at == specs.end() ? nullptr : at->get();
}

}  // namespace

Event source_event(SourceState state, const std::string& reason) {
  return {.kind = "source.state",
          .severity = state == SourceState::failed ? Severity::error : Severity::info,
          .message = "the source is " + std::string(to_string(state)) + because(reason),
          .data = state_json(to_string(state), reason)};
}

Event feed_event(const std::string& camera, const FeedStatus& feed) {
  const bool well = feed.state == FeedState::running || feed.state == FeedState::connecting;
  return {.kind = "camera.state",
          .severity = well ? Severity::info : Severity::warning,
          .camera = camera,
          .message = "camera " + camera + " is " + std::string(to_string(feed.state)) + because(feed.reason),
          .data = state_json(to_string(feed.state), feed.reason)};
}

double turned_rad(const CameraWatchReport& hold, const Intrinsics& intrinsics) {
  return std::hypot(hold.shift_px / std::sqrt(intrinsics.fx_px * intrinsics.fy_px), hold.turn_rad);
}

std::optional<Event> hold_event(const CameraSnapshot& camera, CameraHold before) {
  const CameraWatchReport& hold = *camera.hold;
  const std::string name = "camera " + camera.id;
  const auto event = [&](const char* kind, Severity severity, const std::string& message) {
    return Event{.kind = kind,
                 .severity = severity,
                 .camera = camera.id,
                 .message = name + message,
                 .data = {{"since", unix_seconds(hold.since)}}};
  };
  if (hold.hold == CameraHold::blind)
    return event("camera.blind", Severity::warning,
                 " sees too little of the floor to tell whether it was moved");
  if (hold.hold == CameraHold::steady && before != CameraHold::learning)
    return event("camera.back", Severity::info, " sees the floor where it was");
  if (hold.hold != CameraHold::moved) return std::nullopt;
  const double degrees = turned_rad(hold, camera.model->intrinsics()) * 180.0 / std::numbers::pi;
  char size[96];
  std::snprintf(size, sizeof size, " was moved: the floor is %.1f px from where it was, about %.2f degrees",
                hold.shift_px, degrees);
  Event out = event("camera.moved", Severity::warning, size);
  out.data["shift_px"] = hold.shift_px;
  out.data["degrees"] = degrees;
  return out;
}

Event calibration_event(const CameraSnapshot& camera, const CameraModel& before) {
  const Eigen::Isometry3d moved = before.map_from_camera().inverse() * camera.model->map_from_camera();
  const double shift_mm = 1e3 * moved.translation().norm();
  const double turn_deg = Eigen::AngleAxisd(moved.linear()).angle() * 180.0 / std::numbers::pi;
  char words[96];
  std::snprintf(words, sizeof words, " has a new calibration: %.1f mm and %.2f degrees from the one before",
                shift_mm, turn_deg);
  return {.kind = "calibration.changed",
          .severity = Severity::info,
          .camera = camera.id,
          .message = "camera " + camera.id + words,
          .data = {{"shift_mm", shift_mm}, {"turn_deg", turn_deg}}};
}

Event agreement_event(const std::string& camera, const AgreementChange& change) {
  const CameraAgreement& state = change.state;
  char message[160];
  std::snprintf(message, sizeof message,
                change.disagrees ? " sees a robot %.1f mm from where the others see it, %.1f sigma%s"
                                 : " sees robots where the others do (%.1f mm, %.1f sigma)%s",
                state.off_m * 1e3, state.sigmas,
                change.disagrees && state.refused ? ": it is not believed" : "");
  return {.kind = change.disagrees ? "cameras.disagree" : "cameras.agree",
          .severity = change.disagrees ? Severity::warning : Severity::info,
          .camera = camera,
          .message = "camera " + camera + message,
          .data = {{"off_m", state.off_m},
                   {"sigmas", state.sigmas},
                   {"robots", state.robots},
                   {"refused", state.refused}}};
}

std::vector<Event> robot_events(const RobotSpecs& before, const RobotSpecs& after) {
  std::vector<Event> out;
  for (const auto& was : before) {
    if (find(after, was->id) == nullptr) out.push_back(robot_event("removed", was->id));
  }
  for (const auto& is : after) {
    const RobotSpec* was = find(before, is->id);
    if (was == nullptr) {
      out.push_back(robot_event("added", is->id));
    } else if (was->appearance != is->appearance || settings_of(*was) != settings_of(*is)) {
      out.push_back(robot_event("changed", is->id));
    }
  }
  return out;
}

}  // namespace skylight::service
