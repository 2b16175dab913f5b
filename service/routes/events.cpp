#include "service/routes/context.hpp"

namespace skylight::service {
namespace {

constexpr std::int64_t kLastSequence =
    1'000'000'000'000'000;  // a double, as JSON's readers have it, is exact

EventQuery query_of(const http::Request& request) {
  const auto id = [&](const std::string& name) {
    return query_text(request, name, "[A-Za-z0-9_-]{1,64}", "an id: 1 to 64 letters, digits, _ and -")
        .value_or("");
  };
  EventQuery query;
  if (const auto since = query_whole(request, "since", 0, kLastSequence))
    query.since = static_cast<std::uint64_t>(*since);
  query.limit = static_cast<std::size_t>(query_whole(request, "limit", 1, 1000).value_or(100));
  query.kind =
      query_text(request, "kind", "[a-z_.]{1,64}", "1 to 64 lower-case letters, _ and .").value_or("");
  query.camera = id("camera");
  query.robot = id("robot");
  const auto least = query_text(request, "severity", "info|warning|error", "info, warning, error");
  query.least = severity_from_string(least.value_or("info")).value();
  return query;
}

}  // namespace

void add_event_routes(http::Router& router, const RouteContext& context) {
  router.add("GET", "/api/v1/events", [&context](const http::Request& request) {
    check_query(request, {"since", "limit", "kind", "camera", "robot", "severity"});
    const EventPage page = context.pipeline.events().read(query_of(request));
    Json items = Json::array();
    for (const auto& event : page.items) items.push_back(to_json(*event));
    return json_reply({{"items", std::move(items)},
                       {"next", page.next},
                       {"oldest", page.oldest > 0 ? Json(page.oldest) : Json(nullptr)},
                       {"dropped", page.dropped}});
  });
}

}  // namespace skylight::service
