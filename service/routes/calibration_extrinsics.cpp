// Where cameras hang, from what lies on the floor before them.
#include <numbers>

#include "service/calibration/desk.hpp"
#include "service/calibration/documents.hpp"
#include "service/calibration/map_frame.hpp"
#include "service/calibration/sheets.hpp"
#include "service/routes/context.hpp"

namespace skylight::service {

/// Bodies of requests.
struct ClickedPoint {
  std::string name;
  std::optional<std::string> camera;  ///< that sees it
  double u_px = 0.0;
  double v_px = 0.0;
  double x_m = 0.0;
  double y_m = 0.0;
  double z_m = 0.0;  ///< above the floor
};

/// Two pixels of one camera: what is seen at the first becomes the map's origin, the second lies on its x
/// axis.
struct ClickedAxis {
  std::array<double, 2> origin_px{};
  std::array<double, 2> x_axis_px{};
};

struct FloorBody {
  FloorDescription floor;
  std::vector<ClickedPoint> points;
  double point_sigma_m = 0.0;
  double click_sigma_px = 1.0;
  bool apply = true;
};

struct ExtrinsicsBody {
  FloorBody seen;
  std::optional<double> height_m;
  double height_sigma_m = 0.01;
  std::optional<ClickedAxis> map;
};

struct JointBody {
  std::vector<std::string> cameras;
  FloorBody seen;
};

void describe(settings::Fields& fields, ClickedPoint& point) {
  fields.about("A point at a known place, and where the camera sees it.");
  fields.field("name", point.name, {.max_length = 100, .help = "For people."});
  fields.field("camera", point.camera,
               {.min_length = 1, .max_length = 64, .help = "That sees it; needed where there are several."});
  fields.field("u_px", point.u_px,
               {.min = -0.5, .max = Intrinsics::kLargestSide, .unit = "px", .required = true});
  fields.field("v_px", point.v_px,
               {.min = -0.5, .max = Intrinsics::kLargestSide, .unit = "px", .required = true});
  fields.field("x_m", point.x_m, {.min = -1e4, .max = 1e4, .unit = "m", .required = true});
  fields.field("y_m", point.y_m, {.min = -1e4, .max = 1e4, .unit = "m", .required = true});
  fields.field("z_m", point.z_m, {.min = -100, .max = 100, .unit = "m", .help = "Above the floor."});
}

void describe(settings::Fields& fields, ClickedAxis& axis) {
  fields.about("Another origin and other axes for the map: all cameras are moved together.");
  fields.field("origin_px", axis.origin_px,
               {.min = -0.5,
                .max = Intrinsics::kLargestSide,
                .unit = "px",
                .required = true,
                .help = "What is seen here is the origin."});
  fields.field("x_axis_px", axis.x_axis_px,
               {.min = -0.5,
                .max = Intrinsics::kLargestSide,
                .unit = "px",
                .required = true,
                .help = "What is seen here lies on the x axis, beyond the origin."});
}

void describe(settings::Fields& fields, FloorBody& body) {
  fields.field("tags", body.floor.tags, {.max_items = 1000, .help = "Each lies for itself."});
  fields.field("place_sigma_m", body.floor.place_sigma_m,
               {.min = 0, .max = 1, .unit = "m", .help = "How well the places of those tags were measured."});
  fields.field("sheets", body.floor.sheets,
               {.max_items = 100, .help = "Tags and boards that lie as one piece."});
  fields.field("points", body.points, {.max_items = 10000, .help = "Clicked points."});
  fields.field("point_sigma_m", body.point_sigma_m,
               {.min = 0, .max = 1, .unit = "m", .help = "How well the places of points were measured."});
  fields.field("click_sigma_px", body.click_sigma_px,
               {.min = 0.01, .max = 100, .unit = "px", .help = "How well points were clicked."});
  fields.field("apply", body.apply, {.help = "false: only say what would change."});
}

void describe(settings::Fields& fields, ExtrinsicsBody& body) {
  fields.about("What lies on the floor before one camera.");
  describe(fields, body.seen);
  fields.field(
      "height_m", body.height_m,
      {.min = 0.05, .max = 1000, .unit = "m", .help = "Of the lens above the floor, where it was measured."});
  fields.field("height_sigma_m", body.height_sigma_m,
               {.min = 1e-4, .max = 10, .unit = "m", .help = "How well."});
  fields.field("map", body.map, {.help = "Instead of everything else: the map is given other axes."});
  const bool floor =
      !body.seen.floor.tags.empty() || !body.seen.floor.sheets.empty() || !body.seen.points.empty();
  fields.check(!(body.map && floor), "map", "stands alone, without tags, sheets and points");
  fields.check(body.map || floor, "",
               "nothing is named that lies on the floor: tags, sheets, points, or map");
}

void describe(settings::Fields& fields, JointBody& body) {
  fields.about("What lies on the floor before several cameras, which are calibrated together.");
  fields.field("cameras", body.cameras,
               {.min_items = 1, .max_items = 64, .required = true, .help = "Their ids."});
  describe(fields, body.seen);
}

namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

using calibration::CameraResult;
using calibration::SeeingCamera;

/// The cameras of a request, and what each begins from.
struct Begun {
  std::shared_ptr<const Snapshot> snapshot;
  std::vector<const CameraSnapshot*> cameras;
  std::vector<CalibrationFile> documents;
  std::vector<std::string> notes;
};

Begun begin(const RouteContext& context, const std::vector<std::string>& ids) {
  Begun begun{.snapshot = context.pipeline.snapshot()};
  for (const std::string& id : ids) {
    const CameraSnapshot* camera = begun.snapshot->camera(id);
    if (camera == nullptr)
      throw http::Problem(422, "The body is refused", "body: cameras: there is no camera '" + id + "'");
    if (std::find(begun.cameras.begin(), begun.cameras.end(), camera) != begun.cameras.end())
      throw http::Problem(422, "The body is refused", "body: cameras: '" + id + "' is named twice");
    const CalibrationFile& now = camera->calibration->document;
    std::vector<NumberedCalibration> earlier;
    change_calibration([&] { earlier = context.calibration->versions(id); });
    const auto lens = before_extrinsics(now, earlier);
    if (!lens)
      begun.notes.push_back(id +
                            ": its intrinsics were refined by an earlier extrinsics calibration, and no "
                            "version from before is kept: the same points given again count twice");
    begun.documents.push_back(lens.value_or(now));
    begun.documents.back().note = now.note;
    begun.cameras.push_back(camera);
  }
  return begun;
}

void add_points(const FloorBody& body, std::vector<SeeingCamera>& cameras) {
  for (const ClickedPoint& point : body.points) {
    const std::string number = std::to_string(&point - body.points.data());
    const auto at = std::find_if(cameras.begin(), cameras.end(), [&](const SeeingCamera& camera) {
      return point.camera ? camera.name == *point.camera : cameras.size() == 1;
    });
    if (at == cameras.end())
      throw std::invalid_argument("points[" + number + "].camera: " +
                                  (point.camera ? "'" + *point.camera + "' is not among the cameras"
                                                : std::string("is missing: which of the cameras sees it")));
    at->points.push_back({.name = point.name.empty() ? "point " + number : point.name,
                          .at = {point.x_m, point.y_m, point.z_m},
                          .pixel = {point.u_px, point.v_px},
                          .sigma_px = body.click_sigma_px,
                          .sigma_m = body.point_sigma_m});
  }
}

/// What each camera sees: found in its newest frame, and clicked.
std::vector<SeeingCamera> look(const FloorBody& body, Floor& floor, Begun& begun) {
  std::vector<SeeingCamera> cameras;
  const bool pictured = floor.sheets().size() > 1;
  for (std::size_t i = 0; i < begun.cameras.size(); ++i) {
    const CameraSnapshot& camera = *begun.cameras[i];
    const auto covariance = uncertainty_of(begun.documents[i]).covariance;
    SeeingCamera seeing{.name = camera.id, .intrinsics = begun.documents[i].intrinsics};
    seeing.covariance = covariance.topLeftCorner<kCameraPosition, kCameraPosition>();
    if (pictured && camera.image.empty())
      throw http::Problem(503, "No frame yet", "camera '" + camera.id + "' has no frame yet");
    if (pictured) {
      for (std::string& note : floor.look(camera.id, camera.image, seeing))
        begun.notes.push_back(std::move(note));
    }
    cameras.push_back(std::move(seeing));
  }
  add_points(body, cameras);
  return cameras;
}

std::string words_of(const FloorBody& body) {
  std::string words;
  const auto add = [&](const std::string& what) { words += (words.empty() ? "" : "; ") + what; };
  for (const SheetTag& tag : body.floor.tags) add("tag " + tag.family + ":" + std::to_string(tag.id));
  for (const FloorSheet& sheet : body.floor.sheets) add("sheet " + sheet.name);
  if (!body.points.empty()) add(std::to_string(body.points.size()) + " points");
  return words;
}

Json vector_json(const Eigen::Vector2d& v) {
  return v.allFinite() ? Json{v.x(), v.y()} : Json(nullptr);
}

Json finite(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

/// Root mean square over the picture of how far apart the two see the floor, mm; null where they see none.
Json floor_change_mm(const CameraModel& before, const CameraModel& after) {
  constexpr int kSteps = 8;
  const Intrinsics& in = after.intrinsics();
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Pixel pixel((in.width_px - 1.0) * i / kSteps, (in.height_px - 1.0) * j / kSteps);
      const auto was = before.plane_from_pixel(pixel, 0.0);
      const auto is = after.plane_from_pixel(pixel, 0.0);
      if (!was || !is) continue;
      sum += (*is - *was).squaredNorm();
      ++count;
    }
  }
  return count > 0 ? Json(1e3 * std::sqrt(sum / count)) : Json(nullptr);
}

