#include "sim/render/placed.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace skylight::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Half a pixel is its own size; the rest is what straight edges between outline points may be off.
constexpr double kMargin = 0.5 + 0.4;
constexpr double kEdge = 0.25;       ///< m, between neighbouring points along an outline
constexpr double kShadowEdge = 0.4;  ///< m, the same for shadows
constexpr double kLarge = 0.8;       ///< m, from which size on light is not the same all over a body
/// An actor that gets further than this per second was put elsewhere: no motion, a jump.
constexpr double kJumpSpeed = 10.0;

struct Turn {
  double cosine, sine;
  explicit Turn(double yaw) : cosine(std::cos(yaw)), sine(std::sin(yaw)) {}
  Vector2d out(const Vector2d& v) const {
    return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y()};
  }
  Vector2d in(const Vector2d& v) const {
    return {cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x()};
  }
};

bool same(const Pose2& a, const Pose2& b) {
  return a.x == b.x && a.y == b.y && a.yaw == b.yaw;
}

/// Points around a solid's outline from above, body frame. `outside`: of a polygon around a cylinder, else in
/// it.
std::vector<Vector2d> ring(const Solid& solid, bool outside, double edge) {
  std::vector<Vector2d> points;
  const Vector2d low = solid.min.head<2>();
  const Vector2d high = solid.max.head<2>();
  if (solid.kind == SolidKind::cylinder) {
    const int corners = std::clamp(static_cast<int>(std::ceil((high.x() - low.x()) * 3.0 / edge)), 12, 64);
    const double step = 2.0 * std::numbers::pi / corners;
    const double radius = 0.5 * (high.x() - low.x()) / (outside ? std::cos(0.5 * step) : 1.0);
    for (int i = 0; i < corners; ++i)
      points.emplace_back(0.5 * (low + high) + radius * Vector2d(std::cos(i * step), std::sin(i * step)));
    return points;
  }
  const std::array<Vector2d, 5> corners{low, {high.x(), low.y()}, high, {low.x(), high.y()}, low};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d side = corners[i + 1] - corners[i];
    const int parts = std::clamp(static_cast<int>(std::ceil(side.norm() / edge)), 1, 200);
    for (int k = 0; k < parts; ++k) points.emplace_back(corners[i] + side * (static_cast<double>(k) / parts));
  }
  return points;
}

void add_level(std::vector<Vector3d>& points, const std::vector<Vector2d>& outline, const Pose2& pose,
               double z) {
  const Turn turn(pose.yaw);
  for (const Vector2d& p : outline) {
    const Vector2d at = pose.position() + turn.out(p);
    points.emplace_back(at.x(), at.y(), z);
  }
}

std::vector<Vector3d> hull_points(const Solid& solid, const Pose2& pose) {
  std::vector<Vector3d> points;
  const std::vector<Vector2d> outline = ring(solid, true, kEdge);
  const double height = solid.max.z() - solid.min.z();
  const int parts = std::clamp(static_cast<int>(std::ceil(height / kEdge)), 1, 64);
  for (int k = 0; k <= parts; ++k)
    add_level(points, outline, pose, solid.min.z() + height * static_cast<double>(k) / parts);
  return points;
}

}  // namespace

std::array<float, 2> PlateLight::at(float x, float y) const {
  const float u = std::clamp((x - x0) * per_x, 0.0F, kNodes - 1.001F);
  const float v = std::clamp((y - y0) * per_y, 0.0F, kNodes - 1.001F);
  const auto i = static_cast<std::size_t>(u);
  const auto j = static_cast<std::size_t>(v);
  const float a = u - static_cast<float>(i);
  const float b = v - static_cast<float>(j);
  const std::size_t node = j * kNodes + i;
  const auto between = [&](const std::array<float, kNodes * kNodes>& of) {
    const float upper = of[node] + a * (of[node + 1] - of[node]);
    const float lower = of[node + kNodes] + a * (of[node + kNodes + 1] - of[node + kNodes]);
    return upper + b * (lower - upper);
  };
  return {between(factor), between(added)};
}

bool Placed::place(const View& view, const Look& look, std::size_t actor, const PoseAt& pose) {
  const bool before = known_ && look_ == &look && actor_ == actor && path_.still();
  const Pose2 was = path_.middle;
  look_ = &look;
  actor_ = actor;
  known_ = find_path(view, pose);
  if (!known_) {
    body_rows_ = body_columns_ = {};
    shadows_.clear();
    area_.clear();
    unmoved_ = lit_ = false;
    return false;
  }
  unmoved_ = before && path_.still() && same(was, path_.middle);
  if (!unmoved_) lay_out(view);
  return body_seen() || !shadows_.empty();
}

