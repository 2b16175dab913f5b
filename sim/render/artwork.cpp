#include "sim/render/artwork.hpp"

#include <cmath>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "sim/render/textures.hpp"
#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {
namespace {

constexpr double kPrintResolution = 0.001;  ///< metres per pixel of drawn pictures
constexpr double kLidarMargin = 0.003;      ///< m around the tower that no picture covers

/// Makes the picture transparent where the lidar tower stands.
void cut_out_lidar(RobotPicture& picture, const RobotModel& model) {
  const double mpp = picture.metres_per_pixel;
  const Eigen::Vector2d at =
      model.lidar_m + picture.reference_point_m;  // from the image's centre, robot axes
  const double reach = model.lidar_radius_m + kLidarMargin;
  for (int r = 0; r < picture.image.rows; ++r) {
    for (int c = 0; c < picture.image.cols; ++c) {
      const double x = (0.5 * (picture.image.rows - 1) - r) * mpp - at.x();
      const double y = (0.5 * (picture.image.cols - 1) - c) * mpp - at.y();
      if (x * x + y * y <= reach * reach) picture.image.at<cv::Vec4b>(r, c)[3] = 0;
    }
  }
}

}  // namespace

RobotPicture make_picture(const Scenario& scenario, std::size_t robot) {
  const RobotSpec& spec = scenario.robots.at(robot);
  const RobotModel& model = robot_model(spec.model);
  const Eigen::Vector2d plate = model.plate.max - model.plate.min;  // forward, left
  const std::string key = "robots[" + std::to_string(robot) + "].picture";
  const double width = spec.picture.width_m.value_or(plate.y());
  RobotPicture picture;
  if (spec.picture.file.empty()) {
    const std::uint64_t seed = spec.picture.seed != 0 ? spec.picture.seed : robot + 1;
    const int size = static_cast<int>(std::lround(width / kPrintResolution));
    picture.image = draw_robot_picture(seed, size);
  } else {
    picture.image = load_picture(scenario.folder, spec.picture.file, key + ".file");
  }
  if (picture.image.channels() == 3) cv::cvtColor(picture.image, picture.image, cv::COLOR_BGR2BGRA);
  picture.metres_per_pixel = width / picture.image.cols;
  if (picture.image.rows * picture.metres_per_pixel > plate.x() + 1e-6 || width > plate.y() + 1e-6) {
    throw std::invalid_argument(key + ": " + std::to_string(picture.image.rows * picture.metres_per_pixel) +
                                " m long and " + std::to_string(width) + " m wide does not fit the plate (" +
                                std::to_string(plate.x()) + " x " + std::to_string(plate.y()) + " m)");
  }
  picture.surface_height_m = model.plate_height_m;
  picture.reference_point_m = -0.5 * (model.plate.min + model.plate.max);
  cut_out_lidar(picture, model);
  return picture;
}

RobotLook make_look(const RobotSpec& robot, const RobotPicture& picture) {
  const RobotModel& model = robot_model(robot.model);
  Bgr plate_color = Bgr::Zero();
  for (const Solid& solid : model.solids) {
    if (solid.carries_picture) plate_color = bgr(solid.top_rgb);
  }
  cv::Mat opaque(picture.image.size(), CV_8UC3);
  for (int r = 0; r < opaque.rows; ++r) {
    for (int c = 0; c < opaque.cols; ++c) {
      const auto& from = picture.image.at<cv::Vec4b>(r, c);
      const float alpha = static_cast<float>(from[3]) / 255.0F;
      for (int k = 0; k < 3; ++k) {
        opaque.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(alpha * static_cast<float>(from[k]) +
                                                                        (1.0F - alpha) * plate_color[k]);
      }
    }
  }
  return {&model, Texture(opaque, false), picture.metres_per_pixel};
}

}  // namespace skylight::sim
