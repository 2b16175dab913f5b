// From the actors' poses to the light on a camera's sensor.
//
// In every frame only the actors' surroundings are traced, over the standing picture: sixteen rays a pixel,
// spread over the pixel's area and, with it, over the exposure of its row, so that edges and motion blur are
// the mean over both. Sampling is symmetric about the pixel's centre and the exposure's midpoint: it shifts
// nothing. Shadows and mirrored lamps are soft; they are worked out once a pixel, or on a grid over a plate.
//
// The sensor is linear: grey levels are proportional to light (no gamma), as EMVA 1288 has it. The light is
// nominal here: level 1, no flicker.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sim/camera/camera_model.hpp"
#include "sim/render/light.hpp"
#include "sim/render/look.hpp"
#include "sim/render/placed.hpp"
#include "sim/render/rays.hpp"
#include "sim/render/rows.hpp"
#include "sim/render/standing.hpp"
#include "sim/scenario/scenario.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Anything in the room besides floor and walls as it is drawn: a robot, a thing, somebody. Without a look it
/// is never seen.
struct SceneActor {
  std::shared_ptr<const Look> look;
  bool fixed = false;  ///< never moves (a beam, an obstacle): drawn into the standing picture
};

class Renderer {
 public:
  /// The scene as it stands in the scenario, for one of its cameras, without actors. Draws the standing
  /// picture.
  Renderer(const Scenario& scenario, const CameraSpec& camera, const FloorTexture& floor);

  // A copy's pictures would be the same memory.
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  Renderer(Renderer&&) = default;
  Renderer& operator=(Renderer&&) = default;
  ~Renderer() = default;

  /// What there is besides the room, from now on called by its place in this list; `now` is asked where the
  /// fixed ones are. Draws the standing picture again if it changes.
  void set_actors(std::vector<SceneActor> actors, const PoseAt& now);
  /// The actor looks otherwise from now on. Quick, unless it is a fixed one. Throws std::out_of_range.
  void set_look(std::size_t actor, std::shared_ptr<const Look> look);
  /// The camera hangs otherwise from now on: draws the standing picture again.
  void move_camera(const Eigen::Isometry3d& map_from_camera);
  /// Bands of shadow in the following frames; they cost time only while there are some.
  void set_passing_shadow(std::vector<PassingShadow> shadows);

  /// Draws a frame; its results are valid until the next call of a function that is not const.
  void draw(const PoseAt& pose);

  const cv::Mat& mean() const { return mean_; }  ///< CV_16UC3, 1/128 grey
  const cv::Mat& metres() const {
    return metres_;
  }  ///< CV_32FC1, z-depth; 0: nothing there; empty without depth

  /// Share of the actor's decal (or, without one, of its highest upper side) that the camera saw in the last
  /// frame, 0 to 1: within the picture and not hidden by another actor or a wall. Throws std::out_of_range.
  double visible(std::size_t actor) const;
  /// When the row that sees the middle of that area was exposed, in seconds from the frame's midpoint; 0
  /// where no row does. Throws std::out_of_range.
  double row_offset(std::size_t actor) const;

  const CameraModel& camera() const { return camera_; }

 private:
  void draw_floor_again();
  void draw_standing_again();
  Scene scene() const;
  void place_all(const PoseAt& pose);
  void find_kept();
  std::vector<ShadowCaster> casters_above(const Placed& placed) const;
  bool hides(const Placed& other, const Eigen::Vector3d& place, double since_midpoint) const;

  RoomSpec room_;
  FloorTexture floor_;
  CameraModel camera_;
  Light light_;
  Exposure exposure_;
  double contact_shadow_;
  double sample_angle_;  ///< between neighbouring samples in the picture's middle, radians
  RayField rays_;
  StandingPicture bare_;      ///< the floor alone
  StandingPicture standing_;  ///< with walls and fixed actors
  std::vector<SceneActor> actors_;
  std::vector<std::optional<Pose2>> fixed_at_;  ///< by actor
  std::shared_ptr<const Look> walls_;           ///< none where there are none
  std::vector<Placed> fixed_;                   ///< as they stand, the walls first
  std::vector<Placed> places_;                  ///< by actor, of the last frame
  std::vector<bool> is_placed_;
  std::vector<PassingShadow> passing_;
  cv::Mat mean_, metres_;
  std::vector<std::vector<Change>> changed_;  ///< by row: what differs from the standing picture
  std::vector<Outline> drawn_;                ///< by actor: where the last frame shows it
  std::vector<bool> kept_;                    ///< by actor: what the last frame shows of it is right
  bool was_passed_ = false;                   ///< a passing shadow darkened the last frame
};

}  // namespace skylight::sim
