#include "service/routes/context.hpp"

namespace skylight::service {

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
    if (!ready) return http::problem(503, "Not ready", reason);
    return json_reply({{"status", "ready"}, {"age", age}, {"tracker_ms", snapshot->tracker_ms}});
  });
}

}  // namespace skylight::service
