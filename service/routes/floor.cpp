#include "service/routes/context.hpp"

namespace skylight::service {
namespace {

Json masks_json(const FloorConfig& floor) {
  Json out = Json::array();
  for (const MaskConfig& mask : floor.masks)
    out.push_back({{"name", mask.name}, {"corners_m", mask.corners_m}});
  return out;
}

// What a picture shows of the floor: its corners and the middles of its edges, all round.
Json view_json(const CameraSnapshot& camera) {
  const Intrinsics& in = camera.model->intrinsics();
  const double right = in.width_px - 1.0;
  const double bottom = in.height_px - 1.0;
  Json out = Json::array();
  for (const Pixel& pixel :
       {Pixel(0, 0), Pixel(right / 2, 0), Pixel(right, 0), Pixel(right, bottom / 2), Pixel(right, bottom),
        Pixel(right / 2, bottom), Pixel(0, bottom), Pixel(0, bottom / 2)}) {
    const auto at = camera.model->plane_from_pixel(pixel, 0.0);
    if (!at) return nullptr;  // above the horizon
    out.push_back({at->x(), at->y()});
  }
  return out;
}

Json tags_json(const CameraSnapshot& camera) {
  Json out = Json::array();
  for (const FloorTag& tag : camera.floor_tags)
    out.push_back({{"family", tag.family},
                   {"id", tag.id},
                   {"size_m", tag.size_m},
                   {"x_m", tag.x_m},
                   {"y_m", tag.y_m},
                   {"yaw_deg", tag.yaw_deg}});
  return out;
}

}  // namespace

void add_floor_routes(http::Router& router, const RouteContext& context) {
  router.add("GET", "/api/v1/floor", [&context](const http::Request& request) {
    check_query(request, {});
    const auto snapshot = context.pipeline.snapshot();
    Json cameras = Json::array();
    for (const CameraSnapshot& camera : snapshot->cameras)
      cameras.push_back({{"id", camera.id}, {"view_m", view_json(camera)}, {"tags", tags_json(camera)}});
    return json_reply({{"masks", masks_json(context.floor)}, {"cameras", std::move(cameras)}});
  });
}

}  // namespace skylight::service
