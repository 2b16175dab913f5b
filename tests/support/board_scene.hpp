// Boards and tags held or laid anywhere before a simulated camera: its lens and sensor are the simulator's
// own (sim/camera), so that nothing of the calibration's projection is in the pictures. The simulator's
// renderer lays pictures flat; here they may be tilted.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sim/camera/camera_model.hpp"
#include "sim/camera/noise.hpp"
#include "sim/render/tags.hpp"

namespace skylight::test {

/// A sheet of square cells. Its frame: origin in its middle, x right, y up, z out of the print.
struct Print {
  cv::Mat cells;  ///< CV_8UC1, 0 black to 255 white
  double cell_m = 0.01;
  Eigen::Isometry3d map_from_print = Eigen::Isometry3d::Identity();
};

/// Numbers that follow from a seed on every machine.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(sim::mix(++state_) >> 11U) * 0x1p-53;
  }
  double normal(double sigma) {
    const double r = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return sigma * r * std::cos(2.0 * std::numbers::pi * uniform(0.0, 1.0));
  }

 private:
  std::uint64_t state_;
};

/// Inner corners `columns` x `rows`; the square at the bottom left is dark; a white rim of one square.
inline Print chessboard_print(int columns, int rows, double square_m, const Eigen::Isometry3d& pose) {
  cv::Mat cells(rows + 3, columns + 3, CV_8UC1, cv::Scalar(255));
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      if ((rows - row + column) % 2 == 0) cells.at<std::uint8_t>(row + 1, column + 1) = 0;
    }
  }
  return {.cells = cells, .cell_m = square_m, .map_from_print = pose};
}

/// As OpenCV draws it, with a rim of half a square; the marker's edge must be 3/4 of the square's.
inline Print charuco_print(const cv::Ptr<cv::aruco::CharucoBoard>& board, const Eigen::Isometry3d& pose) {
  constexpr int kCells = 8;  // to a square: the markers of 4x4 dictionaries have 6 cells
  const cv::Size squares = board->getChessboardSize();
  cv::Mat drawn;
  board->draw(squares * kCells, drawn, 0, 1);
  cv::copyMakeBorder(drawn, drawn, kCells / 2, kCells / 2, kCells / 2, kCells / 2, cv::BORDER_CONSTANT,
                     cv::Scalar(255));
  return {.cells = drawn, .cell_m = board->getSquareLength() / kCells, .map_from_print = pose};
}

