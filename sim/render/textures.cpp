#include "sim/render/textures.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace skylight::sim {
namespace {

constexpr int kMaxPicture = 8192;

/// The size that a PNG or JPEG file claims, read before a decoder sets memory aside for it.
std::optional<cv::Size> claimed_size(std::istream& file) {
  const auto bytes = [&](std::streamoff at, int count) {
    std::uint64_t value = 0;
    file.seekg(at);
    for (int i = 0; i < count; ++i) value = value << 8 | static_cast<std::uint64_t>(file.get() & 0xff);
    return value;
  };
  const auto size = [&](std::uint64_t width, std::uint64_t height) {
    constexpr std::uint64_t kMost = 1 << 30;
    return cv::Size(static_cast<int>(std::min(width, kMost)), static_cast<int>(std::min(height, kMost)));
  };
  constexpr std::uint64_t kPngSignature = 0x89504e470d0a1a0a;
  if (bytes(0, 8) == kPngSignature) return size(bytes(16, 4), bytes(20, 4));
  if (bytes(0, 2) != 0xffd8) return std::nullopt;
  for (std::streamoff at = 2; file.good();) {  // a JPEG is a chain of segments; SOF0 to SOF15 tell the size
    const std::uint64_t marker = bytes(at, 2);
    const bool is_frame =
        marker >= 0xffc0 && marker <= 0xffcf && marker != 0xffc4 && marker != 0xffc8 && marker != 0xffcc;
    if (is_frame) return size(bytes(at + 7, 2), bytes(at + 5, 2));
    if (marker < 0xff00) break;
    at += 2 + static_cast<std::streamoff>(bytes(at + 2, 2));
  }
  return std::nullopt;
}

cv::Scalar hsv(double hue_deg, double saturation, double value) {
  const cv::Mat pixel(1, 1, CV_32FC3, cv::Scalar(std::fmod(hue_deg, 360.0), saturation, value));
  cv::Mat converted;
  cv::cvtColor(pixel, converted, cv::COLOR_HSV2BGR);
  const auto& c = converted.at<cv::Vec3f>(0, 0);
  return {255.0 * c[0], 255.0 * c[1], 255.0 * c[2]};
}

/// A polygon of three to six corners around a place, as units of 1/16 px.
std::vector<cv::Point> random_polygon(cv::RNG& random, const cv::Point2d& centre, double radius) {
  const int corners = random.uniform(3, 6);
  const double turn = random.uniform(0.0, CV_2PI);
  std::vector<cv::Point> polygon;
  for (int k = 0; k < corners; ++k) {
    const double angle = turn + k * CV_2PI / corners;
    const double r = radius * random.uniform(0.75, 1.1);
    polygon.emplace_back(static_cast<int>((centre.x + r * std::cos(angle)) * 16.0),
                         static_cast<int>((centre.y + r * std::sin(angle)) * 16.0));
  }
  return polygon;
}

}  // namespace

Bgr bgr(const Color& rgb) {
  return {static_cast<float>(rgb[2]), static_cast<float>(rgb[1]), static_cast<float>(rgb[0])};
}

Texture::Texture(const cv::Mat& image, bool wrap) : wrap_(wrap) {
  CV_Assert(image.type() == CV_8UC3);
  levels_.push_back({image.clone(), 1.0F, 1.0F});
  while (std::min(levels_.back().image.cols, levels_.back().image.rows) > 2) {
    const cv::Mat& larger = levels_.back().image;
    cv::Mat half;
    cv::resize(larger, half, {(larger.cols + 1) / 2, (larger.rows + 1) / 2}, 0, 0, cv::INTER_AREA);
    levels_.push_back({half, static_cast<float>(half.cols) / static_cast<float>(image.cols),
                       static_cast<float>(half.rows) / static_cast<float>(image.rows)});
  }
}

int Texture::level_for(double footprint_px) const {
  const int level = footprint_px > 1.0 ? static_cast<int>(std::floor(std::log2(footprint_px))) : 0;
  return std::min(level, static_cast<int>(levels_.size()) - 1);
}

cv::Mat draw_robot_picture(std::uint64_t seed, int size_px) {
  cv::RNG random(seed * 0x9e3779b97f4a7c15ULL + 1);
  const int n = size_px * 4;  // drawn four times as large, then averaged: clean edges at any angle
  const double hue =
      200.0 + 137.508 * static_cast<double>(seed % 360);  // the golden angle: neighbouring seeds differ most
  cv::Mat image(n, n, CV_8UC3, hsv(hue, 0.42, 0.90));
  // Shapes on a jittered grid: every part of the picture has corners, wherever the lidar stands.
  constexpr int kGrid = 4;
  const double cell = static_cast<double>(n) / kGrid;
  for (int round = 0; round < 2; ++round) {
    for (int j = 0; j < kGrid; ++j) {
      for (int i = 0; i < kGrid; ++i) {
        // One number a statement: compilers differ in which argument of a call they work out first.
        const double down = random.uniform(-0.35, 0.35);
        const double right = random.uniform(-0.35, 0.35);
        const cv::Point2d centre((i + 0.5 + right) * cell, (j + 0.5 + down) * cell);
        const double third = random.uniform(0, 3) * 120.0;
        const double shift = third + random.uniform(-25.0, 25.0);
        const bool dark = random.uniform(0.0, 1.0) < (round == 0 ? 0.7 : 0.3);
        const double value = dark ? random.uniform(0.16, 0.35) : random.uniform(0.6, 0.92);
        const double saturation = dark ? 0.75 : random.uniform(0.5, 0.9);
        const cv::Scalar color = hsv(hue + shift, saturation, value);
        const double radius = cell * (round == 0 ? random.uniform(0.40, 0.60) : random.uniform(0.16, 0.26));
        cv::fillConvexPoly(image, random_polygon(random, centre, radius), color, cv::LINE_8, 4);
      }
    }
  }
  // The front edge: a dark band with a light arrow, so that people see where the robot looks.
  cv::rectangle(image, cv::Rect(0, 0, n, n / 14), hsv(hue, 0.8, 0.25), cv::FILLED);
  const std::vector<cv::Point> arrow{{n / 2, n / 80}, {n / 2 - n / 12, n / 16}, {n / 2 + n / 12, n / 16}};
  cv::fillConvexPoly(image, arrow, cv::Scalar(235, 235, 235));
  cv::Mat small;
  cv::resize(image, small, {size_px, size_px}, 0, 0, cv::INTER_AREA);
  return small;
}

cv::Mat load_picture(const std::filesystem::path& folder, const std::string& file, const std::string& key) {
  const std::filesystem::path path =
      std::filesystem::path(file).is_absolute() ? std::filesystem::path(file) : folder / file;
  const auto refuse = [&](const std::string& why) -> void {
    throw std::invalid_argument(key + ": " + path.string() + " " + why);
  };
  std::ifstream stream(path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(path)) refuse("cannot be opened");
  if (const auto size = claimed_size(stream); size && std::max(size->width, size->height) > kMaxPicture) {
    refuse("is larger than a picture may be (8192 x 8192 px)");
  }
  cv::Mat image;
  try {
    image = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    refuse("is larger than a picture may be (8192 x 8192 px)");
  }
  if (image.empty()) refuse("is no picture that can be read (PNG, JPEG, BMP, TIFF, WebP)");
  if (std::max(image.cols, image.rows) > kMaxPicture)
    refuse("is larger than a picture may be (8192 x 8192 px)");
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257.0);
  if (image.depth() != CV_8U) refuse("has neither 8 nor 16 bits per channel");
  if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  return image;
}

}  // namespace skylight::sim
