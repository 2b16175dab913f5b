#include "service/routes/context.hpp"

namespace skylight::service {
namespace {

Json to_json(const Appearance& appearance) {
  const Picture& picture = appearance.picture();
  const Eigen::Vector2d size = appearance.size_m();
  return {{"id", appearance.id()},
          {"metres_per_pixel", picture.metres_per_pixel},
          {"surface_height_m", picture.surface_height_m},
          {"reference_point_m", {picture.reference_point_m.x(), picture.reference_point_m.y()}},
          {"size_m", {size.x(), size.y()}},
          {"coloured", appearance.coloured()},
          {"heading_turns", appearance.heading_turns()}};
}

http::Reply list_appearances(const http::Request& request, const RouteContext& context) {
  check_query(request, {"limit", "offset"});
  std::vector<Json> items;
  for (const auto& [id, appearance] : context.appearances.all()) items.push_back(to_json(*appearance));
  return json_reply(page_of(request, items));
}

// From a box on a camera's newest frame. (Files are the configuration's: no path of a request reaches the
// file system.)
http::Reply add_appearance(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto config = read_body<AppearanceConfig>(body_document(request));
  if (!config.cut_from_frame)
    throw http::Problem(422, "The body is refused",
                        "body: cut_from_frame is needed; image is for the configuration file");
  if (context.appearances.find(config.id))
    throw http::Problem(409, "The appearance is there already",
                        "there is an appearance '" + config.id + "' already");
  const auto snapshot = context.pipeline.snapshot();
  const CameraSnapshot* camera = snapshot->camera(config.cut_from_frame->camera);
  if (camera == nullptr)
    throw http::Problem(
        422, "The body is refused",
        "body: cut_from_frame.camera: there is no camera '" + config.cut_from_frame->camera + "'");
  if (camera->image.empty())
    throw http::Problem(409, "No frame yet", "camera '" + camera->id + "' has no frame to cut from");
  const Frame frame{.captured = camera->captured, .image = camera->image, .depth = {}};
  std::shared_ptr<const Appearance> appearance;
  Pose2 pose;
  try {
    appearance = make_appearance(config, &frame, camera->model.get(), &pose);
  } catch (const std::invalid_argument& e) {
    throw http::Problem(422, "The picture is refused", e.what());
  }
  if (!context.appearances.add(appearance))
    throw http::Problem(409, "The appearance is there already",
                        "there is an appearance '" + config.id + "' already");
  Json body = to_json(*appearance);
  body["cut_pose"] = {
      {"x", pose.x}, {"y", pose.y}, {"yaw", pose.yaw}, {"captured", unix_seconds(frame.captured)}};
  return json_reply(body, 201);
}

}  // namespace

void add_appearance_routes(http::Router& router, const RouteContext& context) {
  router.add("GET", "/api/v1/appearances",
             [&context](const http::Request& request) { return list_appearances(request, context); });
  router.add(
      "POST", "/api/v1/appearances",
      [&context](const http::Request& request) { return add_appearance(request, context); },
      http::Lane::slow);
}

}  // namespace skylight::service