inline Print tag_print(int id, double size_m, const Eigen::Isometry3d& pose,
                       const std::string& family = "36h11") {
  const sim::TagPattern pattern = sim::tag_pattern({.family = family, .id = id}, "tag");
  cv::Mat cells;
  cv::copyMakeBorder(pattern.cells, cells, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  return {.cells = cells, .cell_m = size_m / pattern.border_cells, .map_from_print = pose};
}

struct BoardScene {
  sim::CameraParameters camera;
  sim::SensorSpec sensor{};
  double vignetting = 0.15;
  double defocus_px = 0.5;  ///< standard deviation of the lens's blur
  double motion_px = 0.0;   ///< the picture moves by so much along its rows while it is exposed
  float black = 18.0F;      ///< grey levels of the print ...
  float white = 190.0F;
  float floor = 110.0F;  ///< ... and of all else, with coarse speckle
  std::uint64_t seed = 1;
  std::uint64_t frame = 0;  ///< fresh noise for each
  std::vector<Print> prints;

  cv::Mat render() const {
    cv::Mat light(camera.height_px, camera.width_px, CV_32FC1);
    draw_floor(light);
    const sim::CameraModel model(camera);
    for (const Print& print : prints) draw(model, print, light);
    if (defocus_px > 0.0) cv::GaussianBlur(light, light, {}, defocus_px, defocus_px, cv::BORDER_REPLICATE);
    blur_along_rows(light);
    darken_corners(light);
    cv::Mat mean;
    cv::Mat grey;
    light.convertTo(grey, CV_16UC1, sim::kGreyOne);
    cv::merge(std::vector<cv::Mat>{grey, grey, grey}, mean);
    cv::Mat image;
    sim::expose({mean, {}}, sensor, {.seed = seed, .camera = 0, .sequence = frame}, image);
    return image;
  }

 private:
  static constexpr int kRays = 4;  ///< per pixel and axis
  static constexpr int kStep = 2;  ///< px between directions that are worked out; between them, linear

  void draw_floor(cv::Mat& light) const {
    Dice dice(seed + 77);
    cv::Mat coarse(light.rows / 24 + 2, light.cols / 24 + 2, CV_32FC1);
    for (auto it = coarse.begin<float>(); it != coarse.end<float>(); ++it)
      *it = floor + static_cast<float>(dice.uniform(-25.0, 25.0));
    cv::resize(coarse, light, light.size(), 0, 0, cv::INTER_LINEAR);
  }

  void blur_along_rows(cv::Mat& light) const {
    if (!(motion_px > 0.0)) return;
    constexpr int kFine = 16;  // taps of a box that need not be whole pixels wide
    const int half = static_cast<int>(motion_px / 2 + 1);
    cv::Mat kernel(1, 2 * half + 1, CV_32FC1, cv::Scalar(0));
    for (int i = 0; i < kFine * (2 * half + 1); ++i) {
      const double at = (i + 0.5) / kFine - half - 0.5;
      if (std::abs(at) < motion_px / 2) kernel.at<float>(i / kFine) += 1.0F;
    }
    cv::filter2D(light, light, CV_32F, kernel / cv::sum(kernel)[0], {-1, -1}, 0, cv::BORDER_REPLICATE);
  }

  void darken_corners(cv::Mat& light) const {
    const double cx = (camera.width_px - 1) / 2.0;
    const double cy = (camera.height_px - 1) / 2.0;
    for (int v = 0; v < light.rows; ++v) {
      for (int u = 0; u < light.cols; ++u) {
        const double r2 = ((u - cx) * (u - cx) + (v - cy) * (v - cy)) / (cx * cx + cy * cy);
        light.at<float>(v, u) *= static_cast<float>(1.0 - vignetting * r2);
      }
    }
  }

  cv::Rect box_of(const sim::CameraModel& model, const Print& print) const {
    Eigen::AlignedBox2d box;
    constexpr int kAlong = 20;
    const Eigen::Vector2d half = 0.5 * print.cell_m * Eigen::Vector2d(print.cells.cols, print.cells.rows);
    for (int i = 0; i <= kAlong; ++i) {
      const double t = 2.0 * i / kAlong - 1.0;
      for (const auto& [x, y] : {std::pair{t, -1.0}, {t, 1.0}, {-1.0, t}, {1.0, t}}) {
        const Eigen::Vector3d place(x * half.x(), y * half.y(), 0.0);
        if (const auto pixel = model.project_map(print.map_from_print * place)) box.extend(*pixel);
      }
    }
    if (box.isEmpty()) return {};
    const cv::Rect around(static_cast<int>(box.min().x()) - 3, static_cast<int>(box.min().y()) - 3,
                          static_cast<int>(box.sizes().x()) + 7, static_cast<int>(box.sizes().y()) + 7);
    return around & cv::Rect(0, 0, camera.width_px, camera.height_px);
  }

  void draw(const sim::CameraModel& model, const Print& print, cv::Mat& light) const {
    const cv::Rect box = box_of(model, print);
    if (box.empty()) return;
    const Eigen::Isometry3d print_from_camera = print.map_from_print.inverse() * camera.map_from_camera;
    const int columns = box.width / kStep + 2;
    std::vector<Eigen::Vector3d> rays;
    for (int r = 0; r <= box.height / kStep + 1; ++r) {
      for (int c = 0; c < columns; ++c) {
        const Eigen::Vector2d pixel(box.x + c * kStep - 0.5, box.y + r * kStep - 0.5);
        const auto ray = model.direction(pixel);
        rays.push_back(ray ? Eigen::Vector3d(print_from_camera.linear() * ray->normalized())
                           : Eigen::Vector3d::Zero());
      }
    }
    for (int v = 0; v < box.height; ++v) {
      for (int u = 0; u < box.width; ++u) {
        const Eigen::Vector3d* corner = &rays[static_cast<std::size_t>(v / kStep * columns + u / kStep)];
        const std::array<Eigen::Vector3d, 4> around{corner[0], corner[1], corner[columns],
                                                    corner[columns + 1]};
        draw_pixel(print, print_from_camera.translation(), around, {u % kStep, v % kStep},
                   light.at<float>(box.y + v, box.x + u));
      }
    }
  }

  void draw_pixel(const Print& print, const Eigen::Vector3d& eye, const std::array<Eigen::Vector3d, 4>& rays,
                  const Eigen::Vector2i& within, float& out) const {
    float sum = 0.0F;
    for (int i = 0; i < kRays * kRays; ++i) {
      const double x = (within.x() + (i % kRays + 0.5) / kRays) / kStep;
      const double y = (within.y() + (i / kRays + 0.5) / kRays) / kStep;
      const Eigen::Vector3d ray =
          (1 - y) * ((1 - x) * rays[0] + x * rays[1]) + y * ((1 - x) * rays[2] + x * rays[3]);
      const double distance = -eye.z() / ray.z();
      const Eigen::Vector3d place = (eye + distance * ray) / print.cell_m;
      const double column = std::floor(place.x() + 0.5 * print.cells.cols);
      const double row = std::floor(0.5 * print.cells.rows - place.y());
      if (!(distance > 0.0) ||
          !(column >= 0 && row >= 0 && column < print.cells.cols && row < print.cells.rows)) {
        sum += out;
        continue;
      }
      const float share =
          static_cast<float>(print.cells.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(column))) /
          255.0F;
      sum += black + share * (white - black);
    }
    out = sum / (kRays * kRays);
  }
};

