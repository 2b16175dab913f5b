// A camera's calibration as a document, and its earlier versions.
#include <charconv>

#include "service/calibration/desk.hpp"
#include "service/routes/context.hpp"

namespace skylight::service {

/// Body of a request.
struct RestoreRequest {
  std::optional<int> version;
};

void describe(settings::Fields& fields, RestoreRequest& request) {
  fields.about("Which version is to be in use again.");
  fields.field("version", request.version,
               {.min = 1, .max = 1'000'000'000, .help = "Absent: the newest that is kept."});
}

namespace {

Json json_of(const CalibrationFile& document) {
  return Json::parse(calibration_json(document));
}

http::Reply document_reply(const CalibrationFile& document) {
  http::Reply reply{.body = calibration_json(document) + "\n"};
  reply.headers.emplace_back("ETag", tag_of(document));
  return reply;
}

/// `restored`: the version that is in use again; 0: it is a new one.
http::Reply kept_reply(const std::string& camera, const CalibrationFile& document,
                       const CalibrationKept& kept, int restored = 0) {
  http::Reply reply = json_reply({{"camera", camera},
                                  {"restored", restored > 0 ? Json(restored) : Json(nullptr)},
                                  {"stored", kept.stored},
                                  {"version", kept.version},
                                  {"calibration", json_of(document)}});
  reply.headers.emplace_back("ETag", kept.tag);
  return reply;
}

http::Reply get_calibration(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto snapshot = context.pipeline.snapshot();
  return document_reply(camera_of(request, *snapshot).calibration->document);
}

http::Reply put_calibration(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const settings::Document body = body_document(request);
  const auto snapshot = context.pipeline.snapshot();
  const std::string& camera = camera_of(request, *snapshot).id;
  CalibrationChange change{.camera = camera, .document = read_body<CalibrationFile>(body)};
  const std::string* instead_of = request.header("if-match");
  if (instead_of == nullptr)
    throw http::Problem(428, "If-Match is missing",
                        "say which calibration this one takes the place of: If-Match with the ETag that GET "
                        "gave, or * for whatever is in use");
  if (*instead_of != "*") change.instead_of = *instead_of;
  CalibrationKept kept;
  change_calibration([&] { kept = context.calibration->change({change}).front(); }, 412);
  return kept_reply(camera, change.document, kept);
}

Json made_json(const std::optional<CalibrationStep>& step) {
  return step ? Json(step->made) : Json(nullptr);
}

http::Reply list_versions(const http::Request& request, const RouteContext& context) {
  check_query(request, {"limit", "offset"});
  const auto snapshot = context.pipeline.snapshot();
  const CameraSnapshot& camera = camera_of(request, *snapshot);
  std::vector<Json> items;
  for (const NumberedCalibration& version : context.calibration->versions(camera.id)) {
    const CalibrationFile& document = version.document;
    items.push_back({{"number", version.number},
                     {"note", document.note},
                     {"intrinsics_made", made_json(document.intrinsics_made)},
                     {"extrinsics_made", made_json(document.extrinsics_made)}});
  }
  Json page = page_of(request, items);
  page["stored"] = !camera.calibration->file.empty();
  return json_reply(page);
}

int version_number(const http::Request& request) {
  const std::string& text = request.path_param("number");
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 1)
    throw http::Problem(404, "No such calibration", "there is no version '" + text + "'");
  return number;
}

http::Reply get_version(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto snapshot = context.pipeline.snapshot();
  const std::string& camera = camera_of(request, *snapshot).id;
  CalibrationFile document;
  change_calibration([&] { document = context.calibration->version(camera, version_number(request)); });
  return document_reply(document);
}

http::Reply restore(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const settings::Document body = body_document(request);
  const auto snapshot = context.pipeline.snapshot();
  const std::string& camera = camera_of(request, *snapshot).id;
  const auto asked = read_body<RestoreRequest>(body);
  CalibrationDesk::Restored restored;
  change_calibration([&] { restored = context.calibration->restore(camera, asked.version); });
  return kept_reply(camera, restored.document, restored.kept, restored.number);
}

}  // namespace

void add_calibration_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  const std::string at = "/api/v1/cameras/{id}/calibration";
  router.add("GET", at, bound(get_calibration));
  router.add("PUT", at, bound(put_calibration), http::Lane::slow);
  router.add("GET", at + "/versions", bound(list_versions), http::Lane::slow);
  router.add("GET", at + "/versions/{number}", bound(get_version), http::Lane::slow);
  router.add("POST", at + "/restore", bound(restore), http::Lane::slow);
}

}  // namespace skylight::service
