#include "service/routes/context.hpp"

namespace skylight::service {
namespace {

// The live cameras that give no new frames, and why, for people.
std::vector<std::string> silent_cameras(const Snapshot& snapshot) {
  std::vector<std::string> out;
  for (const CameraSnapshot& camera : snapshot.cameras) {
    if (!camera.feed || camera.feed->state == FeedState::running) continue;
    const std::string& reason = camera.feed->reason;
    out.push_back("camera " + camera.id + " is " + std::string(to_string(camera.feed->state)) +
                  (reason.empty() ? "" : ": " + reason));
  }
  return out;
}

}  // namespace

// Live: the process answers. Ready: frames come and are tracked.
void add_health_routes(http::Router& router, const RouteContext& context) {
  router.add("GET", "/livez", [](const http::Request& request) {
    check_query(request, {});
    return json_reply({{"status", "live"}});
  });
  router.add("GET", "/readyz", [&context](const http::Request& request) {
    check_query(request, {});
    const auto snapshot = context.pipeline.snapshot();
    const double age = to_seconds(context.pipeline.now() - snapshot->captured);
    const bool seen = snapshot->captured != Time{};
    const bool fresh = seen && age <= to_seconds(context.horizon);
    const bool ready = snapshot->source == SourceState::running && fresh;
    std::string reason;
    if (snapshot->source != SourceState::running)
      reason = "the source is " + std::string(to_string(snapshot->source));
    if (!snapshot->source_error.empty()) reason += ": " + snapshot->source_error;
    if (reason.empty() && !ready)
      reason = seen ? "no frame for " + std::to_string(age) + " s" : "no frame yet";
    const auto silent = silent_cameras(*snapshot);
    if (!ready) {
      for (std::size_t i = 0; i < silent.size(); ++i) reason += (i == 0 ? ": " : "; ") + silent[i];
      return http::problem(503, "Not ready", reason);
    }
    return json_reply(
        {{"status", "ready"}, {"age", age}, {"tracker_ms", snapshot->tracker_ms}, {"degraded", silent}});
  });
}

}  // namespace skylight::service