/// All that follows from its path.
void Placed::lay_out(const View& view) {
  lit_ = false;
  body_rows_ = body_columns_ = {};
  shadows_.clear();
  const Turn turn(path_.middle.yaw);
  casters_.clear();
  for (const Caster& shape : look_->casters()) {
    casters_.push_back({shape, static_cast<float>(turn.cosine), static_cast<float>(turn.sine),
                        static_cast<float>(path_.middle.x), static_cast<float>(path_.middle.y)});
  }
  outline_solids(view);
  outline_shadows(view);
  same_in_all_rows_ = view.exposure.readout_s == 0.0 || path_.still();
  if (same_in_all_rows_) stances_ = make_stances(view, 0);
  const Vector3d size = look_->bound().max - look_->bound().min;
  large_ = size.head<2>().maxCoeff() > kLarge;
  area_.clear();
  for (const Outline& outline : outer_) area_.join(outline);
  for (const ShadowArea& shadow : shadows_) area_.join(shadow.outline);
}

void Placed::find_times(const View& view, const Pose2& now) {
  begin_s_ = end_s_ = 0.0;
  if (view.exposure.readout_s > 0.0) {  // the rows that it may lie in, at first by where it is now
    std::vector<Vector2d> pixels;
    int low = 0;
    int high = view.exposure.height_px - 1;
    if (project_all(*view.camera, hull_points(look_->bound(), now), pixels)) {
      const auto [least, most] = std::minmax_element(
          pixels.begin(), pixels.end(), [](const Vector2d& a, const Vector2d& b) { return a.y() < b.y(); });
      constexpr double kSpare = 20.0;  // px
      low = static_cast<int>(std::clamp(least->y() - kSpare, 0.0, 1.0 * high));
      high = static_cast<int>(std::clamp(most->y() + kSpare, 0.0, 1.0 * high));
    }
    begin_s_ = view.exposure.row(low);
    end_s_ = view.exposure.row(high);
  }
  begin_s_ -= 0.5 * view.exposure.exposure_s;
  end_s_ += 0.5 * view.exposure.exposure_s;
}

bool Placed::find_path(const View& view, const PoseAt& pose) {
  const auto now = pose(actor_, 0.0);
  if (!now) return false;
  if (!known_ || !now_ || !same(*now, *now_)) find_times(view, *now);
  now_ = now;
  const double begin = begin_s_;
  const double end = end_s_;
  path_ = {};
  path_.middle_s = 0.5 * (begin + end);
  path_.half_s = std::max(0.5 * (end - begin), 1e-9);
  const auto middle = path_.middle_s == 0.0 ? now : pose(actor_, path_.middle_s);
  if (!middle) return false;
  path_.middle = *middle;
  const auto change = [&](double since) {
    const auto there = pose(actor_, since);
    Vector3d d = Vector3d::Zero();
    if (there) d = {there->x - middle->x, there->y - middle->y, wrap_angle(there->yaw - middle->yaw)};
    return d.head<2>().norm() > 0.05 + kJumpSpeed * path_.half_s ? Vector3d(Vector3d::Zero()) : d;
  };
  const Vector3d before = change(begin);
  const Vector3d after = change(end);
  path_.rate = 0.5 * (after - before);
  path_.bend = 0.5 * (after + before);
  return true;
}

void Placed::outline_solids(const View& view) {
  const int width = view.camera->parameters().width_px;
  const int height = view.camera->parameters().height_px;
  const Pose2& at = path_.middle;
  std::vector<Vector2d> pixels;
  moved_px_ = 0.0;
  bool moves_in_range = true;
  if (!path_.still()) {
    const std::vector<Vector3d> middle = hull_points(look_->bound(), at);
    moves_in_range = project_all(*view.camera, middle, pixels);
    const std::vector<Vector2d> from = pixels;
    for (const double end : {-1.0, 1.0}) {
      const Pose2 there = path_.at(path_.middle_s + end * path_.half_s);
      moves_in_range =
          moves_in_range && project_all(*view.camera, hull_points(look_->bound(), there), pixels);
      if (!moves_in_range) break;
      for (std::size_t i = 0; i < from.size(); ++i)
        moved_px_ = std::max(moved_px_, (pixels[i] - from[i]).norm());
    }
  }
  const std::size_t count = look_->solids().size();
  outer_.resize(count);
  inner_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Solid& solid = look_->solids()[i];
    inner_[i].clear();
    if (!moves_in_range || !project_all(*view.camera, hull_points(solid, at), pixels)) {
      outer_[i].fill(width, height);
    } else {
      outer_[i].around(hull(pixels), kMargin + moved_px_, width, height);
      if (solid.kind != SolidKind::wheel && view.eye.z() > solid.max.z() + 0.01 && !outer_[i].empty()) {
        std::vector<Vector3d> top;
        add_level(top, ring(solid, false, kEdge), at, solid.max.z());
        if (project_all(*view.camera, top, pixels))
          inner_[i].inside(hull(pixels), kMargin + moved_px_, width, height);
      }
    }
    const Span columns = outer_[i].columns();
    if (columns.empty()) continue;
    const bool first = !body_seen();
    body_rows_ = {first ? outer_[i].first_row() : std::min(body_rows_.begin, outer_[i].first_row()),
                  first ? outer_[i].end_row() : std::max(body_rows_.end, outer_[i].end_row())};
    body_columns_ = {first ? columns.begin : std::min(body_columns_.begin, columns.begin),
                     first ? columns.end : std::max(body_columns_.end, columns.end)};
  }
}

