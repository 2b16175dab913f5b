#include "sim/render/rays.hpp"

#include <limits>

#include <opencv2/core/utility.hpp>

namespace skylight::sim {

RayField::RayField(const CameraModel& camera) {
  const cv::Size size(camera.parameters().width_px + 10, camera.parameters().height_px + 2);
  for (cv::Mat& plane : planes_) plane.create(size, CV_32FC1);
  const Eigen::Matrix3d turn = camera.map_from_camera().linear();
  cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const auto seen = camera.direction({x - 1.0, y - 1.0});
        constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
        const Eigen::Vector3d d = seen ? Eigen::Vector3d(turn * *seen) : Eigen::Vector3d::Constant(kNothing);
        for (std::size_t i = 0; i < 3; ++i)
          planes_[i].at<float>(y, x) = static_cast<float>(d[static_cast<Eigen::Index>(i)]);
      }
    }
  });
}

}  // namespace skylight::sim
