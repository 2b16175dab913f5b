#include "sim/render/standing.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/core/utility.hpp>

#include "sim/camera/noise.hpp"

namespace skylight::sim {
namespace {

constexpr double kWallThickness = 0.08;  ///< m, as seen from above
constexpr Color kOutside{47.0, 44.0, 44.0};

class Painter {
 public:
  Painter(const StandingScene& scene, const CameraModel& camera, const RayField& rays,
          StandingPicture& picture)
      : scene_(scene),
        rays_(rays),
        picture_(picture),
        eye_(camera.map_from_camera().translation()),
        axis_(camera.map_from_camera().linear().col(2)) {}

  void draw(int x, int y) {
    const PixelRays pixel = rays_.pixel(x, y);
    Bgr color = Bgr::Zero();
    float metres = 0.0F;
    bool is_floor = false;
    if (pixel.valid() && pixel.centre.z() < 0.0) {
      const Eigen::Vector3d at = meet(pixel.centre);
      is_floor = inside(at);
      metres = static_cast<float>(std::max(0.0, -eye_.z() / pixel.centre.z() * pixel.centre.dot(axis_)));
      const Eigen::Vector3d to_eye = (eye_ - at).normalized();
      const double light = scene_.light.at(at);
      color = samples(pixel) * static_cast<float>(light);
      if (is_floor) add_lamps(at, to_eye, {x, y}, light, color);
    }
    color *= scene_.light.vignette(x, y);
    auto& mean = picture_.mean.at<cv::Vec3w>(y, x);
    for (int c = 0; c < 3; ++c)
      mean[c] = static_cast<std::uint16_t>(std::clamp(color[c] * kGreyOne + 0.5F, 0.0F, 65535.0F));
    picture_.metres.at<float>(y, x) = metres;
    picture_.floor.at<std::uint8_t>(y, x) = is_floor ? 1 : 0;
  }

 private:
  Eigen::Vector3d meet(const Eigen::Vector3d& direction) const {
    return eye_ - direction * (eye_.z() / direction.z());
  }
  bool inside(const Eigen::Vector3d& p) const {
    return std::abs(p.x()) <= 0.5 * scene_.room.size_m[0] && std::abs(p.y()) <= 0.5 * scene_.room.size_m[1];
  }

  /// What the floor mirrors of the lamps, and which share of all its light is each lamp's.
  void add_lamps(const Eigen::Vector3d& at, const Eigen::Vector3d& to_eye, const cv::Point& pixel,
                 double light, Bgr& color) {
    const double matt = std::max(1e-3, static_cast<double>(color.mean()));
    double all = matt;
    for (std::size_t i = 0; i < picture_.shares.size(); ++i) {
      const double mirrored = scene_.light.mirrored(i, at, to_eye, scene_.room.floor.gloss);
      const double matt_part = light > 0.0 ? matt * scene_.light.from_lamp(i, at) / light : 0.0;
      picture_.shares[i].at<float>(pixel) = static_cast<float>(matt_part + mirrored);
      color += Bgr::Constant(static_cast<float>(mirrored));
      all += mirrored;
    }
    for (cv::Mat& share : picture_.shares) share.at<float>(pixel) /= static_cast<float>(all);
  }

  Bgr samples(const PixelRays& pixel) const {
    const double apart_m = eye_.z() / -pixel.centre.z() * 0.25 * pixel.along_x.norm();
    const int level = scene_.floor.texture.level_for(apart_m / scene_.floor.metres_per_px);
    Bgr sum = Bgr::Zero();
    for (std::size_t i = 0; i < kSamples; ++i) {
      const Eigen::Vector3d direction = pixel.sample(i);
      if (direction.z() >= 0.0) continue;
      const Eigen::Vector3d at = meet(direction);
      sum += inside(at) ? floor(at, level, apart_m) : bgr(kOutside);
    }
    return sum / static_cast<float>(kSamples);
  }

  Bgr floor(const Eigen::Vector3d& at, int level, double apart_m) const {
    const auto& prints = scene_.floor.prints;
    const auto on_top = std::find_if(prints.rbegin(), prints.rend(),
                                     [&](const FloorPrint& print) { return print.covers(at.head<2>()); });
    if (on_top != prints.rend()) return on_top->sample(at.head<2>(), apart_m);
    const Texture& texture = scene_.floor.texture;
    const double mpp = scene_.floor.metres_per_px;
    const double column = 0.5 * (texture.width_px() - 1) + at.x() / mpp;
    const double row = 0.5 * (texture.height_px() - 1) - at.y() / mpp;
    return texture.sample(level, static_cast<float>(column), static_cast<float>(row));
  }

  const StandingScene& scene_;
  const RayField& rays_;
  StandingPicture& picture_;
  Eigen::Vector3d eye_;
  Eigen::Vector3d axis_;
};

}  // namespace

StandingPicture StandingPicture::clone() const {
  StandingPicture copy{mean.clone(), metres.clone(), floor.clone(), {}};
  for (const cv::Mat& share : shares) copy.shares.push_back(share.clone());
  return copy;
}

StandingPicture draw_floor(const StandingScene& scene, const CameraModel& camera, const RayField& rays) {
  const cv::Size size(camera.parameters().width_px, camera.parameters().height_px);
  StandingPicture picture{cv::Mat(size, CV_16UC3), cv::Mat(size, CV_32FC1), cv::Mat(size, CV_8UC1), {}};
  for (std::size_t i = 0; i < scene.light.lamps().size(); ++i)
    picture.shares.emplace_back(size, CV_32FC1, cv::Scalar(0.0));
  Painter painter(scene, camera, rays, picture);
  cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < size.width; ++x) painter.draw(x, y);
    }
  });
  return picture;
}

std::optional<Body> make_walls(const RoomSpec& room) {
  if (room.wall_height_m <= 0.0) return std::nullopt;
  const double x = 0.5 * room.size_m[0];
  const double y = 0.5 * room.size_m[1];
  const double t = kWallThickness;
  const auto wall = [&](double x0, double y0, double x1, double y1) {
    return Solid{SolidKind::box, {x0, y0, 0.0}, {x1, y1, room.wall_height_m},
                 room.wall_rgb,  room.wall_rgb, false};
  };
  return Body{{wall(-x - t, -y - t, x + t, -y), wall(-x - t, y, x + t, y + t), wall(-x - t, -y, -x, y),
               wall(x, -y, x + t, y)},
              std::nullopt,
              0.0};
}

}  // namespace skylight::sim
