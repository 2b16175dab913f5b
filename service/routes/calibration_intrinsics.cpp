// Guided intrinsics calibrations of live cameras.
#include <numbers>

#include "service/calibration/guide.hpp"
#include "service/routes/context.hpp"

namespace skylight::service {

/// Body of a request.
struct GuideBody {
  std::string board;
  std::optional<LensModel> lens;  ///< absent: auto
};

void describe(settings::Fields& fields, GuideBody& body) {
  using Lens = std::optional<LensModel>;
  fields.about("What is moved before the camera, and what kind of lens it has.");
  fields.field("board", body.board,
               {.min_length = 1,
                .max_length = 100,
                .required = true,
                .help = "chessboard:COLUMNSxROWS:SQUARE, counting inner corners, or "
                        "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY, counting squares; sizes in metres, "
                        "as chessboard:9x6:0.025 or charuco:8x6:0.04:0.03:4x4_50."});
  fields.choice("model", body.lens,
                {{"auto", Lens()},
                 {"pinhole", Lens(LensModel::brown_conrady)},
                 {"fisheye", Lens(LensModel::kannala_brandt)}},
                {.help = "auto: whichever fits the views."});
}

namespace {

const char* model_name(LensModel lens) {
  return lens == LensModel::brown_conrady ? "pinhole" : "fisheye";
}

Json text_or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json pixels_json(const std::vector<Pixel>& pixels) {
  Json out = Json::array();
  for (const Pixel& pixel : pixels) out.push_back({pixel.x(), pixel.y()});
  return out;
}

Json coverage_json(const calibration::Coverage& coverage) {
  Json rows = Json::array();
  for (std::size_t row = 0; row < calibration::Coverage::kRows; ++row) {
    const auto first = coverage.corners.begin() +
                       static_cast<std::ptrdiff_t>(row * std::size_t{calibration::Coverage::kColumns});
    rows.push_back(std::vector<int>(first, first + calibration::Coverage::kColumns));
  }
  return {{"corners", std::move(rows)}, {"share", coverage.share()}};
}

Json result_json(const GuideResult& result) {
  const calibration::IntrinsicsResult& fit = result.fit;
  const Intrinsics& in = fit.intrinsics;
  const auto sigma = [&](int i) { return std::sqrt(std::max(0.0, fit.covariance(i, i))); };
  Json views = Json::array();
  for (const calibration::ViewResult& view : fit.views)
    views.push_back({{"name", view.name},
                     {"used", view.used},
                     {"why_not", text_or_null(view.why_not)},
                     {"rms_px", view.rms_px},
                     {"corners", view.points},
                     {"corners_left_out", view.points_left_out},
                     {"tilt_deg", view.tilt_rad * 180.0 / std::numbers::pi}});
  Json distortion = Json::array();
  for (int i = 0; i < 5; ++i) distortion.push_back(sigma(kDistortion + i));
  return {{"model", model_name(in.lens)},
          {"model_reason", text_or_null(fit.lens_reason)},
          {"rms_px", fit.rms_px},
          {"intrinsics", to_json(in)},
          {"sigmas",
           {{"focal_px", {sigma(kFocalX), sigma(kFocalY)}},
            {"centre_px", {sigma(kCentreX), sigma(kCentreY)}},
            {"distortion", std::move(distortion)}}},
          {"views", std::move(views)},
          {"coverage", coverage_json(fit.coverage)},
          {"warnings", fit.warnings},
          {"stored", result.kept.stored},
          {"version", result.kept.version}};
}

Json progress_json(const std::string& camera, const GuideProgress& progress) {
  Json views = Json::array();
  for (const GuideView& view : progress.views)
    views.push_back({{"captured", unix_seconds(view.captured)}, {"corners_px", pixels_json(view.corners)}});
  Json newest = nullptr;
  if (progress.newest)
    newest = {{"captured", unix_seconds(progress.newest->captured)},
              {"corners_px", pixels_json(progress.newest->corners)},
              {"taken", progress.newest->taken},
              {"why_not", text_or_null(progress.newest->why_not)}};
  return {{"camera", camera},
          {"state", to_string(progress.state)},
          {"board", to_string(progress.board)},
          {"model", progress.lens ? model_name(*progress.lens) : "auto"},
          {"started", unix_seconds(progress.started)},
          {"frames", progress.frames},
          {"newest", std::move(newest)},
          {"views", std::move(views)},
          {"coverage", coverage_json(progress.coverage)},
          {"missing", progress.missing},
          {"enough", progress.missing.empty() && progress.views.size() >= IntrinsicsGuide::kGoodViews},
          {"suspicion", text_or_null(progress.suspicion)},
          {"refusal", text_or_null(progress.refusal)},
          {"result", progress.result ? result_json(*progress.result) : Json(nullptr)}};
}

std::string camera_id(const http::Request& request, const RouteContext& context) {
  const auto snapshot = context.pipeline.snapshot();
  return camera_of(request, *snapshot).id;
}

Json progress_of(const std::string& camera, const RouteContext& context) {
  const auto progress = context.guide->progress(camera);
  if (!progress)
    throw http::Problem(404, "No calibration under way", "camera '" + camera + "' is not being calibrated");
  return progress_json(camera, *progress);
}

http::Reply start(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const settings::Document document = body_document(request);
  const std::string camera = camera_id(request, context);
  const auto body = read_body<GuideBody>(document);
  GuideRequest guided{.lens = body.lens};
  try {
    guided.board = calibration::parse_board(body.board);
  } catch (const std::invalid_argument& error) {
    throw http::Problem(422, "The body is refused", std::string("body: board: ") + error.what());
  }
  try {
    context.guide->start(camera, guided);
  } catch (const GuideConflict& error) {
    throw http::Problem(409, "The camera is being calibrated", error.what());
  }
  http::Reply reply = json_reply(progress_of(camera, context), 201);
  reply.headers.emplace_back("Location", "/api/v1/cameras/" + camera + "/calibration/intrinsics");
  return reply;
}

http::Reply show(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  return json_reply(progress_of(camera_id(request, context), context));
}

http::Reply finish(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const std::string camera = camera_id(request, context);
  progress_of(camera, context);
  try {
    context.guide->finish(camera);
  } catch (const GuideConflict& error) {
    throw http::Problem(409, "Nothing to fit", error.what());
  }
  return json_reply(progress_of(camera, context), 202);
}

http::Reply cancel(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const std::string camera = camera_id(request, context);
  progress_of(camera, context);
  context.guide->cancel(camera);
  return {.status = 204, .content_type = ""};
}

}  // namespace

void add_intrinsics_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  const std::string at = "/api/v1/cameras/{id}/calibration/intrinsics";
  router.add("POST", at, bound(start));
  router.add("GET", at, bound(show));
  router.add("DELETE", at, bound(cancel));
  router.add("POST", at + "/finish", bound(finish));
}

}  // namespace skylight::service
