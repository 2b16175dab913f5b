// What the routes stand on. One file per resource; each adds its routes to the router.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "service/assembly.hpp"
#include "service/http/router.hpp"
#include "service/pipeline.hpp"
#include "service/wire.hpp"
#include "settings/fields.hpp"

namespace skylight::service {

class CalibrationDesk;
class IntrinsicsGuide;
class SimulatorDesk;

/// The appearances that robots may take, shared between the routes.
class AppearanceStore {
 public:
  explicit AppearanceStore(Appearances appearances) : appearances_(std::move(appearances)) {}

  Appearances all() const;
  std::shared_ptr<const Appearance> find(const std::string& id) const;  ///< null where there is none
  /// False where the id is taken.
  bool add(std::shared_ptr<const Appearance> appearance);
  /// With those of another scenario.
  void replace(Appearances appearances);

 private:
  mutable std::mutex mutex_;
  Appearances appearances_;
};

/// Lives as long as the server; handlers hold a reference.
struct RouteContext {
  Pipeline& pipeline;
  AppearanceStore& appearances;
  MethodConfig default_method;  ///< for robots that are added without saying how they are detected
  Duration horizon = std::chrono::seconds(2);
  SimulatorDesk* simulator = nullptr;      ///< null: as where the source is no simulator
  PostedCameras posted = {};               ///< cameras whose frames come over HTTP
  CalibrationDesk* calibration = nullptr;  ///< both are there for add_calibration_routes()
  IntrinsicsGuide* guide = nullptr;
  FloorConfig floor = {};
};

void add_health_routes(http::Router& router, const RouteContext& context);
void add_robot_routes(http::Router& router, const RouteContext& context);
void add_pose_routes(http::Router& router, const RouteContext& context);
void add_appearance_routes(http::Router& router, const RouteContext& context);
void add_camera_routes(http::Router& router, const RouteContext& context);
void add_calibration_routes(http::Router& router, const RouteContext& context);
void add_intrinsics_routes(http::Router& router, const RouteContext& context);
void add_extrinsics_routes(http::Router& router, const RouteContext& context);
void add_floor_routes(http::Router& router, const RouteContext& context);
void add_frame_routes(http::Router& router, const RouteContext& context);
void add_event_routes(http::Router& router, const RouteContext& context);
void add_odometry_routes(http::Router& router, const RouteContext& context);
void add_geometry_routes(http::Router& router, const RouteContext& context);
void add_simulator_routes(http::Router& router, const RouteContext& context);

// What several of them need. Those that read a request throw http::Problem with the parameter's name, its
// value and what is allowed.

http::Reply json_reply(const Json& body, int status = 200);

/// A finite number from the query; none where the parameter is absent.
std::optional<double> query_number(const http::Request& request, const std::string& name);
/// A whole number from `min` to `max`; none where the parameter is absent.
std::optional<std::int64_t> query_whole(const http::Request& request, const std::string& name,
                                        std::int64_t min, std::int64_t max);
/// A text that is wholly of `pattern` (a regular expression; `allowed` says it in words); none where the
/// parameter is absent.
std::optional<std::string> query_text(const http::Request& request, const std::string& name,
                                      const std::string& pattern, const std::string& allowed);
/// Unix seconds, within the years 1970 to 2200.
std::optional<Time> query_time(const http::Request& request, const std::string& name);
/// The same, or `now`.
struct AskedInstant {
  bool now = false;
  std::optional<Time> at{};  ///< none where it is `now`, or absent
};
AskedInstant query_instant(const http::Request& request, const std::string& name);
std::optional<PoseKind> query_kind(const http::Request& request);
/// Refuses parameters that a route does not know: a typo must not pass for a default.
void check_query(const http::Request& request, std::initializer_list<std::string_view> known);

/// The robot of the path's {id}; throws a 404 problem.
const RobotSnapshot& robot_of(const http::Request& request, const Snapshot& snapshot);

/// The camera of the path's {id}; throws a 404 problem.
const CameraSnapshot& camera_of(const http::Request& request, const Snapshot& snapshot);

/// Runs what changes calibrations; what it throws (service/calibration/desk.hpp) becomes a problem: 404,
/// `changed` (412 or 409), 422, or a 500 where a file cannot be written.
void change_calibration(const std::function<void()>& change, int changed = 409);

/// One page of a list: `limit` (1 to 1000, default 100) and `offset`; the body is {items, total, limit,
/// offset}.
Json page_of(const http::Request& request, const std::vector<Json>& items);

/// The body as a document; throws a 400 problem where it is no JSON. Errors found in it later are 422.
settings::Document body_document(const http::Request& request);
[[noreturn]] void refuse_body(const settings::Error& error);

/// The body as T, by its description; throws a 400 problem (no JSON) or 422 (key, value, allowed range).
template <class T>
T read_body(const settings::Document& document) {
  try {
    return settings::read<T>(document);
  } catch (const settings::Error& error) {
    refuse_body(error);
  }
}

/// Runs a change on the tracker; what it refuses (std::invalid_argument) becomes a 422 problem.
void change_tracker(const RouteContext& context, const std::function<void(Tracker&)>& change);

}  // namespace skylight::service
