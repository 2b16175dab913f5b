// The procedural floors. Each is a factor on the floor's colour, softened by its contrast, and then what has
// a colour of its own: chips of stone, planks, cables.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <opencv2/imgproc.hpp>

#include "sim/render/tags.hpp"
#include "sim/render/textures.hpp"

namespace skylight::sim {
namespace {

constexpr int kMaxFloorPixels = 4096;
constexpr int kSubpixel = 4;  ///< bits of the places that OpenCV draws at

struct Canvas {
  cv::RNG& random;
  cv::Size size;
  double metres_per_px;

  double px(double metres) const { return metres / metres_per_px; }
};

/// Smooth noise of mean 0 and about unit strength: random values on a coarse grid, cubic between.
cv::Mat smooth_noise(cv::RNG& random, const cv::Size& size, double grain_x_px, double grain_y_px) {
  const auto cells = [](int length, double grain) {
    return std::max(2, static_cast<int>(std::ceil(length / grain)) + 2);
  };
  cv::Mat values(cells(size.height, grain_y_px), cells(size.width, grain_x_px), CV_32FC1);
  random.fill(values, cv::RNG::NORMAL, 0.0, 1.0);
  cv::Mat scaled;
  const bool finer = std::min(grain_x_px, grain_y_px) <= 1.0;
  cv::resize(values, scaled, size, 0, 0, finer ? cv::INTER_AREA : cv::INTER_CUBIC);
  return scaled;
}
cv::Mat smooth_noise(const Canvas& canvas, double grain_m) {
  return smooth_noise(canvas.random, canvas.size, canvas.px(grain_m), canvas.px(grain_m));
}

cv::Point fixed_point(const cv::Point2d& place) {
  return {cv::saturate_cast<int>(place.x * (1 << kSubpixel)),
          cv::saturate_cast<int>(place.y * (1 << kSubpixel))};
}

cv::Point2d anywhere(const Canvas& canvas) {
  return {canvas.random.uniform(0.0, 1.0 * canvas.size.width),
          canvas.random.uniform(0.0, 1.0 * canvas.size.height)};
}

/// A path that bends at random, `step_px` from point to point; `bend`: radians, standard deviation a step.
std::vector<cv::Point> random_path(const Canvas& canvas, int steps, double step_px, double bend) {
  cv::Point2d at = anywhere(canvas);
  double heading = canvas.random.uniform(0.0, CV_2PI);
  double turning = 0.0;
  std::vector<cv::Point> path;
  for (int i = 0; i < steps; ++i) {
    path.push_back(fixed_point(at));
    turning = 0.85 * turning + bend * canvas.random.gaussian(1.0);
    heading += turning;
    at += step_px * cv::Point2d(std::cos(heading), std::sin(heading));
  }
  return path;
}

/// Cloudy, with grains of sand and pores.
cv::Mat concrete(const Canvas& canvas) {
  cv::Mat factor(canvas.size, CV_32FC1, cv::Scalar(1.0));
  factor += 0.16 * smooth_noise(canvas, 0.6);
  factor += 0.12 * smooth_noise(canvas, 0.12);
  factor += 0.10 * smooth_noise(canvas, 0.03);
  factor += 0.14 * smooth_noise(canvas, 0.006);
  const double area = canvas.size.area() * canvas.metres_per_px * canvas.metres_per_px;
  for (int i = 0; i < static_cast<int>(40.0 * area); ++i) {
    const double radius = canvas.px(0.001 + 0.003 * std::pow(canvas.random.uniform(0.0, 1.0), 4.0));
    cv::circle(factor, fixed_point(anywhere(canvas)), static_cast<int>(radius * (1 << kSubpixel)),
               cv::Scalar(canvas.random.uniform(0.3, 0.75)), cv::FILLED, cv::LINE_8, kSubpixel);
  }
  return factor;
}

/// Hairline cracks in it.
cv::Mat cracked(const Canvas& canvas, const cv::Mat& factor) {
  const double area = canvas.size.area() * canvas.metres_per_px * canvas.metres_per_px;
  cv::Mat cracks(canvas.size, CV_8UC1, cv::Scalar(0));
  for (int i = 0; i < static_cast<int>(0.12 * area); ++i) {
    const auto path = random_path(canvas, canvas.random.uniform(40, 160), canvas.px(0.012), 0.22);
    cv::polylines(cracks, path, false, cv::Scalar(canvas.random.uniform(90, 200)), 1, cv::LINE_AA, kSubpixel);
  }
  cv::Mat dark;
  cracks.convertTo(dark, CV_32F, -0.6 / 255.0, 1.0);
  return factor.mul(dark);
}

/// Dark bands of a joint's width along one direction, with soft edges: `place(i)` in px, at subpixel places.
void joints_across(cv::Mat& factor, const std::vector<double>& places, double width_px) {
  for (const double place : places) {
    const int first = std::max(0, static_cast<int>(std::floor(place - width_px)));
    const int last = std::min(factor.cols - 1, static_cast<int>(std::ceil(place + width_px)));
    for (int x = first; x <= last; ++x) {
      // The share of the pixel that the joint covers, over an edge that is one pixel wide.
      const double share = std::clamp(0.5 * width_px + 0.5 - std::abs(x - place), 0.0, 1.0);
      factor.col(x) = factor.col(x) * (1.0 - share) + 0.38 * share;
    }
  }
}

/// Square tiles, each of its own tone, cloudiness and grain, a little lighter towards one edge, with darker
/// joints.
cv::Mat tiles(const Canvas& canvas, double tile_m) {
  const cv::Mat pattern = concrete(canvas);
  const cv::Mat veins = smooth_noise(canvas, 0.09);
  cv::Mat factor = 0.55 * pattern + 0.45;
  const double tile = canvas.px(tile_m);
  const auto count = [&](int length) { return static_cast<int>(length / tile) / 2 + 2; };
  const auto edge = [&](int index, int length) { return 0.5 * (length - 1) + index * tile; };
  const cv::Rect all(cv::Point(0, 0), canvas.size);
  std::vector<double> columns;
  std::vector<double> rows;
  for (int i = -count(canvas.size.width); i <= count(canvas.size.width); ++i)
    columns.push_back(edge(i, canvas.size.width));
  for (int j = -count(canvas.size.height); j <= count(canvas.size.height); ++j)
    rows.push_back(edge(j, canvas.size.height));
  for (std::size_t j = 0; j + 1 < rows.size(); ++j) {
    for (std::size_t i = 0; i + 1 < columns.size(); ++i) {
      const double tone = 1.0 + 0.13 * canvas.random.gaussian(1.0);
      const double veined = 0.10 * canvas.random.gaussian(1.0);
      const cv::Rect place = cv::Rect(cv::Point(cvRound(columns[i]), cvRound(rows[j])),
                                      cv::Point(cvRound(columns[i + 1]), cvRound(rows[j + 1]))) &
                             all;
      if (place.area() > 0) factor(place) = (factor(place) + veined * veins(place)) * tone;
    }
  }
  const double joint = std::max(1.0, canvas.px(0.005));
  joints_across(factor, columns, joint);
  cv::Mat turned = factor.t();
  joints_across(turned, rows, joint);
  return turned.t();
}

/// Planks along x, each row shifted against the next, each plank with its own tone and grain: fine fibres,
/// and the rings of the tree where the saw met them.
cv::Mat wood(const Canvas& canvas, double plank_m) {
  const double length = canvas.px(plank_m);
  const double width = canvas.px(std::clamp(0.16 * plank_m, 0.05, 0.22));
  const cv::Mat fibres = smooth_noise(canvas.random, canvas.size, canvas.px(0.15), canvas.px(0.003));
  const cv::Mat streaks = smooth_noise(canvas.random, canvas.size, canvas.px(0.6), canvas.px(0.02));
  const cv::Mat warp = smooth_noise(canvas.random, canvas.size, canvas.px(0.5), canvas.px(0.06));
  cv::Mat factor(canvas.size, CV_32FC1);
  for (double top = 0.0; top < canvas.size.height; top += width) {
    double left = -canvas.random.uniform(0.0, length);
    while (left < canvas.size.width) {
      const double long_px = length * canvas.random.uniform(0.75, 1.0);
      const double tone = 1.0 + 0.16 * canvas.random.gaussian(1.0);
      const double middle = canvas.random.uniform(-1.0, 2.0);  // of the rings, in widths of the plank
      const double rings = canvas.random.uniform(2.0, 6.0);
      const int last_row = std::min(canvas.size.height, static_cast<int>(std::ceil(top + width)));
      for (int y = static_cast<int>(std::ceil(top)); y < last_row; ++y) {
        auto* row = factor.ptr<float>(y);
        const double across = (y - top) / width;
        const double to_long_side = std::min(y - top, top + width - y);
        const int end = std::min(canvas.size.width, static_cast<int>(std::ceil(left + long_px)));
        for (int x = std::max(0, static_cast<int>(std::ceil(left))); x < end; ++x) {
          const double ring =
              std::sin(CV_2PI * rings * (across - middle) * (across - middle) + 1.8 * warp.at<float>(y, x));
          const double grain = 0.10 * fibres.at<float>(y, x) + 0.06 * streaks.at<float>(y, x) + 0.09 * ring;
          const double side = std::min(to_long_side, std::min(x - left, left + long_px - x));
          const double gap = std::clamp(1.0 - side / canvas.px(0.003), 0.0, 1.0);
          row[x] = static_cast<float>(tone * (1.0 + grain) * (1.0 - 0.65 * gap));
        }
      }
      left += long_px;
    }
  }
  return factor;
}

cv::Mat coloured(const cv::Mat& factor, const FloorSpec& floor) {
  const cv::Mat softened = 1.0 + floor.contrast * (factor - 1.0);
  std::vector<cv::Mat> channels(3);
  for (std::size_t c = 0; c < 3; ++c) softened.convertTo(channels[c], CV_8U, floor.color_rgb[2 - c]);
  cv::Mat image;
  cv::merge(channels, image);
  return image;
}

/// Terrazzo: chips of many sizes and of a few kinds of stone, each with corners. The hardest floor for
/// feature matching.
void lay_chips(const Canvas& canvas, const FloorSpec& floor, cv::Mat& image) {
  // Of light, red, black and grey stone: factors on the floor's colour, blue, green, red.
  constexpr std::array<std::array<double, 3>, 4> kStones{
      {{1.55, 1.65, 1.70}, {0.62, 0.78, 1.15}, {0.28, 0.27, 0.26}, {0.80, 0.82, 0.84}}};
  const double area = canvas.size.area() * canvas.metres_per_px * canvas.metres_per_px;
  const int chips = static_cast<int>(std::min(400000.0, 900.0 * area));
  for (int i = 0; i < chips; ++i) {
    const cv::Point2d centre = anywhere(canvas);
    const double radius = canvas.px(0.004 + 0.012 * std::pow(canvas.random.uniform(0.0, 1.0), 3.0));
    std::vector<cv::Point> corners;
    for (int k = 0; k < 5; ++k) {
      const double angle = (k + canvas.random.uniform(-0.35, 0.35)) * CV_2PI / 5.0;
      const double r = radius * canvas.random.uniform(0.6, 1.2);
      corners.push_back(fixed_point(centre + r * cv::Point2d(std::cos(angle), std::sin(angle))));
    }
    const auto& stone = kStones[static_cast<std::size_t>(canvas.random.uniform(0, 4))];
    const double tone = canvas.random.uniform(0.8, 1.2);
    cv::Scalar color;
    for (int c = 0; c < 3; ++c) {
      const double factor = 1.0 + floor.contrast * (stone[static_cast<std::size_t>(c)] * tone - 1.0);
      color[c] = std::clamp(floor.color_rgb[static_cast<std::size_t>(2 - c)] * factor, 0.0, 255.0);
    }
    cv::fillConvexPoly(image, corners, color, cv::LINE_8, kSubpixel);
  }
}

/// image = image (1 - strength mask) + strength mask grey.
void blend(cv::Mat& image, const cv::Mat& mask, double strength, double grey) {
  for (int y = 0; y < image.rows; ++y) {
    const auto* m = mask.ptr<std::uint8_t>(y);
    auto* out = image.ptr<cv::Vec3b>(y);
    for (int x = 0; x < image.cols; ++x) {
      if (m[x] == 0) continue;
      const double share = strength * m[x] / 255.0;
      for (int c = 0; c < 3; ++c)
        out[x][c] = cv::saturate_cast<std::uint8_t>(out[x][c] * (1.0 - share) + grey * share);
    }
  }
}

/// Dark cables, 6 to 10 mm thick, with a shadow beside them and a bright line where they mirror the light.
void lay_cables(const Canvas& canvas, int count, cv::Mat& image) {
  cv::Mat shadow(canvas.size, CV_8UC1, cv::Scalar(0));
  cv::Mat body = shadow.clone();
  cv::Mat shine = shadow.clone();
  const auto draw = [&](cv::Mat& mask, const std::vector<cv::Point>& path, double metres) {
    const int thickness = std::max(1, cvRound(canvas.px(metres)));
    cv::polylines(mask, path, false, cv::Scalar(255), thickness, cv::LINE_AA, kSubpixel);
  };
  for (int i = 0; i < count; ++i) {
    const double thick_m = canvas.random.uniform(0.006, 0.010);
    const auto path = random_path(canvas, canvas.random.uniform(60, 160), canvas.px(0.02), 0.035);
    draw(shadow, path, 1.8 * thick_m);
    draw(body, path, thick_m);
    draw(shine, path, 0.2 * thick_m);
  }
  const double soft = canvas.px(0.004);
  cv::GaussianBlur(shadow, shadow, {0, 0}, soft);
  cv::GaussianBlur(body, body, {0, 0}, 0.6);
  blend(image, shadow, 0.45, 0.0);
  blend(image, body, 0.97, 26.0);
  blend(image, shine, 0.4, 92.0);
}

/// The floor as a picture of the canvas's size, without what lies on it.
cv::Mat bare_floor(const Canvas& canvas, const FloorSpec& floor) {
  cv::Mat factor(canvas.size, CV_32FC1, cv::Scalar(1.0));
  if (floor.material == FloorMaterial::concrete) factor = cracked(canvas, concrete(canvas));
  if (floor.material == FloorMaterial::tiles) factor = tiles(canvas, floor.tile_m);
  if (floor.material == FloorMaterial::wood) factor = wood(canvas, floor.tile_m);
  if (floor.material == FloorMaterial::speckle) factor += 0.2 * smooth_noise(canvas, 0.01);
  cv::Mat image = coloured(factor, floor);
  if (floor.material == FloorMaterial::speckle) lay_chips(canvas, floor, image);
  return image;
}

/// A picture repeated over the canvas, middle on middle.
cv::Mat repeated(const Canvas& canvas, const FloorTexture& picture) {
  cv::Mat image(canvas.size, CV_8UC3);
  const double scale = canvas.metres_per_px / picture.metres_per_px;
  const int level = picture.texture.level_for(scale);
  const auto place = [&](int at, int length, int picture_length) {
    return static_cast<float>(0.5 * (picture_length - 1) + (at - 0.5 * (length - 1)) * scale);
  };
  for (int r = 0; r < image.rows; ++r) {
    const float row = place(r, image.rows, picture.texture.height_px());
    for (int c = 0; c < image.cols; ++c) {
      const Bgr color = picture.texture.sample(level, place(c, image.cols, picture.texture.width_px()), row);
      for (int k = 0; k < 3; ++k) image.at<cv::Vec3b>(r, c)[k] = cv::saturate_cast<std::uint8_t>(color[k]);
    }
  }
  return image;
}

/// The floor without what lies on it flat.
FloorTexture make_ground(const RoomSpec& room, std::uint64_t seed, const std::filesystem::path& folder) {
  const FloorSpec& floor = room.floor;
  FloorTexture picture;
  if (floor.material == FloorMaterial::picture) {
    cv::Mat image = load_picture(folder, floor.picture, "room.floor.picture");
    if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
    picture = {Texture(image, true), floor.picture_width_m / image.cols};
    if (floor.cables == 0) return picture;
  }
  const double metres_per_px = std::max(0.002, std::max(room.size_m[0], room.size_m[1]) / kMaxFloorPixels);
  const auto pixels = [&](double metres) {
    return std::max(8, static_cast<int>(std::ceil(metres / metres_per_px)));
  };
  cv::RNG random(seed);
  const Canvas canvas{random, cv::Size(pixels(room.size_m[0]), pixels(room.size_m[1])), metres_per_px};
  cv::Mat image = picture.texture.empty() ? bare_floor(canvas, floor) : repeated(canvas, picture);
  if (floor.cables > 0) lay_cables(canvas, floor.cables, image);
  return {Texture(image, false), metres_per_px};
}

FloorPrint print_of(const FloorTagSpec& tag, const std::string& key) {
  constexpr int kTexelsPerCell = 24;
  const TagPattern pattern = tag_pattern({.family = tag.family, .id = tag.id}, key);
  cv::Mat image;
  cv::resize(pattern.cells, image, {}, kTexelsPerCell, kTexelsPerCell, cv::INTER_NEAREST);
  cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  const double yaw = tag.yaw_deg * std::numbers::pi / 180.0;
  return {.texture = Texture(image, false),
          .at = {tag.x_m, tag.y_m},
          .right = {std::cos(yaw), std::sin(yaw)},
          .edge_m = tag.size_m * pattern.cells.cols / pattern.border_cells};
}

}  // namespace

FloorTexture make_floor(const RoomSpec& room, std::uint64_t seed, const std::filesystem::path& folder) {
  FloorTexture floor = make_ground(room, seed, folder);
  for (std::size_t i = 0; i < room.floor.tags.size(); ++i)
    floor.prints.push_back(print_of(room.floor.tags[i], "room.floor.tags[" + std::to_string(i) + "]"));
  return floor;
}

}  // namespace skylight::sim
