#include "sim/cast.hpp"

#include <algorithm>
#include <utility>

#include "sim/render/artwork.hpp"
#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {
namespace {

std::shared_ptr<const Look> look_of(const RobotSpec& robot, const RobotPicture& picture) {
  return std::make_shared<const Look>(body_of(make_look(robot, picture)));
}

Color darker(const Color& color, double factor) {
  return {color[0] * factor, color[1] * factor, color[2] * factor};
}

std::shared_ptr<const Look> look_of(const ObjectSpec& thing) {
  const Eigen::Vector3d half(0.5 * thing.size_m[0], 0.5 * thing.size_m[1], 0.0);
  Solid solid;
  solid.kind = thing.shape == BodyShape::box ? SolidKind::box : SolidKind::cylinder;
  solid.min = Eigen::Vector3d(-half.x(), -half.y(), thing.bottom_m);
  solid.max = Eigen::Vector3d(half.x(), half.y(), thing.bottom_m + thing.size_m[2]);
  solid.top_rgb = thing.color_rgb;
  solid.side_rgb = darker(thing.color_rgb, 0.85);
  return std::make_shared<const Look>(Body{.solids = {solid}, .decal = {}, .gloss = 0.02});
}

/// Head, shoulders, trunk and legs, as shares of the height; x is where he walks to.
std::shared_ptr<const Look> look_of(const PersonSpec& person) {
  const double h = person.height_m;
  const Color& clothes = person.color_rgb;
  const Color hair{52.0, 40.0, 32.0};
  const Color skin{196.0, 150.0, 122.0};
  const auto part = [](SolidKind kind, const Eigen::Vector3d& min, const Eigen::Vector3d& max,
                       const Color& top,
                       const Color& side) { return Solid{kind, min, max, top, side, false}; };
  return std::make_shared<const Look>(
      Body{.solids = {part(SolidKind::cylinder, {-0.09, -0.09, 0.87 * h}, {0.09, 0.09, h}, hair, skin),
                      part(SolidKind::box, {-0.11, -0.22, 0.78 * h}, {0.11, 0.22, 0.84 * h}, clothes,
                           darker(clothes, 0.9)),
                      part(SolidKind::box, {-0.12, -0.17, 0.5 * h}, {0.12, 0.17, 0.78 * h}, clothes,
                           darker(clothes, 0.85)),
                      part(SolidKind::cylinder, {-0.09, -0.17, 0.0}, {0.09, 0.01, 0.5 * h},
                           darker(clothes, 0.6), darker(clothes, 0.5)),
                      part(SolidKind::cylinder, {-0.09, -0.01, 0.0}, {0.09, 0.17, 0.5 * h},
                           darker(clothes, 0.6), darker(clothes, 0.5))},
           .decal = {},
           .gloss = 0.0});
}

}  // namespace

Cast::Cast(const Scenario& scenario, const std::vector<RobotSpec>& robots) : scenario_(scenario) {
  scenario_.robots = robots;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    pictures_.push_back(make_picture(scenario_, i));
    robots_.push_back(look_of(robots[i], pictures_.back()));
  }
}

void Cast::cover(std::size_t robot, const CoverAction& action, Duration at) {
  Cover cover{.robot = robot, .tag_only = action.tag_only, .from = at};
  if (action.for_s > 0.0) cover.until = at + from_seconds(action.for_s);
  cover.look = look_of(scenario_.robots.at(robot), make_covered(scenario_, robot, action.tag_only));
  covers_.push_back(std::move(cover));
}

std::shared_ptr<const Look> Cast::look(const Stage& stage, std::size_t actor, Duration time) {
  const Actor one = stage.actor(actor);
  if (one.kind != ActorKind::robot) {
    auto& look = others_[actor];
    if (look == nullptr)
      look = one.kind == ActorKind::thing ? look_of(stage.things()[one.index])
                                          : look_of(stage.people()[one.index]);
    return look;
  }
  std::shared_ptr<const Look> look = robots_.at(one.index);
  for (const Cover& cover : covers_) {
    if (cover.robot != one.index || time < cover.from || (cover.until && time >= *cover.until)) continue;
    look = cover.look;
    if (!cover.tag_only) break;  // what hides all hides the tag as well
  }
  return look;
}

}  // namespace skylight::sim