/// The board's middle seen at a pixel, so far away, its print towards the camera, tilted about the picture's
/// right and then down axis and turned in the picture (radians); in the optical frame.
struct HeldBoard {
  Eigen::Vector2d pixel{0, 0};
  double distance_m = 1.0;
  double tilt_right = 0.0;
  double tilt_down = 0.0;
  double turn = 0.0;
};
inline Eigen::Isometry3d camera_from_held(const sim::CameraModel& camera, const HeldBoard& held) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = held.distance_m * camera.direction(held.pixel).value().normalized();
  // Facing the camera from wherever it is, so that it is seen at the tilts asked for.
  const Eigen::Quaterniond facing =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), pose.translation().normalized());
  const Eigen::Matrix3d straight = Eigen::Vector3d(1, -1, -1).asDiagonal();
  pose.linear() = facing.toRotationMatrix() *
                  Eigen::AngleAxisd(held.tilt_right, Eigen::Vector3d::UnitX()).toRotationMatrix() *
                  Eigen::AngleAxisd(held.tilt_down, Eigen::Vector3d::UnitY()).toRotationMatrix() *
                  Eigen::AngleAxisd(held.turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() * straight;
  return pose;
}

/// So many poses as somebody takes care to hold it: over the whole picture, tilted to all sides.
inline std::vector<Eigen::Isometry3d> held_boards(const sim::CameraModel& camera, int count,
                                                  double distance_m, std::uint64_t seed) {
  Dice dice(seed);
  std::vector<Eigen::Isometry3d> poses;
  const auto& p = camera.parameters();
  for (int i = 0; i < count; ++i) {
    const double column = i % 4;
    const double row = i / 4 % 3;
    const double tilt = 0.45 * ((i % 2 == 0) ? 1.0 : -1.0);
    poses.push_back(camera_from_held(
        camera, {.pixel = {p.width_px * ((column + 0.5) / 4 * 0.72 + 0.14 + dice.uniform(-0.03, 0.03)),
                           p.height_px * ((row + 0.5) / 3 * 0.66 + 0.17 + dice.uniform(-0.03, 0.03))},
                 .distance_m = distance_m * dice.uniform(0.8, 1.25),
                 .tilt_right = (i % 3 == 0 ? 0.1 : (i / 2 % 2 == 0 ? 1.0 : -1.0) * 0.5) * tilt / 0.45 +
                               dice.uniform(-0.1, 0.1),
                 .tilt_down = (i % 3 == 1 ? 0.1 : 1.0) * tilt * (i / 4 % 2 == 0 ? 1.0 : -1.0) +
                              dice.uniform(-0.1, 0.1),
                 .turn = dice.uniform(-0.3, 0.3)}));
  }
  return poses;
}

}  // namespace skylight::test
