#include "service/mot.hpp"

#include <cstdio>

#include <Eigen/Geometry>

namespace skylight::service {
namespace {

std::string line_start(std::uint64_t sequence, std::size_t robot, const cv::Rect2d& box) {
  char out[160];
  std::snprintf(out, sizeof out, "%llu,%zu,%.2f,%.2f,%.2f,%.2f,",
                static_cast<unsigned long long>(sequence) + 1, robot + 1, box.x + 1.5, box.y + 1.5, box.width,
                box.height);
  return out;
}

}  // namespace

std::string mot_truth_line(std::uint64_t sequence, std::size_t robot, const Truth& truth) {
  char visibility[32];
  std::snprintf(visibility, sizeof visibility, "1,1,%.3f\n", truth.visible);
  return line_start(sequence, robot, *truth.box_px) + visibility;
}

std::string mot_result_line(const Frame& frame, std::size_t robot, const RobotSpec& spec, const Pose2& pose,
                            const CameraModel& camera) {
  const double height = seen_height_m(spec);
  const Eigen::Vector2d half = 0.5 * seen_size_m(spec);
  Eigen::AlignedBox2d box;
  for (const double x : {-half.x(), half.x()}) {
    for (const double y : {-half.y(), half.y()}) {
      const Eigen::Vector2d on_robot = seen_centre_m(spec) + Eigen::Vector2d(x, y);
      const Eigen::Vector2d at = pose.position() + Eigen::Rotation2Dd(pose.yaw) * on_robot;
      if (const auto pixel = camera.pixel_from_map({at.x(), at.y(), height})) box.extend(*pixel);
    }
  }
  const Intrinsics& in = camera.intrinsics();
  const Eigen::AlignedBox2d picture(Eigen::Vector2d(-0.5, -0.5),
                                    Eigen::Vector2d(in.width_px - 0.5, in.height_px - 0.5));
  if (box.isEmpty()) return {};
  const Eigen::AlignedBox2d seen = box.intersection(picture);
  if (seen.isEmpty() || seen.volume() <= 0.0) return {};
  char place[96];
  std::snprintf(place, sizeof place, "1,%.6f,%.6f,0\n", pose.x, pose.y);
  return line_start(frame.sequence, robot,
                    {seen.min().x(), seen.min().y(), seen.sizes().x(), seen.sizes().y()}) +
         place;
}

}  // namespace skylight::service
