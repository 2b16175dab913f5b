#include <algorithm>

#include "service/routes/context.hpp"

namespace skylight::service {
namespace {

// Filters have a type, and the keys of one type are not another's.
bool of_another_type(const settings::Node& a, const settings::Node& b) {
  const auto type = [](const settings::Node& node) {
    const settings::Node* there = node.find("type");
    return there != nullptr ? std::get_if<std::string>(&there->scalar) : nullptr;
  };
  return type(a) != nullptr && type(b) != nullptr && *type(a) != *type(b);
}

// What `from` says and `into` does not: a change names only the keys that it changes.
void add_missing(settings::Node& into, const settings::Node& from) {
  for (std::size_t i = 0; i < from.children.size(); ++i) {
    if (settings::Node* there = const_cast<settings::Node*>(into.find(from.keys[i])); there == nullptr) {
      into.keys.push_back(from.keys[i]);
      into.children.push_back(from.children[i]);
    } else if (there->kind == settings::Node::Kind::object &&
               from.children[i].kind == settings::Node::Kind::object &&
               !of_another_type(*there, from.children[i])) {
      add_missing(*there, from.children[i]);
    }
  }
}

// As in the configuration file, a new robot is detected and filtered as the section tracker says, but for
// what it says itself.
void add_default_method(settings::Node& robot, const MethodConfig& method) {
  const RobotConfig prototype{.id = "robot", .appearance = {}, .method = method};
  settings::Node defaults = settings::parse(settings::write(prototype), "tracker").root;
  const auto id = std::find(defaults.keys.begin(), defaults.keys.end(), "id");
  defaults.children.erase(defaults.children.begin() + (id - defaults.keys.begin()));
  defaults.keys.erase(id);
  add_missing(robot, defaults);
}

RobotSpec spec_of(const RouteContext& context, const RobotConfig& robot) {
  const std::string& appearance = robot.appearance.value_or(robot.id);
  auto found = context.appearances.find(appearance);
  const bool does_without = robot.method.detector == DetectorKind::apriltag && !robot.appearance;
  if (!found && !does_without)
    throw http::Problem(422, "The body is refused",
                        "body: appearance: there is no appearance '" + appearance + "'");
  return robot_spec(robot, std::move(found));
}

Json robot_json(const RouteContext& context, const Snapshot& snapshot, const RobotSnapshot& robot) {
  const QueryContext present{.now = context.pipeline.now(), .horizon = context.horizon};
  return to_json(robot, answer(snapshot, robot, {}, present));
}

http::Reply list_robots(const http::Request& request, const RouteContext& context) {
  check_query(request, {"limit", "offset"});
  const auto snapshot = context.pipeline.snapshot();
  std::vector<Json> items;
  for (const RobotSnapshot& robot : snapshot->robots) items.push_back(robot_json(context, *snapshot, robot));
  return json_reply(page_of(request, items));
}

http::Reply get_robot(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const auto snapshot = context.pipeline.snapshot();
  return json_reply(robot_json(context, *snapshot, robot_of(request, *snapshot)));
}

http::Reply add_robot(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  settings::Document document = body_document(request);
  if (document.root.kind == settings::Node::Kind::object)
    add_default_method(document.root, context.default_method);
  const auto robot = read_body<RobotConfig>(document);
  if (context.pipeline.snapshot()->robot(robot.id) != nullptr) {
    throw http::Problem(409, "The robot is there already", "there is a robot '" + robot.id + "' already");
  }
  const RobotSpec spec = spec_of(context, robot);
  change_tracker(context, [&](Tracker& tracker) { tracker.add(spec); });
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot* added = snapshot->robot(robot.id);
  if (added == nullptr)
    throw http::Problem(409, "The robot is gone",
                        "robot '" + robot.id + "' was removed as soon as it was added");
  http::Reply reply = json_reply(robot_json(context, *snapshot, *added), 201);
  reply.headers.emplace_back("Location", "/api/v1/robots/" + robot.id);
  return reply;
}

http::Reply change_robot(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  settings::Document document = body_document(request);
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& now = robot_of(request, *snapshot);
  if (document.root.kind == settings::Node::Kind::object) {
    add_missing(document.root, settings::parse(settings::write(robot_config(*now.spec)), "robot").root);
  }
  const auto robot = read_body<RobotConfig>(document);
  if (robot.id != now.view.id)
    throw http::Problem(422, "The body is refused", "body: id: a robot's id cannot change");
  const RobotSpec spec = spec_of(context, robot);
  change_tracker(context, [&](Tracker& tracker) { tracker.change(spec); });
  const auto shown = context.pipeline.snapshot();
  return json_reply(robot_json(context, *shown, robot_of(request, *shown)));
}

http::Reply remove_robot(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const std::string& id = request.path_param("id");
  bool removed = false;
  change_tracker(context, [&](Tracker& tracker) { removed = tracker.remove(id); });
  if (!removed) throw http::Problem(404, "No such robot", "there is no robot '" + id + "'");
  return {.status = 204, .content_type = ""};
}

}  // namespace

void add_robot_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  router.add("GET", "/api/v1/robots", bound(list_robots));
  router.add("POST", "/api/v1/robots", bound(add_robot), http::Lane::slow);
  router.add("GET", "/api/v1/robots/{id}", bound(get_robot));
  router.add("PATCH", "/api/v1/robots/{id}", bound(change_robot), http::Lane::slow);
  router.add("DELETE", "/api/v1/robots/{id}", bound(remove_robot), http::Lane::slow);
}

}  // namespace skylight::service
