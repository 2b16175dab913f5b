#include "sim/render/render.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core/utility.hpp>

#include "sim/render/solids.hpp"

namespace skylight::sim {
namespace {

constexpr std::size_t kWalls = static_cast<std::size_t>(-1);  ///< actor number of the walls
/// How much higher than an upper side something must be to keep light off it that is worth working out.
constexpr double kHigher = 0.05;

CameraModel moved(const CameraModel& camera, const Eigen::Isometry3d& map_from_camera) {
  CameraParameters parameters = camera.parameters();
  parameters.map_from_camera = map_from_camera;
  return CameraModel(parameters);
}

/// The paths of all rows, shared among the threads in blocks.
void paint(const Scene& scene) {
  constexpr int kBlock = 16;
  const int height = scene.mean->rows;
  cv::parallel_for_(cv::Range(0, (height + kBlock - 1) / kBlock), [&](const cv::Range& blocks) {
    paint_rows(scene, blocks.start * kBlock, std::min(blocks.end * kBlock, height));
  });
}

}  // namespace

Renderer::Renderer(const Scenario& scenario, const CameraSpec& camera, const FloorTexture& floor)
    : room_(scenario.room),
      floor_(floor),
      camera_(camera_model(camera)),
      light_(scenario.light, scenario.room, camera),
      exposure_{camera.exposure_s, camera.shutter == Shutter::rolling ? camera.readout_s : 0.0,
                camera.height_px},
      contact_shadow_(scenario.light.contact_shadow),
      sample_angle_(0.25 / std::max(camera.fx_px, camera.fy_px)),
      rays_(camera_) {
  if (camera.depth.enabled) metres_.create(camera.height_px, camera.width_px, CV_32FC1);
  if (auto walls = make_walls(room_)) walls_ = std::make_shared<const Look>(std::move(*walls));
  changed_.resize(static_cast<std::size_t>(camera.height_px));
  draw_floor_again();
}

void Renderer::set_actors(std::vector<SceneActor> actors, const PoseAt& now) {
  std::vector<std::optional<Pose2>> at(actors.size());
  std::vector<std::pair<const Look*, Pose2>> before;
  std::vector<std::pair<const Look*, Pose2>> after;
  for (std::size_t i = 0; i < actors_.size(); ++i) {
    if (fixed_at_[i]) before.emplace_back(actors_[i].look.get(), *fixed_at_[i]);
  }
  for (std::size_t i = 0; i < actors.size(); ++i) {
    if (actors[i].fixed && actors[i].look) at[i] = now(i, 0.0);
    if (at[i]) after.emplace_back(actors[i].look.get(), *at[i]);
  }
  const bool same = before == after;
  actors_ = std::move(actors);
  fixed_at_ = std::move(at);
  places_.assign(actors_.size(), {});
  drawn_.assign(actors_.size(), {});
  is_placed_.assign(actors_.size(), false);
  if (!same) draw_standing_again();
}

void Renderer::set_look(std::size_t actor, std::shared_ptr<const Look> look) {
  SceneActor& changed = actors_.at(actor);
  changed.look = std::move(look);
  is_placed_[actor] = false;
  places_[actor].forget();
  if (changed.fixed) draw_standing_again();
}

void Renderer::move_camera(const Eigen::Isometry3d& map_from_camera) {
  camera_ = moved(camera_, map_from_camera);
  rays_ = RayField(camera_);
  draw_floor_again();
}

void Renderer::set_passing_shadow(std::vector<PassingShadow> shadows) {
  passing_ = std::move(shadows);
}

void Renderer::draw_floor_again() {
  bare_ = draw_floor({room_, floor_, light_}, camera_, rays_);
  draw_standing_again();
}

Scene Renderer::scene() const {
  Scene scene;
  scene.view = {&camera_,      &light_,
                exposure_,     camera_.map_from_camera().translation(),
                sample_angle_, {0.5 * room_.size_m[0] + 0.5, 0.5 * room_.size_m[1] + 0.5}};
  scene.rays = &rays_;
  scene.axis = camera_.map_from_camera().linear().col(2);
  scene.contact_shadow = contact_shadow_;
  scene.standing = &standing_;
  return scene;
}

void Renderer::draw_standing_again() {
  standing_ = bare_.clone();
  Scene all = scene();
  fixed_.clear();
  fixed_.reserve(actors_.size() + 1);
  const auto add = [&](const Look& look, std::size_t actor, const Pose2& at) {
    Placed placed;
    if (placed.place(all.view, look, actor, [&](std::size_t, double) { return at; }))
      fixed_.push_back(std::move(placed));
  };
  if (walls_) add(*walls_, kWalls, Pose2{});
  for (std::size_t i = 0; i < actors_.size(); ++i) {
    if (actors_[i].look && fixed_at_[i]) add(*actors_[i].look, i, *fixed_at_[i]);
  }
  for (Placed& placed : fixed_) placed.light_up(all.view, casters_above(placed));
  for (const Placed& placed : fixed_) all.moving.push_back(&placed);
  all.into = &standing_;
  all.mean = &standing_.mean;
  all.metres = &standing_.metres;
  paint(all);
  mean_ = standing_.mean.clone();
  if (!metres_.empty()) standing_.metres.copyTo(metres_);
  for (std::vector<Change>& row : changed_) row.clear();
  for (Placed& placed : places_) placed.forget();
}

/// What may keep a lamp's light off its upper side: whatever is higher and not too far for its shadow.
std::vector<ShadowCaster> Renderer::casters_above(const Placed& placed) const {
  std::vector<ShadowCaster> casters;
  const double plane = placed.look().plate() ? placed.look().seen_height() : placed.look().bound().max.z();
  const Eigen::Vector3d& low = placed.look().bound().min;
  const Eigen::Vector3d& high = placed.look().bound().max;
  const double reach = low.cwiseAbs().cwiseMax(high.cwiseAbs()).head<2>().norm();
  const Eigen::Vector2d at = placed.path().middle.position();
  const auto add = [&](const Placed& other) {
    if (&other == &placed || other.look().bound().max.z() < plane + kHigher) return;
    for (const ShadowCaster& caster : other.casters()) {
      const double top = static_cast<double>(caster.shape.high) - plane;
      if (top < kHigher) continue;
      const Eigen::Vector2d middle(
          static_cast<double>(caster.x + caster.cosine * caster.shape.x - caster.sine * caster.shape.y),
          static_cast<double>(caster.y + caster.sine * caster.shape.x + caster.cosine * caster.shape.y));
      const double own =
          std::hypot(static_cast<double>(caster.shape.half_x), static_cast<double>(caster.shape.half_y));
      const bool may = std::any_of(light_.lamps().begin(), light_.lamps().end(), [&](const Lamp& lamp) {
        const double height = lamp.position.z() - plane;
        if (height <= 0.0) return false;
        const double up = std::min(top, static_cast<double>(kHighest) * height);
        const double stretch = height / (height - up);
        const Eigen::Vector2d tip = lamp.position.head<2>() + stretch * (middle - lamp.position.head<2>());
        const Eigen::Vector2d along = tip - middle;
        const double share = along.squaredNorm() > 0.0
                                 ? std::clamp((at - middle).dot(along) / along.squaredNorm(), 0.0, 1.0)
                                 : 0.0;
        return (middle + share * along - at).norm() < reach + stretch * own + lamp.radius_m * (stretch - 1.0);
      });
      if (may) casters.push_back(caster);
    }
  };
  for (const Placed& other : fixed_) add(other);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (is_placed_[i]) add(places_[i]);
  }
  return casters;
}