/// A camera's part of the answer, without what the points say.
Json camera_json(const CameraSnapshot& camera, const CalibrationFile& document) {
  const CameraModel model = camera_model(document);
  const Eigen::Isometry3d moved = camera.model->map_from_camera().inverse() * model.map_from_camera();
  return {{"camera", camera.id},
          {"captured", camera.frames > 0 ? Json(unix_seconds(camera.captured)) : Json(nullptr)},
          {"map_from_camera", to_json(model.map_from_camera())},
          {"sigmas",
           {{"position_m", document.sigmas.position_m}, {"rotation_rad", document.sigmas.rotation_rad}}},
          {"change",
           {{"shift_mm", 1e3 * moved.translation().norm()},
            {"turn_deg", kDegPerRad * Eigen::AngleAxisd(moved.linear()).angle()},
            {"floor_mm", floor_change_mm(*camera.model, model)}}},
          {"fit", nullptr},
          {"stored", nullptr},
          {"version", nullptr}};
}

Json fit_json(const CameraResult& result) {
  Json points = Json::array();
  for (const calibration::PointResult& point : result.points)
    points.push_back({{"name", point.name},
                      {"used", point.used},
                      {"why_not", point.why_not.empty() ? Json(nullptr) : Json(point.why_not)},
                      {"residual_px", vector_json(point.residual_px)},
                      {"residual_m", vector_json(point.residual_m)}});
  return {{"rms_px", finite(result.rms_px)},
          {"rms_m", finite(result.rms_m)},
          {"best_floor_sigma_m", finite(result.best_floor_sigma_m)},
          {"worst_floor_sigma_m", finite(result.worst_floor_sigma_m)},
          {"points", std::move(points)}};
}

