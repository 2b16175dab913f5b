// Frames that another program brings.
#include <span>

#include "service/routes/context.hpp"
#include "service/sources/live/picture_bytes.hpp"
#include "service/sources/live/posted_camera.hpp"

namespace skylight::service {
namespace {

// Stamps further from our clock than this are no stamps of ours: a unit or a clock is wrong.
constexpr Duration kOldest = std::chrono::seconds(10);
constexpr Duration kAhead = std::chrono::seconds(1);

PostedPictures& posted_pictures(const http::Request& request, const RouteContext& context) {
  const std::string& id = request.path_param("id");
  const auto snapshot = context.pipeline.snapshot();
  const CameraSnapshot& camera = camera_of(request, *snapshot);
  const auto at = context.posted.find(id);
  if (at == context.posted.end() || (camera.feed && camera.feed->kind != "posted"))
    throw http::Problem(409, "Nothing is posted to this camera",
                        "the source of camera '" + id + "' is not of the type posted");
  return *at->second;
}

void check_stamp(const http::Request& request, const std::optional<Time>& stamp, Time now) {
  if (!stamp) return;
  if (*stamp > now + kAhead || *stamp < now - kOldest) {
    throw http::Problem(
        422, "The stamp is refused",
        "captured is " + *request.query_value("captured") + ", " + std::to_string(to_seconds(*stamp - now)) +
            " s from the service's clock, allowed: -10 to 1 s (a clock that is not synchronised: "
            "cameras[].source.clock own)");
  }
}

// Decoded by the worker, so that who posts hears what is wrong with the picture.
http::Reply post_frame(const http::Request& request, const RouteContext& context) {
  const Time arrived = context.pipeline.now();
  check_query(request, {"captured"});
  const auto stamp = query_time(request, "captured");
  PostedPictures& pictures = posted_pictures(request, context);
  if (pictures.options().synchronised) check_stamp(request, stamp, arrived);
  cv::Mat image;
  try {
    const std::span bytes(reinterpret_cast<const unsigned char*>(request.body.data()), request.body.size());
    image = decode_picture(bytes, pictures.options().size_px);
  } catch (const SourceError& error) {
    throw http::Problem(422, "The picture is refused", error.what());
  }
  pictures.post(std::move(image), stamp, arrived);
  return json_reply({{"camera", request.path_param("id")}, {"arrived", unix_seconds(arrived)}}, 202);
}

}  // namespace

void add_frame_routes(http::Router& router, const RouteContext& context) {
  router.add("POST", "/api/v1/cameras/{id}/frames",
             [&context](const http::Request& request) { return post_frame(request, context); },
             {.lane = http::Lane::slow, .content_types = {"image/jpeg", "image/png"}});
}

}  // namespace skylight::service
