// The part of a camera's picture that does not move. First the bare floor, drawn once per camera pose; the
// walls and whatever else stands still are put onto it as the moving actors are in every frame (rows.hpp).
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include "sim/render/light.hpp"
#include "sim/render/look.hpp"
#include "sim/render/rays.hpp"
#include "sim/render/textures.hpp"

namespace skylight::sim {

struct StandingPicture {
  cv::Mat mean;    ///< CV_16UC3, 1/128 grey
  cv::Mat metres;  ///< CV_32FC1, z-depth at the pixel centres; 0: nothing there
  cv::Mat floor;   ///< CV_8UC1, 1 where the pixel centre sees the floor within the walls
  /// CV_32FC1 for each lamp: the share of the pixel's light that comes from it, 0 off the floor.
  std::vector<cv::Mat> shares;

  StandingPicture clone() const;
};

struct StandingScene {
  const RoomSpec& room;
  const FloorTexture& floor;
  const Light& light;
};

/// The floor without walls, shadows and things.
StandingPicture draw_floor(const StandingScene& scene, const CameraModel& camera, const RayField& rays);

/// The walls as a body in `map`; none where they have no height.
std::optional<Body> make_walls(const RoomSpec& room);

}  // namespace skylight::sim
