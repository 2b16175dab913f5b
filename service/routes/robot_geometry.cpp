// A robot's own geometry, found out while it runs: what the tracker observes of it from the request on is in
// its history, so collecting costs nothing, and every answer is computed from what is there.
#include "service/robot_geometry.hpp"

#include <algorithm>
#include <map>

#include "service/routes/context.hpp"

namespace skylight::service {

namespace {

/// What a request says that it knows.
struct KnowledgeBody {
  std::optional<calibration::KnownLength> distance{};
  std::optional<calibration::KnownLength> radius{};
  bool holonomic = false;
};

}  // namespace

}  // namespace skylight::service

namespace skylight::calibration {

void describe(settings::Fields& fields, KnownLength& length) {
  fields.about("A length that was measured, and how well.");
  fields.field("length_m", length.length_m, {.min = 0.1, .max = 1000, .unit = "m", .required = true});
  fields.field("sigma_m", length.sigma_m,
               {.min = 1e-5, .max = 1, .unit = "m", .help = "Standard deviation."});
}

}  // namespace skylight::calibration

namespace skylight::service {
namespace {

void describe(settings::Fields& fields, KnowledgeBody& body) {
  fields.about("What is known of the run beforehand.");
  fields.field("distance", body.distance,
               {.help = "Between the first and the last place of standing or turning."});
  fields.field("radius", body.radius, {.help = "Of the circle that base_link drives."});
  fields.field("holonomic", body.holonomic, {.help = "It can move sideways."});
}

/// What is collected for one robot.
struct Collection {
  Time since{};
  RobotSpec spec;  ///< as it was then
  KnowledgeBody known;
  std::vector<std::shared_ptr<const CameraModel>> cameras;
  std::vector<CameraUncertainty> uncertainty;
};

/// From any of HTTP's threads.
class Desk {
 public:
  void put(const std::string& robot, Collection collection) {
    const std::lock_guard lock(mutex_);
    collections_.insert_or_assign(robot, std::make_shared<const Collection>(std::move(collection)));
  }
  bool drop(const std::string& robot) {
    const std::lock_guard lock(mutex_);
    return collections_.erase(robot) > 0;
  }
  /// Throws a 404 problem where nothing is collected.
  std::shared_ptr<const Collection> of(const std::string& robot) const {
    const std::lock_guard lock(mutex_);
    const auto at = collections_.find(robot);
    if (at != collections_.end()) return at->second;
    throw http::Problem(
        404, "Nothing is collected",
        "nothing is collected for the geometry of robot '" + robot + "': POST there to begin");
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const Collection>> collections_;
};

Json known_json(const KnowledgeBody& known) {
  const auto length = [](const std::optional<calibration::KnownLength>& known_length) {
    return known_length ? Json{{"length_m", known_length->length_m}, {"sigma_m", known_length->sigma_m}}
                        : Json(nullptr);
  };
  return {
      {"distance", length(known.distance)}, {"radius", length(known.radius)}, {"holonomic", known.holonomic}};
}

// Why what was collected does not hold any more; empty where it does.
std::string outdated(const Collection& collection, const Snapshot& snapshot, const RobotSnapshot& robot) {
  if (!same_geometry(collection.spec, *robot.spec))
    return "the robot's geometry or picture was changed meanwhile";
  const auto same = [](const auto& model, const CameraSnapshot& camera) { return model == camera.model; };
  if (!std::equal(collection.cameras.begin(), collection.cameras.end(), snapshot.cameras.begin(),
                  snapshot.cameras.end(), same))
    return "the cameras were changed meanwhile";
  return {};
}

GeometryRun run_of(const Collection& collection, const RobotSnapshot& robot) {
  std::vector<CameraModel> models;
  for (const auto& model : collection.cameras) models.push_back(*model);
  GeometryRun run(*robot.spec, models, collection.uncertainty,
                  {.distance = collection.known.distance,
                   .radius = collection.known.radius,
                   .holonomic = collection.known.holonomic});
  const HistoryView& history = robot.view.history;
  const HistoryRange range = history.range(collection.since, Time::max());
  for (std::size_t i = range.first; i < range.last; ++i) {
    if (history[i].measured) run.add(*history[i].measured);
  }
  return run;
}

Json progress_json(const Collection& collection, const Snapshot& snapshot, const RobotSnapshot& robot) {
  const std::string why = outdated(collection, snapshot, robot);
  Json out{{"robot", robot.view.id},
           {"state", why.empty() ? "collecting" : "outdated"},
           {"reason", why.empty() ? Json(nullptr) : Json(why)},
           {"since", unix_seconds(collection.since)},
           {"known", known_json(collection.known)},
           {"result", nullptr}};
  if (!why.empty()) return out;
  const GeometryRun run = run_of(collection, robot);
  std::vector<std::string> ids;
  for (const CameraSnapshot& camera : snapshot.cameras) ids.push_back(camera.id);
  out["result"] = to_json(*robot.spec, run.fit(), run.run(), ids);
  return out;
}

http::Reply begin(const http::Request& request, const RouteContext& context, Desk& desk) {
  check_query(request, {});
  const auto told = read_body<KnowledgeBody>(body_document(request));
  Collection collection{.since = {}, .spec = {}, .known = told, .cameras = {}, .uncertainty = {}};
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& robot = robot_of(request, *snapshot);
  collection.since = snapshot->captured;
  collection.spec = *robot.spec;
  for (const CameraSnapshot& camera : snapshot->cameras) {
    collection.cameras.push_back(camera.model);
    collection.uncertainty.push_back(uncertainty_of(camera.calibration->document));
  }
  const bool known =
      std::any_of(collection.uncertainty.begin(), collection.uncertainty.end(),
                  [](const CameraUncertainty& camera) { return !camera.covariance.isZero(0.0); });
  if (!known) collection.uncertainty.clear();
  const Json body = progress_json(collection, *snapshot, robot);
  desk.put(robot.view.id, std::move(collection));
  http::Reply reply = json_reply(body, 201);
  reply.headers.emplace_back("Location", "/api/v1/robots/" + robot.view.id + "/geometry");
  return reply;
}

// The tape is at hand only when the robot has come to where it is measured to.
http::Reply tell(const http::Request& request, const RouteContext& context, Desk& desk) {
  check_query(request, {});
  const auto known = read_body<KnowledgeBody>(body_document(request));
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& robot = robot_of(request, *snapshot);
  Collection collection = *desk.of(robot.view.id);
  collection.known = known;
  const Json body = progress_json(collection, *snapshot, robot);
  desk.put(robot.view.id, std::move(collection));
  return json_reply(body);
}

http::Reply progress(const http::Request& request, const RouteContext& context, Desk& desk) {
  check_query(request, {});
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& robot = robot_of(request, *snapshot);
  return json_reply(progress_json(*desk.of(robot.view.id), *snapshot, robot));
}

// What is determined is changed; looks so far are of the old geometry, so the collection ends.
http::Reply apply(const http::Request& request, const RouteContext& context, Desk& desk) {
  check_query(request, {});
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& robot = robot_of(request, *snapshot);
  const auto collection = desk.of(robot.view.id);
  if (const std::string why = outdated(*collection, *snapshot, robot); !why.empty())
    throw http::Problem(409, "The collection is outdated", why + ": begin again");
  const calibration::RobotFit fit = run_of(*collection, robot).fit();
  const bool anything = fit.surface_height_m.value || fit.mounting_x_m.value || fit.mounting_y_m.value ||
                        fit.mounting_yaw.value;
  if (!anything)
    throw http::Problem(
        409, "Nothing is determined yet",
        "height: " + fit.surface_height_m.missing + "; reference point: " + fit.mounting_x_m.missing);
  bool changed_first = true;  // by somebody else, since the snapshot
  change_tracker(context, [&](Tracker& tracker) {
    for (const RobotSpec& now : tracker.robots()) {
      if (now.id != robot.view.id || !same_geometry(now, collection->spec)) continue;
      changed_first = false;
      tracker.change(with_geometry(now, fit));
    }
  });
  if (changed_first)
    throw http::Problem(409, "The collection is outdated",
                        "the robot was changed or removed meanwhile: begin again");
  desk.drop(robot.view.id);
  const auto shown = context.pipeline.snapshot();
  const RobotSnapshot& changed = robot_of(request, *shown);
  const QueryContext present{.now = context.pipeline.now(), .horizon = context.horizon};
  return json_reply(to_json(changed, answer(*shown, changed, {}, present)));
}

http::Reply cancel(const http::Request& request, const RouteContext& context, Desk& desk) {
  check_query(request, {});
  const auto snapshot = context.pipeline.snapshot();
  const std::string& id = robot_of(request, *snapshot).view.id;
  desk.of(id);
  desk.drop(id);
  return {.status = 204, .content_type = ""};
}

}  // namespace

void add_geometry_routes(http::Router& router, const RouteContext& context) {
  const auto desk = std::make_shared<Desk>();
  const auto bound = [&context, desk](auto handler) {
    return
        [&context, desk, handler](const http::Request& request) { return handler(request, context, *desk); };
  };
  router.add("POST", "/api/v1/robots/{id}/geometry", bound(begin), http::Lane::slow);
  router.add("GET", "/api/v1/robots/{id}/geometry", bound(progress), http::Lane::slow);
  router.add("PUT", "/api/v1/robots/{id}/geometry", bound(tell), http::Lane::slow);
  router.add("DELETE", "/api/v1/robots/{id}/geometry", bound(cancel));
  router.add("POST", "/api/v1/robots/{id}/geometry/apply", bound(apply), http::Lane::slow);
}

}  // namespace skylight::service
