// A scene for tests of the detectors, drawn without any code of the tracker: a floor, and pictures lying on
// planes above it, under a pinhole camera that looks straight down.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"

namespace skylight::test {

/// A picture of many corners, different for each seed; BGR.
inline cv::Mat corner_picture(std::uint32_t seed, int side_px = 240) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> level(0, 255);
  std::uniform_int_distribution<int> place(0, side_px - 1);
  std::uniform_int_distribution<int> size(side_px / 12, side_px / 4);
  cv::Mat image(side_px, side_px, CV_8UC3, cv::Scalar(210, 210, 210));
  for (int i = 0; i < 40; ++i) {
    const cv::Scalar colour(level(random), level(random), level(random));
    const cv::Point at(place(random), place(random));
    cv::rectangle(image, cv::Rect(at, cv::Size(size(random), size(random))), colour, cv::FILLED);
  }
  return image;
}

/// Two flat patches of colour on black, as robot-soccer teams use them.
inline cv::Mat patch_picture(const cv::Scalar& first, const cv::Scalar& second, int side_px = 120) {
  cv::Mat image(side_px, side_px, CV_8UC3, cv::Scalar(35, 40, 38));
  const int half = side_px / 2;
  cv::rectangle(image, cv::Rect(side_px / 10, side_px / 10, half - side_px / 10, half - side_px / 10), first,
                cv::FILLED);
  cv::rectangle(image, cv::Rect(half, half, half - side_px / 10, half - side_px / 10), second, cv::FILLED);
  return image;
}

struct PlacedPicture {
  cv::Mat image;  ///< CV_8UC3, its centre at base_link
  double metres_per_pixel = 0.001;
  double height_m = 0.1;
  Pose2 pose;
};

struct FlatScene {
  int width_px = 640;
  int height_px = 480;
  double focal_px = 500.0;
  double camera_height_m = 3.0;
  double noise = 0.0;  ///< standard deviation, grey levels
  double gain = 1.0;   ///< of the light
  double bias = 0.0;
  int floor_speckle = 0;  ///< number of dark and light specks
  std::uint32_t seed = 1;
  std::vector<PlacedPicture> pictures;
  std::vector<cv::Rect> covers_px;  ///< drawn over everything, dark red

  CameraModel camera() const {
    Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
    map_from_camera.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    map_from_camera.translation() = Eigen::Vector3d(0, 0, camera_height_m);
    return CameraModel({.width_px = width_px,
                        .height_px = height_px,
                        .fx_px = focal_px,
                        .fy_px = focal_px,
                        .cx_px = (width_px - 1) / 2.0,
                        .cy_px = (height_px - 1) / 2.0},
                       map_from_camera);
  }

  double metres_per_px(double height_m) const { return (camera_height_m - height_m) / focal_px; }
  Pixel pixel(double x, double y, double height_m) const {
    const double scale = 1.0 / metres_per_px(height_m);
    return {(width_px - 1) / 2.0 + x * scale, (height_px - 1) / 2.0 - y * scale};
  }

  Frame render(Time captured = Time{}) const {
    cv::Mat image(height_px, width_px, CV_32FC3, cv::Scalar(128, 126, 120));
    std::mt19937 random(seed);
    draw_floor(image, random);
    for (const PlacedPicture& picture : pictures) draw(image, picture);
    for (const cv::Rect& cover : covers_px) cv::rectangle(image, cover, cv::Scalar(60, 40, 150), cv::FILLED);
    image = image * gain + cv::Scalar::all(bias);
    if (noise > 0.0) {
      std::normal_distribution<float> normal(0.0F, static_cast<float>(noise));
      for (auto it = image.begin<cv::Vec3f>(); it != image.end<cv::Vec3f>(); ++it) {
        for (int c = 0; c < 3; ++c) (*it)[c] += normal(random);
      }
    }
    Frame frame{.captured = captured};
    image.convertTo(frame.image, CV_8UC3);
    return frame;
  }

