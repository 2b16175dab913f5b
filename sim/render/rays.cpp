#include "sim/render/rays.hpp"

#include <limits>

#include <opencv2/core/utility.hpp>

namespace skylight::sim {

RayField::RayField(const CameraModel& camera)
    : directions_(camera.parameters().height_px + 2, camera.parameters().width_px + 2, CV_32FC3) {
  const Eigen::Matrix3d turn = camera.map_from_camera().linear();
  cv::parallel_for_(cv::Range(0, directions_.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < directions_.cols; ++x) {
        const auto seen = camera.direction({x - 1.0, y - 1.0});
        constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
        const Eigen::Vector3d d = seen ? Eigen::Vector3d(turn * *seen) : Eigen::Vector3d::Constant(kNothing);
        directions_.at<cv::Vec3f>(y, x) = {static_cast<float>(d.x()), static_cast<float>(d.y()),
                                           static_cast<float>(d.z())};
      }
    }
  });
}

}  // namespace skylight::sim
