#include "service/wire.hpp"

#include <cmath>

#include "service/config.hpp"
#include "settings/fields.hpp"

namespace skylight::service {
namespace {

// JSON has no NaN; where a number is not finite there is none.
Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json covariance_json(const Covariance3& covariance) {
  Json out = Json::array();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.push_back(number(covariance(i, j)));
  }
  return out;
}

Json pose_json(const PublishedPose& pose, const PoseAnswer& answer, Time now) {
  const Estimate& e = pose.estimate;
  return {{"frame", "map"},
          {"kind", to_string(pose.kind)},
          {"at", unix_seconds(e.at)},
          {"captured", unix_seconds(pose.captured)},
          {"x", number(e.pose.x)},
          {"y", number(e.pose.y)},
          {"yaw", number(e.pose.yaw)},
          {"heading_turns", pose.heading_turns},
          {"covariance", covariance_json(e.covariance)},
          {"velocity", pose.kind == PoseKind::measured ? Json(nullptr)
                                                       : Json{{"x", number(e.velocity.x)},
                                                              {"y", number(e.velocity.y)},
                                                              {"yaw_rate", number(e.velocity.yaw_rate)}}},
          {"age", to_seconds(now - pose.captured)},
          {"horizon", to_seconds(pose.horizon)},
          {"source", to_string(pose.source)},
          {"score", number(pose.score)},
          {"cameras", pose.cameras},
          {"warnings", pose.warnings},
          {"identity_confidence", number(answer.identity_confidence)}};
}

Json height_json(const SurfaceHeight& height) {
  if (height.looks() == 0) return nullptr;
  return {{"height_m", number(height.height_m())},
          {"sigma_m", number(height.sigma_m())},
          {"frames", height.looks()}};
}

}  // namespace

std::string_view to_string(SourceState state) {
  switch (state) {
    case SourceState::starting:
      return "starting";
    case SourceState::running:
      return "running";
    case SourceState::ended:
      return "ended";
    case SourceState::failed:
      return "failed";
  }
  return "unknown";
}

Json to_json(const PoseAnswer& answer, Time now) {
  return {{"robot", answer.robot},
          {"state", skylight::to_string(answer.state)},
          {"reason", answer.reason.empty() ? Json(nullptr) : Json(answer.reason)},
          {"last_seen", answer.last_seen ? Json(unix_seconds(*answer.last_seen)) : Json(nullptr)},
          {"published", unix_seconds(now)},
          {"pose", answer.pose ? pose_json(*answer.pose, answer, now) : Json(nullptr)}};
}

Json to_json(const RobotSnapshot& robot, const PoseAnswer& now) {
  const RobotSpec& spec = *robot.spec;
  const Eigen::Vector2d size = seen_size_m(spec);
  Json out = Json::parse(settings::write(robot_config(spec)));
  out["status"] = {{"state", skylight::to_string(now.state)},
                   {"reason", now.reason.empty() ? Json(nullptr) : Json(now.reason)},
                   {"last_seen", now.last_seen ? Json(unix_seconds(*now.last_seen)) : Json(nullptr)},
                   {"size_m", {size.x(), size.y()}},
                   {"heading_turns", spec.appearance ? spec.appearance->heading_turns() : 1},
                   {"copies", robot.copies},
                   {"measured_height", height_json(robot.view.measured_height)}};
  return out;
}

Json to_json(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return {{"position_m", {pose.translation().x(), pose.translation().y(), pose.translation().z()}},
          {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

Json to_json(const FeedStatus& feed) {
  const auto seconds = [](const std::optional<Duration>& d) {
    return d ? Json(to_seconds(*d)) : Json(nullptr);
  };
  return {{"type", feed.kind},
          {"state", to_string(feed.state)},
          {"since", unix_seconds(feed.since)},
          {"reason", feed.reason.empty() ? Json(nullptr) : Json(feed.reason)},
          {"reconnects", feed.reconnects},
          {"received", feed.received},
          {"lost", feed.lost},
          {"unreadable", feed.unreadable},
          {"repeats", feed.repeats},
          {"undated", feed.undated},
          {"frame_rate_hz", number(feed.frame_rate_hz)},
          {"delay_s", seconds(feed.delay)},
          {"clock_offset_s", seconds(feed.clock_offset)}};
}

Json to_json(const CameraWatchReport& hold) {
  const bool known = hold.hold != CameraHold::learning;
  return {{"state", to_string(hold.hold)},
          {"since", known ? Json(unix_seconds(hold.since)) : Json(nullptr)},
          {"features", hold.features},
          {"agree", hold.agree},
          {"shift_px", number(hold.shift_px)}};
}

Json to_json(const Intrinsics& in) {
  return {{"width_px", in.width_px},
          {"height_px", in.height_px},
          {"fx_px", in.fx_px},
          {"fy_px", in.fy_px},
          {"cx_px", in.cx_px},
          {"cy_px", in.cy_px},
          {"lens", in.lens == LensModel::brown_conrady ? "brown_conrady" : "kannala_brandt"},
          {"distortion", in.distortion}};
}

// With the other cameras.
Json agreement_json(const CameraSnapshot& camera) {
  if (!camera.agreement) return nullptr;
  return {{"state", camera.disagrees ? "disagrees" : "agrees"},
          {"off_m", number(camera.agreement->off_m)},
          {"sigmas", number(camera.agreement->sigmas)},
          {"robots", camera.agreement->robots},
          {"refused", camera.agreement->refused}};
}

Json to_json(const FloorFit& floor) {
  return {{"known", floor.known},
          {"share", number(floor.share)},
          {"offset_m", number(floor.offset_m)},
          {"tilt_rad", number(floor.tilt_rad)},
          {"bend_m", number(floor.bend_m)},
          {"noise_m", number(floor.noise_m)},
          {"uneven_m", number(floor.uneven_m)}};
}

Json to_json(const CameraSnapshot& camera) {
  const bool seen = camera.frames > 0;
  return {{"id", camera.id},
          {"intrinsics", to_json(camera.model->intrinsics())},
          {"map_from_camera", to_json(camera.model->map_from_camera())},
          {"captured", seen ? Json(unix_seconds(camera.captured)) : Json(nullptr)},
          {"frames", camera.frames},
          {"dropped", camera.dropped},
          {"bad_frames", camera.bad_frames},
          {"frame_rate_hz", number(camera.frame_rate_hz)},
          {"source", camera.feed ? to_json(*camera.feed) : Json(nullptr)},
          {"agreement", agreement_json(camera)},
          {"hold", camera.hold ? to_json(*camera.hold) : Json(nullptr)},
          {"depth", camera.depth ? to_json(*camera.depth) : Json(nullptr)}};
}

Json to_json(const Event& event) {
  const auto id = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  return {{"sequence", event.sequence}, {"time", unix_seconds(event.at)},
          {"kind", event.kind},         {"severity", to_string(event.severity)},
          {"camera", id(event.camera)}, {"robot", id(event.robot)},
          {"message", event.message},   {"data", event.data}};
}

}  // namespace skylight::service
