// An actor in one frame: how it moves through the exposure, which pixels it may cover, its colours in the
// light where it stands.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "sim/camera/camera_model.hpp"
#include "sim/render/lanes.hpp"
#include "sim/render/light.hpp"
#include "sim/render/look.hpp"
#include "sim/render/outline.hpp"
#include "sim/render/rays.hpp"
#include "sim/render/shadow.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Where an actor is, `since_midpoint` seconds from the frame's midpoint; none: not there. Asked by several
/// threads at once.
using PoseAt = std::function<std::optional<Pose2>(std::size_t actor, double since_midpoint)>;

/// When the rows of a frame are exposed.
struct Exposure {
  double exposure_s = 0.008;
  double readout_s = 0.0;  ///< from the first row's to the last row's; 0: all at once
  int height_px = 1080;

  /// Middle of a row's exposure, seconds from the frame's midpoint.
  double row(double y) const {
    return height_px > 1 ? (y - 0.5 * (height_px - 1)) / (height_px - 1) * readout_s : 0.0;
  }
};

/// The motion through a short time: the quadratic through its beginning, middle and end.
struct ExposurePath {
  double middle_s = 0.0;
  double half_s = 1.0;
  Pose2 middle;
  Eigen::Vector3d rate{0.0, 0.0, 0.0};  ///< x, y, yaw per half_s
  Eigen::Vector3d bend{0.0, 0.0, 0.0};  ///< and per its square

  Pose2 at(double since_midpoint) const {
    const double s = (since_midpoint - middle_s) / half_s;
    const Eigen::Vector3d d = s * (rate + s * bend);
    return {middle.x + d.x(), middle.y + d.y(), middle.yaw + d.z()};
  }
  bool still() const { return rate.isZero(0.0) && bend.isZero(0.0); }
};

/// body_from_map in one row: at the samples' moments, and in their middle.
struct Stances {
  std::array<float, kSamples> cosine{}, sine{}, eye_x{},
      eye_y{};  ///< of the yaw; the camera in the body frame
  float eye_z = 0.0F;
  float mid_cosine = 1.0F, mid_sine = 0.0F, mid_eye_x = 0.0F, mid_eye_y = 0.0F;
};

/// Grey levels of a solid's faces where it stands.
struct Paint {
  std::array<float, 3> top{};
  std::array<float, 3> side{};    ///< that faces no way in particular
  std::array<float, 3> side_x{};  ///< and for a normal along x and y of the body, more
  std::array<float, 3> side_y{};
};

/// The light on a plate: factor on its colours and grey levels added to them, on a grid.
struct PlateLight {
  static constexpr int kNodes = 16;
  std::array<float, kNodes * kNodes> factor{};
  std::array<float, kNodes * kNodes> added{};
  float x0 = 0.0F, y0 = 0.0F;                       ///< of the first node, body frame
  float per_x = 1.0F, per_y = 1.0F;                 ///< nodes per metre
  std::array<float, 2> at(float x, float y) const;  ///< factor, added
};

/// A camera and the light, as all actors see them.
struct View {
  const CameraModel* camera = nullptr;
  const Light* light = nullptr;
  Exposure exposure;
  Eigen::Vector3d eye{0.0, 0.0, 0.0};
  double sample_angle = 0.0;            ///< between neighbouring samples in the picture's middle, radians
  Eigen::Vector2d room_half{0.0, 0.0};  ///< nothing throws shadows beyond
};

/// Where the shadow of one lamp (or, without one, of the light from everywhere) may fall.
struct ShadowArea {
  std::optional<std::size_t> lamp;
  Outline outline;
};

class Placed {
 public:
  /// Finds out where it is; false where it is not there or cannot be seen, not even its shadow. Quick where
  /// it has been still ever since it was placed the last time; then the view must be the same, or forget().
  bool place(const View& view, const Look& look, std::size_t actor, const PoseAt& pose);
  /// The colours. `others`: what may keep lamps' light off its upper side.
  void light_up(const View& view, std::vector<ShadowCaster> others);
  /// To be placed and lit anew whatever it was like before.
  void forget() { known_ = lit_ = false; }
  /// Where it was and lit as it was in the frame before, all through the exposure.
  bool same_as_before() const { return unmoved_ && (same_light_ || !body_seen()); }

  std::size_t actor() const { return actor_; }
  const Look& look() const { return *look_; }
  const ExposurePath& path() const { return path_; }
  bool body_seen() const { return body_rows_.end > body_rows_.begin; }
  const Span& body_rows() const { return body_rows_; }
  const Span& body_columns() const { return body_columns_; }
  /// Every pixel that it or one of its shadows may touch, and what lies in between.
  const Outline& area() const { return area_; }
  const Outline& outer(std::size_t solid) const { return outer_[solid]; }
  const Outline& inner(std::size_t solid) const { return inner_[solid]; }
  const Paint& paint(std::size_t solid) const { return paints_[solid]; }
  const PlateLight& plate_light() const { return plate_light_; }
  int print_level() const { return print_level_; }
  const std::vector<ShadowArea>& shadows() const { return shadows_; }
  const std::vector<ShadowCaster>& casters() const { return casters_; }
  /// Its stances in a row.
  const Stances& stances(const View& view, int y, Stances& scratch) const;
  /// Light changes along it: `light_reference()` is the factor that its paints contain.
  bool is_large() const { return large_; }
  double light_reference() const { return light_reference_; }

 private:
  bool find_path(const View& view, const PoseAt& pose);
  void find_times(const View& view, const Pose2& now);
  void lay_out(const View& view);
  void paint_solids(const View& view, double factor);
  void outline_solids(const View& view);
  void outline_shadows(const View& view);
  void light_plate(const View& view, const std::vector<ShadowCaster>& casters);
  Stances make_stances(const View& view, int y) const;

  const Look* look_ = nullptr;
  std::size_t actor_ = 0;
  bool known_ = false, unmoved_ = false;   ///< placed before; and in the same place
  bool lit_ = false, same_light_ = false;  ///< lit before; and by the same light
  std::optional<Pose2> now_;               ///< at the frame's midpoint
  double begin_s_ = 0.0, end_s_ = 0.0;     ///< of the exposure of the rows that may show it then
  ExposurePath path_;
  double moved_px_ = 0.0;
  Span body_rows_, body_columns_;
  std::vector<Outline> outer_, inner_;
  Outline area_;
  std::vector<Paint> paints_;
  std::vector<ShadowArea> shadows_;
  std::vector<ShadowCaster> casters_, others_;
  PlateLight plate_light_;
  int print_level_ = 0;
  bool same_in_all_rows_ = true;
  Stances stances_;
  bool large_ = false;
  double light_reference_ = 1.0;
};

}  // namespace skylight::sim
