// From the robots' poses to the light on a camera's sensor.
//
// In every frame only the robots' surroundings are traced, over the standing picture: sixteen rays a pixel,
// spread over the pixel's area and, with it, over the exposure, so that edges and motion blur are the mean
// over both. Sampling is symmetric about the pixel's centre and the exposure's midpoint: it shifts nothing.
//
// The sensor is linear: grey levels are proportional to light (no gamma), as EMVA 1288 has it.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sim/camera/camera_model.hpp"
#include "sim/camera/noise.hpp"
#include "sim/render/light.hpp"
#include "sim/render/rays.hpp"
#include "sim/render/solids.hpp"
#include "sim/render/standing.hpp"
#include "sim/render/textures.hpp"
#include "sim/scenario/robot_model.hpp"
#include "sim/scenario/scenario.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// How a robot looks: its solids, and the picture on its plate.
struct RobotLook {
  const RobotModel* model = nullptr;
  Texture picture;
  double metres_per_px = 0.001;
};

/// Pose of a robot at a share of the exposure, 0 to 1; 0.5 is the midpoint.
using PoseDuring = std::function<Pose2(std::size_t robot, double share)>;

class Renderer {
 public:
  /// The scene as it stands in the scenario, for one of its cameras. Draws the standing picture.
  Renderer(const Scenario& scenario, const CameraSpec& camera, const FloorTexture& floor);

  /// Draws the robots; the results are valid until the next call.
  void draw(const std::vector<RobotLook>& robots, const PoseDuring& pose);

  const cv::Mat& mean() const { return mean_; }  ///< CV_16UC3, 1/128 grey
  const cv::Mat& metres() const {
    return metres_;
  }  ///< CV_32FC1, z-depth; 0 = nothing there; empty without depth
  const CameraModel& camera() const { return camera_; }

 private:
  struct Placed;
  struct Candidate;
  struct Seen;
  void restore();
  Placed place(const RobotLook& look, std::size_t index, const PoseDuring& pose) const;
  void draw_region(const std::vector<Placed>& placed, std::size_t index);
  static void gather(const std::vector<const Placed*>& robots, const PixelRays& pixel,
                     std::vector<Candidate>& candidates);
  void draw_pixel(const std::vector<const Placed*>& robots, std::vector<Candidate>& candidates,
                  const cv::Point& at);
  Bgr behind(const std::vector<const Placed*>& robots, const Eigen::Vector3d& direction,
             const cv::Point& at) const;
  Seen trace(const std::vector<Candidate>& candidates, std::size_t sample, const Eigen::Vector3d& direction,
             double limit) const;
  Bgr shade(const Seen& seen) const;
  Bgr plate(const Placed& robot, const Eigen::Vector3d& at) const;
  static bool only_plate(const Candidate& candidate, const Eigen::Vector3d& direction);
  Bgr plate_sum(const Candidate& candidate, const PixelRays& pixel) const;
  double shadow(const std::vector<const Placed*>& robots, const Eigen::Vector3d& direction) const;

  CameraModel camera_;
  Light light_;
  RayField rays_;
  StandingPicture standing_;
  double contact_shadow_;
  double sample_angle_;   ///< between neighbouring samples in the picture's middle, radians
  Eigen::Vector3d eye_;   ///< the camera in `map`
  Eigen::Vector3d axis_;  ///< its optical axis in `map`
  cv::Mat mean_, metres_;
  std::vector<cv::Rect> drawn_;  ///< regions that differ from the standing picture
};

}  // namespace skylight::sim
