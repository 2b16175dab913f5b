// The part of a camera's picture that does not move: floor, walls, what lies outside. Drawn once.
#pragma once

#include <opencv2/core/mat.hpp>

#include "sim/camera/noise.hpp"
#include "sim/render/light.hpp"
#include "sim/render/rays.hpp"
#include "sim/render/textures.hpp"

namespace skylight::sim {

struct StandingPicture {
  cv::Mat mean;    ///< CV_16UC3, 1/128 grey
  cv::Mat metres;  ///< CV_32FC1, z-depth at the pixel centres; 0: nothing there
  cv::Mat floor;   ///< CV_8UC1, 1 where the pixel centre sees the floor within the walls
};

/// What a pixel is written with: grey levels to the fixed point of the noise functions.
void put_pixel(cv::Mat& mean, const cv::Point& pixel, const Bgr& grey);

struct StandingScene {
  const RoomSpec& room;
  const FloorTexture& floor;
  const Light& light;
};

StandingPicture draw_standing(const StandingScene& scene, const CameraModel& camera, const RayField& rays);

}  // namespace skylight::sim