/// Where the floor may be darker for it: the hull of its casters' outlines, drawn out away from the lamp.
void Placed::outline_shadows(const View& view) {
  const int width = view.camera->parameters().width_px;
  const int height = view.camera->parameters().height_px;
  const auto add = [&](std::optional<std::size_t> lamp, std::vector<Vector2d>& floor) {
    if (floor.empty()) return;
    const std::vector<Vector2d> polygon = clipped(hull(floor), view.room_half);
    std::vector<Vector3d> edge;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2d side = polygon[(i + 1) % polygon.size()] - polygon[i];
      const int parts = std::clamp(static_cast<int>(std::ceil(side.norm() / kShadowEdge)), 1, 100);
      for (int k = 0; k < parts; ++k) {
        const Vector2d p = polygon[i] + side * (static_cast<double>(k) / parts);
        edge.emplace_back(p.x(), p.y(), 0.0);
      }
    }
    if (edge.empty()) return;
    ShadowArea area{lamp, {}};
    std::vector<Vector2d> pixels;
    if (project_all(*view.camera, edge, pixels)) {
      area.outline.around(hull(pixels), 1.0, width, height);
    } else {
      area.outline.fill(width, height);
    }
    if (!area.outline.empty()) shadows_.push_back(std::move(area));
  };
  const auto corners = [&](const Caster& shape, double margin, const auto& put) {
    const Turn turn(path_.middle.yaw);
    for (const double i : {-1.0, 1.0}) {
      for (const double j : {-1.0, 1.0}) {
        const Vector2d corner(shape.x + i * (shape.half_x + margin), shape.y + j * (shape.half_y + margin));
        put(path_.middle.position() + turn.out(corner));
      }
    }
  };
  std::vector<Vector2d> floor;
  for (const Caster& shape : look_->casters()) {
    if (touches_floor(shape)) corners(shape, kContactReach, [&](const Vector2d& p) { floor.push_back(p); });
  }
  add(std::nullopt, floor);
  for (std::size_t i = 0; i < view.light->lamps().size(); ++i) {
    const Lamp& lamp = view.light->lamps()[i];
    floor.clear();
    for (const Caster& shape : look_->casters()) {
      for (const double z : {1.0 * shape.low, 1.0 * shape.high}) {
        const double up = std::min(z, kHighest * lamp.position.z());
        const double stretch = lamp.position.z() / (lamp.position.z() - up);
        const double blur = lamp.radius_m * (stretch - 1.0) + 0.01;
        corners(shape, 0.0, [&](const Vector2d& p) {
          const Vector2d foot = lamp.position.head<2>() + stretch * (p - lamp.position.head<2>());
          for (const double u : {-blur, blur}) {
            for (const double v : {-blur, blur}) floor.emplace_back(foot + Vector2d(u, v));
          }
        });
      }
    }
    add(i, floor);
  }
}

const Stances& Placed::stances(const View& view, int y, Stances& scratch) const {
  if (same_in_all_rows_) return stances_;
  scratch = make_stances(view, y);
  return scratch;
}

