// What a body looks like: its solids, and the picture laid on one of them.
#pragma once

#include <optional>
#include <vector>

#include "sim/render/print.hpp"
#include "sim/render/textures.hpp"
#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {

/// How a robot looks: its solids, and the picture on its plate.
struct RobotLook {
  const RobotModel* model = nullptr;
  Texture picture;
  double metres_per_px = 0.001;
};

/// A picture on the upper side of the body's solid that `carries_picture`. Picture up is the body's +x,
/// picture left its +y; its middle lies in the middle of `area`; beyond it the solid's own colour shows.
struct Decal {
  Texture texture;
  Rectangle area{{0.0, 0.0}, {0.0, 0.0}};  ///< body frame
  double metres_per_px = 0.001;            ///< of the texture
  double gloss = 0.02;                     ///< share of the lamps' light that it mirrors, 0 to 1
};

/// Body frame: on the floor, z up. Solids in any order, at most 16.
struct Body {
  std::vector<Solid> solids;
  std::optional<Decal> decal;
  double gloss = 0.0;  ///< of all other upper sides
};

/// A shape that stands for one or more solids where light is kept off: upright, with its axes those of the
/// body.
struct Caster {
  bool round = false;
  float x = 0.0F, y = 0.0F;            ///< of its middle, body frame
  float half_x = 0.0F, half_y = 0.0F;  ///< round: both its radius
  float low = 0.0F, high = 0.0F;       ///< m above the floor
  bool operator==(const Caster&) const = default;
};

/// A body prepared for drawing, once; what looks the same shares it.
class Look {
 public:
  /// Throws std::invalid_argument where there are no solids, more than 16, or a decal without a solid for it.
  explicit Look(Body body);

  const std::vector<Solid>& solids() const { return solids_; }  ///< highest top first
  double gloss() const { return gloss_; }
  const Solid& bound() const { return bound_; }  ///< one box around all of them
  const std::vector<Caster>& casters() const { return casters_; }

  /// Index of the solid with the picture, none without one; then the rest holds.
  std::optional<std::size_t> plate() const { return plate_; }
  double plate_gloss() const { return plate_gloss_; }
  const Print& print() const { return print_; }
  double metres_per_px() const { return metres_per_px_; }
  /// Of the full print: column = origin.x - y / metres_per_px, row = origin.y - x / metres_per_px.
  const Eigen::Vector2d& print_origin() const { return print_origin_; }
  /// What counts as seen: the decal, or without one the highest top.
  const Rectangle& seen_area() const { return seen_area_; }
  double seen_height() const { return seen_height_; }

 private:
  void lay(const Decal& decal);

  std::vector<Solid> solids_;
  double gloss_ = 0.0;
  Solid bound_;
  std::vector<Caster> casters_;
  std::optional<std::size_t> plate_;
  double plate_gloss_ = 0.0;
  Print print_;
  double metres_per_px_ = 0.001;
  Eigen::Vector2d print_origin_{0.0, 0.0};
  Rectangle seen_area_{{0.0, 0.0}, {0.0, 0.0}};
  double seen_height_ = 0.0;
};

/// A robot with its picture as it comes from the artwork.
Body body_of(const RobotLook& robot);

}  // namespace skylight::sim
