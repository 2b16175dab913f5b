#include "service/overlay.hpp"

#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace skylight::service {
namespace {

// Told apart by lightness too, for the colour-blind (Okabe and Ito 2008), BGR.
const cv::Scalar kTracking(115, 158, 0);
const cv::Scalar kPredicting(0, 159, 230);
const cv::Scalar kOther(0, 94, 213);

cv::Scalar colour_of(TrackState state) {
  if (state == TrackState::tracking) return kTracking;
  const bool carried_on = state == TrackState::predicting || state == TrackState::occluded;
  return carried_on ? kPredicting : kOther;
}

struct Painter {
  cv::Mat& image;
  const CameraModel& camera;
  double scale;

  std::optional<cv::Point> at(const Eigen::Vector2d& place, double height_m) const {
    const auto pixel = camera.pixel_from_map({place.x(), place.y(), height_m});
    if (!pixel || !camera.sees(*pixel, -200.0)) return std::nullopt;
    return cv::Point(static_cast<int>(std::lround((pixel->x() + 0.5) * scale - 0.5)),
                     static_cast<int>(std::lround((pixel->y() + 0.5) * scale - 0.5)));
  }
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double height_m,
            const cv::Scalar& colour) const {
    const auto from = at(a, height_m);
    const auto to = at(b, height_m);
    if (from && to) cv::line(image, *from, *to, colour, 2, cv::LINE_AA);
  }
};

void draw_robot(const Painter& painter, const RobotSnapshot& robot, const Pose2& pose) {
  const RobotSpec& spec = *robot.spec;
  const double height = seen_height_m(spec);
  const cv::Scalar colour = colour_of(robot.view.state);
  const Eigen::Rotation2Dd turn(pose.yaw);
  const Eigen::Vector2d half = seen_size_m(spec) / 2;
  const auto place = [&](double forward, double left) -> Eigen::Vector2d {
    return pose.position() +
           turn * (seen_centre_m(spec) + Eigen::Vector2d(forward * half.x(), left * half.y()));
  };
  constexpr std::array<std::array<double, 2>, 4> kCorners{{{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& a = kCorners[i];
    const auto& b = kCorners[(i + 1) % 4];
    painter.line(place(a[0], a[1]), place(b[0], b[1]), height, colour);
  }
  painter.line(place(0, 0), place(1.6, 0), height, colour);
  painter.line(place(1.6, 0), place(1.3, 0.25), height, colour);
  painter.line(place(1.6, 0), place(1.3, -0.25), height, colour);
  if (const auto label = painter.at(place(0, 0), height)) {
    const cv::Point corner =
        *label + cv::Point(static_cast<int>(painter.scale * 30), static_cast<int>(painter.scale * 40));
    const std::string text = robot.view.id + " " + std::string(to_string(robot.view.state));
    cv::putText(painter.image, text, corner, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar::all(0), 3,
                cv::LINE_AA);
    cv::putText(painter.image, text, corner, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar::all(255), 1,
                cv::LINE_AA);
  }
}

}  // namespace

cv::Mat draw_overlay(const Snapshot& snapshot, const CameraSnapshot& camera, int width_px) {
  cv::Mat image;
  const double scale = width_px > 0 ? static_cast<double>(width_px) / camera.image.cols : 1.0;
  cv::resize(camera.image, image, {}, scale, scale, cv::INTER_AREA);
  if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  const Painter painter{image, *camera.model, scale};
  for (const RobotSnapshot& robot : snapshot.robots) {
    if (robot.view.history.empty()) continue;
    const HistoryEntry& entry = robot.view.history.newest();
    if (entry.measured) {
      draw_robot(painter, robot, entry.measured->pose);
    } else if (entry.filtered) {
      draw_robot(painter, robot, entry.filtered->pose);
    }
  }
  return image;
}

}  // namespace skylight::service
