// From the room and the robots' poses to the light on a camera's sensor.
//
// The standing scene (floor, walls) is drawn once per camera. In every frame only the robots' surroundings
// are traced: sixteen rays a pixel, spread over the pixel's area and, with them, over the exposure, so that
// edges and motion blur are the mean over both. Sampling is symmetric about the pixel's centre and the
// exposure's midpoint: it shifts nothing.
//
// The sensor is linear: grey levels are proportional to light (no gamma), as EMVA 1288 has it.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sim/camera_model.hpp"
#include "sim/noise.hpp"
#include "sim/robot_model.hpp"
#include "sim/scenario.hpp"
#include "sim/solids.hpp"
#include "sim/textures.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// How a robot looks: its solids, and the picture on its plate.
struct RobotLook {
  const RobotModel* model = nullptr;
  Texture picture;
  double metres_per_px = 0.001;
};

/// Where robots are during one exposure.
struct Exposure {
  /// Pose of a robot at a share of the exposure, 0 to 1; 0.5 is the midpoint.
  std::function<Pose2(std::size_t robot, double share)> pose;
};

class Renderer {
 public:
  /// The scene as it stands in the scenario, for one of its cameras. Draws the standing scene.
  Renderer(const Scenario& scenario, const CameraSpec& camera, const FloorTexture& floor);

  /// Draws the robots; the results are valid until the next call.
  void draw(const std::vector<RobotLook>& robots, const Exposure& exposure);

  const cv::Mat& mean() const { return mean_; }    ///< CV_16UC3, 1/128 grey
  const cv::Mat& scale() const { return scale_; }  ///< CV_16UC3, SensorNoise::scale() of the mean
  const cv::Mat& metres() const {
    return metres_;
  }  ///< CV_32FC1, z-depth; 0 = nothing there; empty without depth
  const CameraModel& camera() const { return camera_; }

 private:
  struct Placed;
  void cast_rays();
  void draw_standing_row(const std::vector<Solid>& walls, const FloorTexture& floor, int row);
  void restore();
  void draw_region(const std::vector<Placed>& placed, std::size_t index);
  void draw_pixel(const std::vector<const Placed*>& candidates, int x, int y);
  Bgr shade(const Placed& placed, const Ray& ray, const Hit& hit) const;
  float light_at(double x, double y) const;
  float vignette(int x, int y) const;
  void put(int x, int y, const Bgr& grey);

  Scenario scenario_;
  CameraSpec spec_;
  CameraModel camera_;
  SensorNoise noise_;
  Eigen::Vector3d eye_;   ///< the camera in `map`
  Eigen::Vector3d axis_;  ///< its optical axis in `map`
  cv::Mat rays_;          ///< CV_64FC3, (height + 2) x (width + 2): directions in `map` at the pixel centres
  cv::Mat standing_mean_, standing_scale_, standing_metres_, standing_floor_;
  cv::Mat mean_, scale_, metres_;
  std::vector<cv::Rect> drawn_;  ///< regions that differ from the standing scene
};

}  // namespace skylight::sim