 private:
  void draw_floor(cv::Mat& image, std::mt19937& random) const {
    std::uniform_int_distribution<int> u(0, width_px - 1);
    std::uniform_int_distribution<int> v(0, height_px - 1);
    std::uniform_int_distribution<int> level(60, 190);
    for (int i = 0; i < floor_speckle; ++i) {
      const double grey = level(random);
      cv::rectangle(image, cv::Rect(u(random), v(random), 2 + i % 3, 2 + i % 2), cv::Scalar(grey, grey, grey),
                    cv::FILLED);
    }
  }

  // Each pixel averages 5 x 5 rays; each ray reads the picture bilinearly.
  void draw(cv::Mat& image, const PlacedPicture& picture) const {
    constexpr int kRays = 5;
    const double scale = metres_per_px(picture.height_m);
    const Eigen::Rotation2Dd robot_from_map(-picture.pose.yaw);
    const double reach =
        0.5 * std::hypot(picture.image.cols, picture.image.rows) * picture.metres_per_pixel / scale + 2;
    const Pixel centre = pixel(picture.pose.x, picture.pose.y, picture.height_m);
    const cv::Rect box = cv::Rect(static_cast<int>(centre.x() - reach), static_cast<int>(centre.y() - reach),
                                  static_cast<int>(2 * reach) + 2, static_cast<int>(2 * reach) + 2) &
                         cv::Rect(0, 0, width_px, height_px);
    for (int v = box.y; v < box.y + box.height; ++v) {
      for (int u = box.x; u < box.x + box.width; ++u) {
        cv::Vec3f sum(0, 0, 0);
        auto& out = image.at<cv::Vec3f>(v, u);
        for (int i = 0; i < kRays * kRays; ++i) {
          const double su = u + ((i % kRays) + 0.5) / kRays - 0.5;
          const double sv = v + ((i / kRays) + 0.5) / kRays - 0.5;
          const Eigen::Vector2d at((su - (width_px - 1) / 2.0) * scale, ((height_px - 1) / 2.0 - sv) * scale);
          const Eigen::Vector2d robot = robot_from_map * (at - picture.pose.position());
          const double row = (picture.image.rows - 1) / 2.0 - robot.x() / picture.metres_per_pixel;
          const double column = (picture.image.cols - 1) / 2.0 - robot.y() / picture.metres_per_pixel;
          sum += read(picture.image, row, column, out);
        }
        out = sum / static_cast<float>(kRays * kRays);
      }
    }
  }

  static cv::Vec3f read(const cv::Mat& picture, double row, double column, const cv::Vec3f& outside) {
    if (row < -0.5 || column < -0.5 || row > picture.rows - 0.5 || column > picture.cols - 0.5)
      return outside;
    const auto clamp = [](double value, int size) { return std::min(std::max(value, 0.0), size - 1.001); };
    const double r = clamp(row, picture.rows);
    const double c = clamp(column, picture.cols);
    const int r0 = static_cast<int>(r);
    const int c0 = static_cast<int>(c);
    const auto fr = static_cast<float>(r - r0);
    const auto fc = static_cast<float>(c - c0);
    const auto at = [&](int y, int x) { return cv::Vec3f(picture.at<cv::Vec3b>(y, x)); };
    return (1 - fr) * ((1 - fc) * at(r0, c0) + fc * at(r0, c0 + 1)) +
           fr * ((1 - fc) * at(r0 + 1, c0) + fc * at(r0 + 1, c0 + 1));
  }
};

/// The appearance of a placed picture.
inline std::shared_ptr<const Appearance> appearance_of(const PlacedPicture& picture,
                                                       const std::string& id = "robot") {
  return std::make_shared<const Appearance>(id, Picture{.image = picture.image,
                                                        .metres_per_pixel = picture.metres_per_pixel,
                                                        .surface_height_m = picture.height_m});
}

}  // namespace skylight::test