void Renderer::place_all(const PoseAt& pose) {
  const View view = scene().view;
  const auto for_each_actor = [&](const auto& work) {
    cv::parallel_for_(cv::Range(0, static_cast<int>(actors_.size())), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) work(static_cast<std::size_t>(i));
    });
  };
  places_.resize(actors_.size());
  std::vector<std::uint8_t> is_placed(actors_.size(), 0);
  for_each_actor([&](std::size_t i) {
    if (!actors_[i].fixed && actors_[i].look)
      is_placed[i] = places_[i].place(view, *actors_[i].look, i, pose) ? 1 : 0;
  });
  is_placed_.assign(is_placed.begin(), is_placed.end());
  for_each_actor([&](std::size_t i) {
    if (is_placed_[i] && places_[i].body_seen()) places_[i].light_up(view, casters_above(places_[i]));
  });
}

/// Whoever is as before and touches nobody who is not, neither where that one is now nor where it was.
void Renderer::find_kept() {
  kept_.assign(actors_.size(), false);
  if (was_passed_ || !passing_.empty()) return;
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < actors_.size(); ++i) {
    kept_[i] = is_placed_[i] && places_[i].same_as_before();
    if (!kept_[i]) others.push_back(i);
  }
  while (!others.empty()) {  // whoever is not kept may touch further ones
    const std::size_t other = others.back();
    others.pop_back();
    for (std::size_t i = 0; i < actors_.size(); ++i) {
      if (!kept_[i]) continue;
      const Outline& area = places_[i].area();
      if (!area.touches(drawn_[other]) && !(is_placed_[other] && area.touches(places_[other].area())))
        continue;
      kept_[i] = false;
      others.push_back(i);
    }
  }
}

