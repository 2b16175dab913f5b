#include <cmath>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "service/overlay.hpp"
#include "service/routes/context.hpp"

namespace skylight::service {
namespace {

http::Reply list_cameras(const http::Request& request, const RouteContext& context) {
  check_query(request, {"limit", "offset"});
  const auto snapshot = context.pipeline.snapshot();
  std::vector<Json> items;
  for (const CameraSnapshot& camera : snapshot->cameras) items.push_back(to_json(camera));
  return json_reply(page_of(request, items));
}

http::Reply get_camera(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto snapshot = context.pipeline.snapshot();
  return json_reply(to_json(camera_of(request, *snapshot)));
}

bool wants_overlay(const http::Request& request) {
  const std::string* text = request.query_value("overlay");
  if (text == nullptr || *text == "true") return true;
  if (*text == "false") return false;
  throw http::Problem(400, "Bad query parameter", "overlay is '" + *text + "', allowed: true, false");
}

// The newest frame as JPEG; its capture time stands in a header, so that nothing old passes for new.
http::Reply get_snapshot(const http::Request& request, const RouteContext& context) {
  check_query(request, {"overlay", "width"});
  const auto snapshot = context.pipeline.snapshot();
  const CameraSnapshot& camera = camera_of(request, *snapshot);
  const bool overlay = wants_overlay(request);
  const auto asked = query_number(request, "width");
  const double width = asked.value_or(0.0);
  if (asked && !(width >= 64 && width <= 4096 && width == std::floor(width))) {
    throw http::Problem(
        400, "Bad query parameter",
        "width is '" + *request.query_value("width") + "', allowed: a whole number from 64 to 4096");
  }
  if (camera.image.empty())
    throw http::Problem(503, "No frame yet", "camera '" + camera.id + "' has no frame yet");
  cv::Mat image = camera.image;
  if (overlay) {
    image = draw_overlay(*snapshot, camera, static_cast<int>(width));
  } else if (width > 0.0) {
    const double scale = width / image.cols;
    cv::resize(camera.image, image, {}, scale, scale, cv::INTER_AREA);
  }
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, 85});
  http::Reply reply{.content_type = "image/jpeg", .body = std::string(jpeg.begin(), jpeg.end())};
  char captured[40];
  std::snprintf(captured, sizeof captured, "%.6f", unix_seconds(camera.captured));
  reply.headers.emplace_back("Skylight-Captured", captured);
  return reply;
}

}  // namespace

void add_camera_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  router.add("GET", "/api/v1/cameras", bound(list_cameras));
  router.add("GET", "/api/v1/cameras/{id}", bound(get_camera));
  router.add("GET", "/api/v1/cameras/{id}/snapshot.jpg", bound(get_snapshot), http::Lane::slow);
}

}  // namespace skylight::service
