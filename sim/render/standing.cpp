#include "sim/render/standing.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core/utility.hpp>

#include "sim/render/solids.hpp"

namespace skylight::sim {
namespace {

constexpr double kWallThickness = 0.08;  ///< m, as seen from above
constexpr Color kOutside{47.0, 44.0, 44.0};

std::vector<Solid> make_walls(const RoomSpec& room) {
  if (room.wall_height_m <= 0.0) return {};
  const double x = 0.5 * room.size_m[0];
  const double y = 0.5 * room.size_m[1];
  const double t = kWallThickness;
  const auto wall = [&](double x0, double y0, double x1, double y1) {
    return Solid{SolidKind::box, {x0, y0, 0.0}, {x1, y1, room.wall_height_m},
                 room.wall_rgb,  room.wall_rgb, false};
  };
  return {wall(-x - t, -y - t, x + t, -y), wall(-x - t, y, x + t, y + t), wall(-x - t, -y, -x, y),
          wall(x, -y, x + t, y)};
}

/// What one ray sees.
struct Sight {
  Bgr color = Bgr::Zero();
  double distance = std::numeric_limits<double>::infinity();
  bool is_floor = false;
  const Solid* wall = nullptr;
  Face face = Face::top;
};

class Painter {
 public:
  Painter(const StandingScene& scene, const Eigen::Vector3d& eye)
      : scene_(scene), eye_(eye), walls_(make_walls(scene.room)) {
    for (const Solid& wall : walls_) wall_pointers_.push_back(&wall);
  }

  /// `level`: of the floor's pyramid.
  Sight look(const Eigen::Vector3d& direction, int level) const {
    Sight sight;
    Hit hit;
    if (direction.z() < 0.0) hit.distance = -eye_.z() / direction.z();
    Eigen::Vector3d at = eye_ + hit.distance * direction;
    sight.is_floor = std::isfinite(hit.distance) && inside(at);
    // From one point within the room to another no wall is in between.
    if (!(sight.is_floor && inside(eye_)) && intersect(wall_pointers_, {eye_, direction}, hit))
      sight.is_floor = false;
    sight.distance = hit.distance;
    sight.wall = hit.solid;
    sight.face = hit.face;
    if (!std::isfinite(hit.distance)) return sight;
    at = eye_ + hit.distance * direction;
    if (hit.solid == nullptr) {
      sight.color = (sight.is_floor ? floor(at, level) : bgr(kOutside)) * scene_.light.at(at.x(), at.y());
    } else if (hit.face == Face::top) {
      sight.color = bgr(hit.solid->top_rgb) * scene_.light.at(at.x(), at.y());
    } else {
      sight.color = bgr(hit.solid->side_rgb) * scene_.light.on_side(at.x(), at.y(), hit.normal);
    }
    return sight;
  }

  /// Whether the pixel shows one face without a pattern, so that its middle stands for all of it.
  bool is_even(const Sight& middle, const PixelRays& pixel) const {
    if (middle.is_floor) return false;
    for (const double u : {-0.5, 0.5}) {
      for (const double v : {-0.5, 0.5}) {
        const Sight corner = look(pixel.centre + u * pixel.along_x + v * pixel.along_y, 0);
        if (corner.is_floor || corner.wall != middle.wall || corner.face != middle.face) return false;
      }
    }
    return true;
  }

  /// The floor's level for rays that lie this far apart (per unit of their length), as it is seen in this
  /// direction.
  int level(const Eigen::Vector3d& direction, double apart) const {
    if (direction.z() >= 0.0) return 0;
    return scene_.floor.texture.level_for(eye_.z() / -direction.z() * apart / scene_.floor.metres_per_px);
  }

 private:
  bool inside(const Eigen::Vector3d& p) const {
    return std::abs(p.x()) <= 0.5 * scene_.room.size_m[0] && std::abs(p.y()) <= 0.5 * scene_.room.size_m[1];
  }
  Bgr floor(const Eigen::Vector3d& at, int level) const {
    const Texture& texture = scene_.floor.texture;
    const double mpp = scene_.floor.metres_per_px;
    const double column = 0.5 * (texture.width_px() - 1) + at.x() / mpp;
    const double row = 0.5 * (texture.height_px() - 1) - at.y() / mpp;
    return texture.sample(level, static_cast<float>(column), static_cast<float>(row));
  }

  const StandingScene& scene_;
  Eigen::Vector3d eye_;
  std::vector<Solid> walls_;
  std::vector<const Solid*> wall_pointers_;
};

}  // namespace

void put_pixel(cv::Mat& mean, const cv::Point& pixel, const Bgr& grey) {
  auto& m = mean.at<cv::Vec3w>(pixel);
  for (int c = 0; c < 3; ++c)
    m[c] = static_cast<std::uint16_t>(std::clamp(grey[c] * kGreyOne + 0.5F, 0.0F, 65535.0F));
}

StandingPicture draw_standing(const StandingScene& scene, const CameraModel& camera, const RayField& rays) {
  const cv::Size size(camera.parameters().width_px, camera.parameters().height_px);
  StandingPicture picture{cv::Mat(size, CV_16UC3), cv::Mat(size, CV_32FC1), cv::Mat(size, CV_8UC1)};
  const Eigen::Vector3d eye = camera.map_from_camera().translation();
  const Eigen::Vector3d axis = camera.map_from_camera().linear().col(2);
  const Painter painter(scene, eye);
  const auto draw_pixel = [&](int x, int y) {
    const PixelRays pixel = rays.pixel(x, y);
    Bgr color = Bgr::Zero();
    Sight middle;
    if (pixel.valid()) {
      const int level = painter.level(pixel.centre, 0.25 * pixel.along_x.norm());
      middle = painter.look(pixel.centre, level);
      color = middle.color;
      if (!painter.is_even(middle, pixel)) {
        color.setZero();
        for (std::size_t i = 0; i < kSamples; ++i) color += painter.look(pixel.sample(i), level).color;
        color /= static_cast<float>(kSamples);
      }
    }
    put_pixel(picture.mean, {x, y}, color * scene.light.vignette(x, y));
    const double depth = std::isfinite(middle.distance) ? middle.distance * pixel.centre.dot(axis) : 0.0;
    picture.metres.at<float>(y, x) = static_cast<float>(std::max(0.0, depth));
    picture.floor.at<std::uint8_t>(y, x) = middle.is_floor ? 1 : 0;
  };
  cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < size.width; ++x) draw_pixel(x, y);
    }
  });
  return picture;
}

}  // namespace skylight::sim
