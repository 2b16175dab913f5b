// The tracker by itself: a drawn picture is followed over two frames of a camera 2 m above the floor.
#include <cstdio>

#include <tracker/tracker.hpp>

using namespace skylight;

namespace {

// At 2 m under 500 px of focal length a pixel of the floor is 4 mm wide, and so is one of the picture.
Frame frame_with(const cv::Mat& picture, int column, int row, Time captured) {
  Frame frame{.captured = captured, .image = cv::Mat(480, 640, CV_8UC1, cv::Scalar(120))};
  picture.copyTo(frame.image(cv::Rect(column, row, picture.cols, picture.rows)));
  return frame;
}

}  // namespace

int main() {
  cv::Mat picture(41, 41, CV_8UC1, cv::Scalar(230));
  picture(cv::Rect(4, 4, 12, 20)) = 20;
  picture(cv::Rect(24, 20, 10, 16)) = 60;
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  map_from_camera.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();  // straight down, image right is map x
  map_from_camera.translation().z() = 2.0;
  const Intrinsics lens{
      .width_px = 640, .height_px = 480, .fx_px = 500, .fy_px = 500, .cx_px = 320, .cy_px = 240};
  Tracker tracker({CameraModel(lens, map_from_camera)});
  // The picture's forward is up the image: map y, so yaw is a quarter turn.
  tracker.add({.id = "robot",
               .appearance = std::make_shared<const Appearance>(
                   "drawn", Picture{.image = picture, .metres_per_pixel = 0.004}),
               .initial_pose = Pose2{0.0, 0.0, 1.57}});
  tracker.process(frame_with(picture, 300, 220, Time{}));
  const auto reports = tracker.process(frame_with(picture, 303, 218, Time{std::chrono::milliseconds(33)}));
  const auto& seen = reports.at(0).measured;
  if (!seen) return 1;
  std::printf("x %.4f y %.4f yaw %.4f\n", seen->pose.x, seen->pose.y, seen->pose.yaw);
  const bool right = (seen->pose.position() - Eigen::Vector2d(0.012, 0.008)).norm() < 0.0005 &&
                     std::abs(wrap_angle(seen->pose.yaw - std::numbers::pi / 2)) < 0.005;
  return right ? 0 : 1;
}