/// Takes the new documents into use, if that is wanted.
void apply(const RouteContext& context, const Begun& begun, bool wanted, Json& answer) {
  answer["applied"] = wanted;
  if (!wanted) return;
  std::vector<CalibrationChange> changes;
  for (std::size_t i = 0; i < begun.cameras.size(); ++i) {
    const CameraSnapshot& camera = *begun.cameras[i];
    changes.push_back({camera.id, begun.documents[i], tag_of(camera.calibration->document)});
  }
  std::vector<CalibrationKept> kept;
  change_calibration([&] { kept = context.calibration->change(changes); });
  for (std::size_t i = 0; i < kept.size(); ++i) {
    answer["cameras"][i]["stored"] = kept[i].stored;
    answer["cameras"][i]["version"] = kept[i].version;
  }
}

http::Reply calibrate(const RouteContext& context, Begun begun, const FloorBody& body,
                      const ExtrinsicsBody& alone) {
  Json answer{{"cameras", Json::array()}, {"sheets", Json::array()}, {"warnings", Json::array()}};
  change_calibration([&] {
    Floor floor(body.floor);
    std::vector<SeeingCamera> cameras = look(body, floor, begun);
    if (alone.height_m) {
      cameras.front().height_m = alone.height_m;
      cameras.front().height_sigma_m = alone.height_sigma_m;
    }
    const auto result = calibrate_on(floor, std::move(cameras));
    const CalibrationStep step{.made = utc_text(context.pipeline.now()), .from = words_of(body)};
    for (std::size_t i = 0; i < result.cameras.size(); ++i) {
      set_extrinsics(begun.documents[i], result.cameras[i], step);
      Json camera = camera_json(*begun.cameras[i], begun.documents[i]);
      camera["fit"] = fit_json(result.cameras[i]);
      answer["cameras"].push_back(std::move(camera));
    }
    for (std::size_t i = 1; i < result.sheets.size(); ++i)
      answer["sheets"].push_back({{"name", floor.sheets()[i].name},
                                  {"x_m", result.sheets[i].x_m},
                                  {"y_m", result.sheets[i].y_m},
                                  {"yaw_deg", kDegPerRad * result.sheets[i].yaw_rad}});
    begun.notes.insert(begun.notes.end(), result.warnings.begin(), result.warnings.end());
  });
  answer["warnings"] = begun.notes;
  apply(context, begun, body.apply, answer);
  return json_reply(answer);
}