Stances Placed::make_stances(const View& view, int y) const {
  Stances stances;
  const double time = same_in_all_rows_ ? 0.0 : view.exposure.row(y);
  const Pose2 middle = path_.at(time);
  const Turn turn(middle.yaw);
  for (std::size_t i = 0; i <= kSamples; ++i) {
    const double share = i < kSamples ? sixteenth(kTime[i]) - 0.5 : 0.0;
    const Pose2 there = path_.at(time + share * view.exposure.exposure_s);
    const double d = there.yaw - middle.yaw;
    // cos(a + d), sin(a + d) by the series for a small d: exact to 1e-12.
    Turn turned = turn;
    if (std::abs(d) > 0.01) {
      turned = Turn(there.yaw);
    } else if (d != 0.0) {
      const double c = 1.0 - 0.5 * d * d * (1.0 - d * d / 12.0);
      const double s = d * (1.0 - d * d / 6.0 * (1.0 - d * d / 20.0));
      turned.cosine = turn.cosine * c - turn.sine * s;
      turned.sine = turn.sine * c + turn.cosine * s;
    }
    const Vector2d eye = turned.in(view.eye.head<2>() - there.position());
    if (i == kSamples) {
      stances.mid_cosine = static_cast<float>(turned.cosine);
      stances.mid_sine = static_cast<float>(turned.sine);
      stances.mid_eye_x = static_cast<float>(eye.x());
      stances.mid_eye_y = static_cast<float>(eye.y());
      continue;
    }
    stances.cosine[i] = static_cast<float>(turned.cosine);
    stances.sine[i] = static_cast<float>(turned.sine);
    stances.eye_x[i] = static_cast<float>(eye.x());
    stances.eye_y[i] = static_cast<float>(eye.y());
  }
  stances.eye_z = static_cast<float>(view.eye.z());
  return stances;
}

void Placed::light_up(const View& view, std::vector<ShadowCaster> others) {
  same_light_ = unmoved_ && lit_ && others == others_;
  if (same_light_) return;
  lit_ = true;
  others_ = std::move(others);
  const Light& light = *view.light;
  const Vector3d middle(path_.middle.x, path_.middle.y, look_->bound().max.z());
  double factor = light.at(middle);
  for (std::size_t i = 0; i < light.lamps().size(); ++i) {
    float left = 1.0F;
    if (light.lamps()[i].position.z() <= middle.z() + 0.05) continue;
    const LampAbove lamp = lamp_above(light.lamps()[i], middle.z());
    for (const ShadowCaster& other : others_) {
      left *= 1.0F - hidden(other, lamp, static_cast<float>(middle.z()), all(static_cast<float>(middle.x())),
                            all(static_cast<float>(middle.y())))[0];
    }
    factor -= light.from_lamp(i, middle) * (1.0 - static_cast<double>(left));
  }
  light_reference_ = factor;
  paint_solids(view, factor);
  if (!look_->plate()) return;
  const double distance = (middle - view.eye).norm();
  print_level_ = look_->print().level_for(distance * view.sample_angle / look_->metres_per_px());
  std::vector<ShadowCaster> casters = others_;
  const double plate = look_->solids()[*look_->plate()].max.z();
  for (const ShadowCaster& own : casters_) {
    if (own.shape.high > static_cast<float>(plate) + 0.001F) casters.push_back(own);
  }
  light_plate(view, casters);
}

/// The solids' colours; `factor`: of the light where its upper side is.
void Placed::paint_solids(const View& view, double factor) {
  const Turn turn(path_.middle.yaw);
  const Light& light = *view.light;
  const auto in_map = [&](const Vector3d& p) {
    const Vector2d at = path_.middle.position() + turn.out(p.head<2>());
    return Vector3d(at.x(), at.y(), p.z());
  };
  const Vector3d middle(path_.middle.x, path_.middle.y, look_->bound().max.z());
  const Vector2d slope = turn.in(light.side_slope(middle));
  paints_.resize(look_->solids().size());
  for (std::size_t i = 0; i < paints_.size(); ++i) {
    const Solid& solid = look_->solids()[i];
    const Vector3d top =
        in_map({0.5 * (solid.min.x() + solid.max.x()), 0.5 * (solid.min.y() + solid.max.y()), solid.max.z()});
    const double added = large_ ? 0.0 : light.mirrored(top, (view.eye - top).normalized(), look_->gloss());
    const Bgr top_color = bgr(solid.top_rgb);
    const Bgr side_color = bgr(solid.side_rgb);
    for (int k = 0; k < 3; ++k) {
      const auto c = static_cast<std::size_t>(k);
      paints_[i].top[c] = static_cast<float>(factor) * top_color[k] + static_cast<float>(added);
      paints_[i].side[c] = static_cast<float>(factor * Light::kSide) * side_color[k];
      paints_[i].side_x[c] = static_cast<float>(factor * slope.x()) * side_color[k];
      paints_[i].side_y[c] = static_cast<float>(factor * slope.y()) * side_color[k];
    }
  }
}