void Renderer::draw(const PoseAt& pose) {
  place_all(pose);
  find_kept();
  Scene all = scene();
  for (std::size_t i = 0; i < actors_.size(); ++i) {
    if (kept_[i]) continue;
    drawn_[i] = is_placed_[i] ? places_[i].area() : Outline();
    if (is_placed_[i]) all.moving.push_back(&places_[i]);
  }
  for (const Placed& placed : fixed_) all.fixed.push_back(&placed);
  all.passing = &passing_;
  all.mean = &mean_;
  all.metres = metres_.empty() ? nullptr : &metres_;
  all.changed = &changed_;
  all.kept = &kept_;
  paint(all);
  was_passed_ = !passing_.empty();
}

double Renderer::row_offset(std::size_t actor) const {
  if (actors_.at(actor).fixed || !is_placed_[actor] || exposure_.readout_s == 0.0) return 0.0;
  const Placed& placed = places_[actor];
  const Rectangle& area = placed.look().seen_area();
  const Eigen::Vector2d middle = 0.5 * (area.min + area.max);
  double since = placed.path().middle_s;
  for (int i = 0; i < 5; ++i) {  // the row depends on where it is then; robots are slow against the readout
    const Pose2 pose = placed.path().at(since);
    const Eigen::Vector2d at = pose.position() + Eigen::Rotation2Dd(pose.yaw) * middle;
    const auto pixel = camera_.project_map({at.x(), at.y(), placed.look().seen_height()});
    if (!pixel || !camera_.contains(*pixel)) return 0.0;
    since = exposure_.row(pixel->y());
  }
  return since;
}

/// Whether a body stands between the camera and a place in `map`.
bool Renderer::hides(const Placed& other, const Eigen::Vector3d& place, double since_midpoint) const {
  const Eigen::Vector3d eye = camera_.map_from_camera().translation();
  const Pose2 pose = other.path().at(since_midpoint);
  const Eigen::Rotation2Dd turn(-pose.yaw);
  Ray ray;
  ray.origin << turn * (eye.head<2>() - pose.position()), eye.z();
  const Eigen::Vector3d direction = place - eye;
  ray.direction << turn * direction.head<2>(), direction.z();
  Hit hit;
  hit.distance = 1.0 - 1e-6;
  return std::any_of(other.look().solids().begin(), other.look().solids().end(),
                     [&](const Solid& solid) { return intersect(solid, ray, hit); });
}

double Renderer::visible(std::size_t actor) const {
  const Placed* placed = actors_.at(actor).fixed || !is_placed_[actor] ? nullptr : &places_[actor];
  for (const Placed& fixed : fixed_) {
    if (fixed.actor() == actor) placed = &fixed;
  }
  if (placed == nullptr || !placed->body_seen()) return 0.0;
  const auto meets = [&](const Placed& other) {
    return &other != placed && other.body_seen() && other.body_rows().meets(placed->body_rows()) &&
           other.body_columns().meets(placed->body_columns());
  };
  std::vector<const Placed*> others;
  for (const Placed& other : fixed_) {
    if (meets(other)) others.push_back(&other);
  }
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (is_placed_[i] && meets(places_[i])) others.push_back(&places_[i]);
  }
  const CameraParameters& parameters = camera_.parameters();
  const bool whole = placed->body_rows().begin > 0 && placed->body_columns().begin > 0 &&
                     placed->body_rows().end < parameters.height_px &&
                     placed->body_columns().end < parameters.width_px;
  if (whole && others.empty()) return 1.0;
  constexpr int kPoints = 12;  // along each side
  const double since = row_offset(actor);
  const Pose2 pose = placed->path().at(since);
  const Rectangle& area = placed->look().seen_area();
  int seen = 0;
  for (int i = 0; i < kPoints * kPoints; ++i) {
    const Eigen::Vector2d share((i % kPoints + 0.5) / kPoints, (i / kPoints + 0.5) / kPoints);
    const Eigen::Vector2d local = area.min + share.cwiseProduct(area.max - area.min);
    const Eigen::Vector2d at = pose.position() + Eigen::Rotation2Dd(pose.yaw) * local;
    const Eigen::Vector3d place(at.x(), at.y(), placed->look().seen_height());
    const auto pixel = camera_.project_map(place);
    if (!pixel || !camera_.contains(*pixel)) continue;
    seen += std::none_of(others.begin(), others.end(),
                         [&](const Placed* other) { return hides(*other, place, since); })
                ? 1
                : 0;
  }
  return static_cast<double>(seen) / (kPoints * kPoints);
}

}  // namespace skylight::sim