/// The map is given other axes: every camera moves with it, so that nothing changes between them.
http::Reply move_map(const RouteContext& context, std::shared_ptr<const Snapshot> snapshot,
                     const CameraSnapshot& camera, const ExtrinsicsBody& body) {
  const ClickedAxis& axis = body.map.value();
  Begun begun{.snapshot = std::move(snapshot)};
  Json answer{{"cameras", Json::array()}, {"sheets", Json::array()}, {"warnings", Json::array()}};
  change_calibration([&] {
    const auto floor_at = [&](const char* name, const std::array<double, 2>& pixel) {
      const Pixel at(pixel[0], pixel[1]);
      const auto place = camera.model->sees(at) ? camera.model->plane_from_pixel(at, 0.0) : std::nullopt;
      if (!place)
        throw std::invalid_argument(std::string("map.") + name + ": camera '" + camera.id +
                                    "' does not see the floor there");
      return *place;
    };
    const auto frame =
        calibration::frame_of(floor_at("origin_px", axis.origin_px), floor_at("x_axis_px", axis.x_axis_px));
    const Eigen::Isometry3d motion = calibration::new_from_old(frame);
    for (const CameraSnapshot& each : begun.snapshot->cameras) {
      CalibrationFile document = each.calibration->document;
      document.map_from_camera = calibrated_pose(motion * pose_of(*document.map_from_camera));
      set_uncertainty(document, calibration::turned(uncertainty_of(document), motion));
      answer["cameras"].push_back(camera_json(each, document));
      begun.cameras.push_back(&each);
      begun.documents.push_back(std::move(document));
    }
  });
  apply(context, begun, body.seen.apply, answer);
  return json_reply(answer);
}

http::Reply calibrate_one(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const settings::Document document = body_document(request);
  const auto snapshot = context.pipeline.snapshot();
  const CameraSnapshot& camera = camera_of(request, *snapshot);
  const auto body = read_body<ExtrinsicsBody>(document);
  if (body.map) return move_map(context, snapshot, camera, body);
  return calibrate(context, begin(context, {camera.id}), body.seen, body);
}

http::Reply calibrate_jointly(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const settings::Document document = body_document(request);
  const auto body = read_body<JointBody>(document);
  return calibrate(context, begin(context, body.cameras), body.seen, {});
}

}  // namespace

void add_extrinsics_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  router.add("POST", "/api/v1/cameras/{id}/calibration/extrinsics", bound(calibrate_one), http::Lane::slow);
  router.add("POST", "/api/v1/calibration/extrinsics", bound(calibrate_jointly), http::Lane::slow);
}

}  // namespace skylight::service