/// Light changes slowly over a plate: it is worked out at a few places, and only what casters keep off at
/// each node.
void Placed::light_plate(const View& view, const std::vector<ShadowCaster>& casters) {
  constexpr int kCoarse = 5;  // intervals
  constexpr int kNodes = PlateLight::kNodes;
  constexpr int kFiner = (kNodes - 1) / kCoarse;
  constexpr std::size_t kMostLamps = 8;
  struct Node {
    Vector3d place;
    double everywhere = 0.0;
    std::array<double, kMostLamps> lamp{}, mirrored{};
  };
  const Light& light = *view.light;
  const std::size_t lamps = std::min(light.lamps().size(), kMostLamps);
  const Solid& plate = look_->solids()[*look_->plate()];
  const Turn turn(path_.middle.yaw);
  const Vector2d size = (plate.max - plate.min).head<2>();
  std::array<Node, (kCoarse + 1) * (kCoarse + 1)> coarse;
  for (std::size_t n = 0; n < coarse.size(); ++n) {
    const Vector2d share(static_cast<double>(n % (kCoarse + 1)) / kCoarse,
                         static_cast<double>(n / (kCoarse + 1)) / kCoarse);
    const Vector2d at = path_.middle.position() + turn.out(plate.min.head<2>() + share.cwiseProduct(size));
    Node& node = coarse[n];
    node.place = {at.x(), at.y(), plate.max.z()};
    node.everywhere = light.at(node.place);
    const Vector3d to_eye = (view.eye - node.place).normalized();
    for (std::size_t i = 0; i < lamps; ++i) {
      node.lamp[i] = light.from_lamp(i, node.place);
      node.everywhere -= node.lamp[i];
      node.mirrored[i] = light.mirrored(i, node.place, to_eye, look_->plate_gloss());
    }
  }
  PlateLight& out = plate_light_;
  out.x0 = static_cast<float>(plate.min.x());
  out.y0 = static_cast<float>(plate.min.y());
  out.per_x = static_cast<float>((kNodes - 1) / size.x());
  out.per_y = static_cast<float>((kNodes - 1) / size.y());
  const auto plane = static_cast<float>(plate.max.z());
  for (int j = 0; j < kNodes; ++j) {
    std::array<float, kNodes> x{};
    std::array<float, kNodes> y{};
    std::array<std::array<float, kNodes>, 2 * kMostLamps> parts{};  // lamps, then what they mirror
    std::array<float, kNodes> factor{};
    std::array<float, kNodes> added{};
    for (int i = 0; i < kNodes; ++i) {
      const int ci = std::min(i / kFiner, kCoarse - 1);
      const int cj = std::min(j / kFiner, kCoarse - 1);
      const double a = static_cast<double>(i) / kFiner - ci;
      const double b = static_cast<double>(j) / kFiner - cj;
      const Node* corner = &coarse[static_cast<std::size_t>(cj * (kCoarse + 1) + ci)];
      const auto between = [&](const auto& of) {
        return static_cast<float>((1.0 - b) * ((1.0 - a) * of(corner[0]) + a * of(corner[1])) +
                                  b * ((1.0 - a) * of(corner[kCoarse + 1]) + a * of(corner[kCoarse + 2])));
      };
      const auto at = static_cast<std::size_t>(i);
      x[at] = between([](const Node& n) { return n.place.x(); });
      y[at] = between([](const Node& n) { return n.place.y(); });
      factor[at] = between([](const Node& n) { return n.everywhere; });
      for (std::size_t l = 0; l < lamps; ++l) {
        parts[2 * l][at] = between([&](const Node& n) { return n.lamp[l]; });
        parts[2 * l + 1][at] = between([&](const Node& n) { return n.mirrored[l]; });
      }
    }
    for (std::size_t l = 0; l < lamps; ++l) {
      const bool above = light.lamps()[l].position.z() > plate.max.z() + 0.05;
      const LampAbove lamp = lamp_above(light.lamps()[l], plate.max.z());
      for (std::size_t i = 0; i < static_cast<std::size_t>(kNodes); i += kLanes) {
        F8 left = all(1.0F);
        for (const ShadowCaster& caster : casters) {
          if (above) left *= 1.0F - hidden(caster, lamp, plane, load(&x[i]), load(&y[i]));
        }
        store(&factor[i], load(&factor[i]) + left * load(&parts[2 * l][i]));
        store(&added[i], load(&added[i]) + left * load(&parts[2 * l + 1][i]));
      }
    }
    std::copy_n(factor.begin(), kNodes, out.factor.begin() + j * kNodes);
    std::copy_n(added.begin(), kNodes, out.added.begin() + j * kNodes);
  }
}

}  // namespace skylight::sim
