#include "sim/render.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>
#include <opencv2/core/utility.hpp>

#include "sim/solids.hpp"

namespace skylight::sim {

/// A robot in one exposure.
struct Renderer::Placed {
  struct Stance {  ///< robot_from_map at one instant, as it is needed: turn, and the camera in the robot
                   ///< frame
    double cosine;
    double sine;
    Eigen::Vector3d eye;

    Eigen::Vector3d turned(const Eigen::Vector3d& d) const {
      return {cosine * d.x() + sine * d.y(), cosine * d.y() - sine * d.x(), d.z()};
    }
  };
  const RobotLook* look = nullptr;
  std::array<Stance, 17> stances;  ///< of the sixteen samples, and of the midpoint
  Eigen::Vector2d position;        ///< at the midpoint
  std::vector<Solid> bound;        ///< one box around all solids
  cv::Rect region;
  int level = 0;  ///< of the picture's pyramid
  float light = 1.0F;
};

namespace {

constexpr int kSamples = 16;
constexpr int kMidpoint = kSamples;
/// Sample i lies at column (i + 0.5) / 16, row (kRow[i] + 0.5) / 16 of the pixel, at share (kTime[i] + 0.5) /
/// 16 of the exposure: each sixteenth of each of the three is used once, the three are uncorrelated, and the
/// set is its own mirror image through the middle (so its first moments vanish, and all odd ones).
constexpr std::array<int, kSamples> kRow{2, 9, 15, 4, 12, 8, 1, 5, 10, 14, 7, 3, 11, 0, 6, 13};
constexpr std::array<int, kSamples> kTime{7, 3, 14, 4, 9, 5, 15, 13, 2, 0, 10, 6, 11, 1, 12, 8};
constexpr double share(int sixteenth) {
  return (sixteenth + 0.5) / kSamples;
}

constexpr double kShadowReach = 0.06;    ///< m, how far a contact shadow spreads
constexpr double kWallThickness = 0.08;  ///< m, as seen from above
constexpr double kSideLight = 0.6;       ///< light on upright faces, of that on the floor
const Bgr kOutside(46.0F, 46.0F, 48.0F);

std::vector<Solid> make_walls(const RoomSpec& room) {
  if (room.wall_height_m <= 0.0) return {};
  const double x = 0.5 * room.size_m[0];
  const double y = 0.5 * room.size_m[1];
  const double t = kWallThickness;
  const double h = room.wall_height_m;
  const Color& rgb = room.wall_rgb;
  const auto wall = [&](double x0, double y0, double x1, double y1) {
    return Solid{SolidKind::box, {x0, y0, 0.0}, {x1, y1, h}, rgb, rgb, false};
  };
  return {wall(-x - t, -y - t, x + t, -y), wall(-x - t, y, x + t, y + t), wall(-x - t, -y, -x, y),
          wall(x, -y, x + t, y)};
}

Solid bounding_box(const std::vector<Solid>& solids) {
  Solid bound;
  bound.min.setConstant(std::numeric_limits<double>::infinity());
  bound.max = -bound.min;
  for (const Solid& solid : solids) {
    bound.min = bound.min.cwiseMin(solid.min);
    bound.max = bound.max.cwiseMax(solid.max);
  }
  return bound;
}

Eigen::Vector3d ray_at(const cv::Mat& rays, int x, int y) {
  const auto& v = rays.at<cv::Vec3f>(y + 1, x + 1);
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// Direction through a place in a pixel, from its neighbours' directions.
struct PixelRays {
  PixelRays(const cv::Mat& rays, int x, int y)
      : centre(ray_at(rays, x, y)),
        along_x(0.5 * (ray_at(rays, x + 1, y) - ray_at(rays, x - 1, y))),
        along_y(0.5 * (ray_at(rays, x, y + 1) - ray_at(rays, x, y - 1))) {}
  Eigen::Vector3d sample(int i) const {
    return centre + along_x * (share(i) - 0.5) + along_y * (share(kRow[static_cast<std::size_t>(i)]) - 0.5);
  }
  /// False beyond the lens's range.
  bool valid() const { return along_x.allFinite() && along_y.allFinite() && centre.allFinite(); }

  Eigen::Vector3d centre, along_x, along_y;
};

}  // namespace

Renderer::Renderer(const Scenario& scenario, const CameraSpec& camera, const FloorTexture& floor)
    : scenario_(scenario),
      spec_(camera),
      camera_(camera_model(camera)),
      noise_(camera.sensor),
      eye_(camera_.map_from_camera().translation()),
      axis_(camera_.map_from_camera().linear().col(2)) {
  cast_rays();
  const cv::Size size(spec_.width_px, spec_.height_px);
  standing_mean_.create(size, CV_16UC3);
  standing_scale_.create(size, CV_16UC3);
  standing_metres_.create(size, CV_32FC1);
  standing_floor_.create(size, CV_8UC1);
  mean_ = standing_mean_;
  scale_ = standing_scale_;
  const std::vector<Solid> walls = make_walls(scenario.room);
  cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) draw_standing_row(walls, floor, y);
  });
  mean_ = standing_mean_.clone();
  scale_ = standing_scale_.clone();
  if (spec_.depth.enabled) metres_ = standing_metres_.clone();
}

void Renderer::cast_rays() {
  rays_.create(spec_.height_px + 2, spec_.width_px + 2, CV_32FC3);
  const Eigen::Matrix3d turn = camera_.map_from_camera().linear();
  cv::parallel_for_(cv::Range(0, rays_.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < rays_.cols; ++x) {
        const auto seen = camera_.direction({x - 1.0, y - 1.0});
        const Eigen::Vector3d d = seen ? Eigen::Vector3d(turn * *seen)
                                       : Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
        rays_.at<cv::Vec3f>(y, x) = {static_cast<float>(d.x()), static_cast<float>(d.y()),
                                     static_cast<float>(d.z())};
      }
    }
  });
}

float Renderer::light_at(double x, double y) const {
  const LightSpec& light = scenario_.light;
  const double angle = light.gradient_deg * std::numbers::pi / 180.0;
  const double reach = 0.5 * std::hypot(scenario_.room.size_m[0], scenario_.room.size_m[1]);
  const double across = std::clamp((x * std::cos(angle) + y * std::sin(angle)) / reach, -1.0, 1.0);
  return static_cast<float>(light.level * (1.0 + 0.5 * light.gradient * across));
}

float Renderer::vignette(int x, int y) const {
  const double u = x - 0.5 * (spec_.width_px - 1);
  const double v = y - 0.5 * (spec_.height_px - 1);
  const double corner = 0.25 * (std::pow(spec_.width_px, 2) + std::pow(spec_.height_px, 2));
  return static_cast<float>(1.0 - spec_.vignetting * (u * u + v * v) / corner);
}

void Renderer::put(int x, int y, const Bgr& grey) {
  auto& mean = mean_.at<cv::Vec3w>(y, x);
  auto& scale = scale_.at<cv::Vec3w>(y, x);
  for (int c = 0; c < 3; ++c) {
    mean[c] = static_cast<std::uint16_t>(std::clamp(grey[c] * kGreyOne + 0.5F, 0.0F, 65535.0F));
    scale[c] = noise_.scale(mean[c]);
  }
}

void Renderer::draw_standing_row(const std::vector<Solid>& walls, const FloorTexture& floor, int row) {
  const double half_x = 0.5 * scenario_.room.size_m[0];
  const double half_y = 0.5 * scenario_.room.size_m[1];
  const Texture& texture = floor.texture;
  for (int x = 0; x < spec_.width_px; ++x) {
    const PixelRays pixel(rays_, x, row);
    Bgr sum = Bgr::Zero();
    double depth = 0.0;
    bool is_floor = false;
    for (int i = 0; i <= kSamples && pixel.valid(); ++i) {
      const bool middle = i == kMidpoint;
      const Ray ray{eye_, middle ? pixel.centre : pixel.sample(i)};
      Hit hit;
      Bgr color = Bgr::Zero();
      hit.distance =
          ray.direction.z() < 0.0 ? -eye_.z() / ray.direction.z() : std::numeric_limits<double>::infinity();
      intersect(walls, ray, hit);
      const Eigen::Vector3d at = eye_ + hit.distance * ray.direction;
      if (hit.solid != nullptr) {
        const float facing =
            hit.face == Face::top
                ? 1.0F
                : static_cast<float>(kSideLight + 0.08 * hit.normal.x() + 0.05 * hit.normal.y());
        color = bgr(hit.solid->top_rgb) * facing * light_at(at.x(), at.y());
      } else if (std::isfinite(hit.distance)) {
        is_floor = std::abs(at.x()) <= half_x && std::abs(at.y()) <= half_y;
        if (is_floor) {
          const double footprint = hit.distance * pixel.along_x.norm() / 4.0 / floor.metres_per_px;
          const double column = 0.5 * (texture.width_px() - 1) + at.x() / floor.metres_per_px;
          const double line = 0.5 * (texture.height_px() - 1) - at.y() / floor.metres_per_px;
          color = texture.sample(texture.level_for(footprint), static_cast<float>(column),
                                 static_cast<float>(line));
        } else {
          color = kOutside;
        }
        color *= light_at(at.x(), at.y());
      }
      if (!middle) sum += color;
      if (middle && std::isfinite(hit.distance)) depth = hit.distance * ray.direction.dot(axis_);
      if (middle) is_floor = is_floor && hit.solid == nullptr;
    }
    put(x, row, sum * (vignette(x, row) / kSamples));
    standing_metres_.at<float>(row, x) = static_cast<float>(std::max(0.0, depth));
    standing_floor_.at<std::uint8_t>(row, x) = is_floor ? 1 : 0;
  }
}

void Renderer::restore() {
  for (const cv::Rect& region : drawn_) {
    standing_mean_(region).copyTo(mean_(region));
    standing_scale_(region).copyTo(scale_(region));
    if (!metres_.empty()) standing_metres_(region).copyTo(metres_(region));
  }
  drawn_.clear();
}

namespace {

/// The part of the picture that a robot (and its shadow) may cover at this pose; grows `region`.
void cover(const CameraModel& camera, const Solid& bound, const Pose2& pose, cv::Rect2d& region,
           bool& everything) {
  const double c = std::cos(pose.yaw);
  const double s = std::sin(pose.yaw);
  int seen = 0;
  for (int i = 0; i < 18; ++i) {
    const double margin = i < 9 ? kShadowReach : 0.0;
    const double u = 0.5 * (i % 3);
    const double v = 0.5 * (i / 3 % 3);
    const double x = bound.min.x() - margin + u * (bound.max.x() - bound.min.x() + 2.0 * margin);
    const double y = bound.min.y() - margin + v * (bound.max.y() - bound.min.y() + 2.0 * margin);
    const auto pixel =
        camera.project_map({pose.x + c * x - s * y, pose.y + s * x + c * y, i < 9 ? 0.0 : bound.max.z()});
    if (!pixel) continue;
    const cv::Rect2d point(pixel->x() - 3.0, pixel->y() - 3.0, 7.0, 7.0);
    region = region.empty() ? point : (region | point);
    ++seen;
  }
  everything |= seen > 0 && seen < 18;  // it reaches behind the camera or out of the lens's range
}

}  // namespace

void Renderer::draw(const std::vector<RobotLook>& robots, const Exposure& exposure) {
  restore();
  const cv::Rect whole(0, 0, spec_.width_px, spec_.height_px);
  std::vector<Placed> placed;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    Placed robot;
    robot.look = &robots[i];
    robot.bound = {bounding_box(robots[i].model->solids)};
    cv::Rect2d region;
    bool everything = false;
    for (const double end : {0.0, 1.0})
      cover(camera_, robot.bound.front(), exposure.pose(i, end), region, everything);
    if (region.empty()) continue;
    const cv::Rect2d clipped = region & cv::Rect2d(whole);
    robot.region = everything ? whole
                              : cv::Rect(cv::Point(static_cast<int>(clipped.x), static_cast<int>(clipped.y)),
                                         cv::Point(static_cast<int>(std::ceil(clipped.br().x)),
                                                   static_cast<int>(std::ceil(clipped.br().y)))) &
                                    whole;
    if (robot.region.empty()) continue;
    for (int s = 0; s <= kSamples; ++s) {
      const Pose2 pose = exposure.pose(i, s == kMidpoint ? 0.5 : share(kTime[static_cast<std::size_t>(s)]));
      auto& stance = robot.stances[static_cast<std::size_t>(s)];
      stance = {std::cos(pose.yaw), std::sin(pose.yaw), Eigen::Vector3d::Zero()};
      stance.eye = stance.turned(eye_ - Eigen::Vector3d(pose.x, pose.y, 0.0));
      robot.position = pose.position();
    }
    robot.light = light_at(robot.position.x(), robot.position.y());
    const Eigen::Vector3d plate(robot.position.x(), robot.position.y(), robots[i].model->plate_height_m);
    const double footprint = (plate - eye_).norm() / std::max(spec_.fx_px, spec_.fy_px) / 4.0;
    robot.level =
        robots[i].picture.empty() ? 0 : robots[i].picture.level_for(footprint / robots[i].metres_per_px);
    placed.push_back(std::move(robot));
  }
  for (std::size_t i = 0; i < placed.size(); ++i) draw_region(placed, i);
  for (const Placed& robot : placed) drawn_.push_back(robot.region);
}

void Renderer::draw_region(const std::vector<Placed>& placed, std::size_t index) {
  const cv::Rect region = placed[index].region;
  std::vector<const Placed*> candidates;
  std::vector<cv::Rect> done;
  for (std::size_t j = 0; j < placed.size(); ++j) {
    if ((placed[j].region & region).empty()) continue;
    candidates.push_back(&placed[j]);
    if (j < index) done.push_back(placed[j].region);
  }
  for (int y = region.y; y < region.y + region.height; ++y) {
    for (int x = region.x; x < region.x + region.width; ++x) {
      const bool drawn = std::any_of(done.begin(), done.end(), [&](const cv::Rect& r) {
        return r.contains({x, y});
      });
      if (!drawn) draw_pixel(candidates, x, y);
    }
  }
}

namespace {

/// How much of the floor's light a robot's contact shadow leaves at a point, given in the robot frame.
double shadow(const RobotModel& model, double strength, const Eigen::Vector2d& point) {
  double nearest = kShadowReach;
  for (const Rectangle& part : model.footprint) {
    const Eigen::Vector2d outside = (part.min - point).cwiseMax(point - part.max).cwiseMax(0.0);
    nearest = std::min(nearest, outside.norm());
  }
  const double closeness = 1.0 - nearest / kShadowReach;
  return 1.0 - strength * closeness * closeness;
}

}  // namespace

void Renderer::draw_pixel(const std::vector<const Placed*>& candidates, int x, int y) {
  const PixelRays pixel(rays_, x, y);
  if (!pixel.valid()) return;
  const auto standing_metres = static_cast<double>(standing_metres_.at<float>(y, x));
  // Nothing of a robot shows behind this (with some slack: it is the pixel centre's; the floor hides
  // nothing).
  const double limit = standing_metres > 0.0 ? standing_metres / pixel.centre.dot(axis_) + 0.02
                                             : std::numeric_limits<double>::infinity();
  const auto trace = [&](int sample, const Eigen::Vector3d& direction, Hit& hit) {
    const Placed* nearest = nullptr;
    hit.distance = limit;
    for (const Placed* robot : candidates) {
      const auto& stance = robot->stances[static_cast<std::size_t>(sample)];
      const Ray ray{stance.eye, stance.turned(direction)};
      Hit bound;
      bound.distance = hit.distance;
      if (!intersect(robot->bound, ray, bound)) continue;
      if (intersect(robot->look->model->solids, ray, hit)) nearest = robot;
    }
    return nearest;
  };

  Bgr sum = Bgr::Zero();
  int misses = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector3d direction = pixel.sample(i);
    Hit hit;
    if (const Placed* robot = trace(i, direction, hit)) {
      const auto& stance = robot->stances[static_cast<std::size_t>(i)];
      sum += shade(*robot, {stance.eye, stance.turned(direction)}, hit);
    } else {
      ++misses;
    }
  }
  sum *= vignette(x, y);
  if (misses > 0) {
    double left = 1.0;
    if (standing_floor_.at<std::uint8_t>(y, x) != 0) {
      for (const Placed* robot : candidates) {
        const auto& stance = robot->stances[kMidpoint];
        const Eigen::Vector3d direction = stance.turned(pixel.centre);
        const Eigen::Vector3d floor = stance.eye - direction * (stance.eye.z() / direction.z());
        left *= shadow(*robot->look->model, scenario_.light.contact_shadow, floor.head<2>());
      }
    }
    const auto& behind = standing_mean_.at<cv::Vec3w>(y, x);
    const float weight = static_cast<float>(misses * left / kGreyOne);
    for (int c = 0; c < 3; ++c) sum[c] += weight * static_cast<float>(behind[c]);
  }
  put(x, y, sum / kSamples);
  if (!metres_.empty()) {
    Hit hit;
    if (trace(kMidpoint, pixel.centre, hit) != nullptr) {
      metres_.at<float>(y, x) = static_cast<float>(hit.distance * pixel.centre.dot(axis_));
    }
  }
}

Bgr Renderer::shade(const Placed& placed, const Ray& ray, const Hit& hit) const {
  const Solid& solid = *hit.solid;
  if (hit.face == Face::side) {
    const double facing = kSideLight + 0.15 * hit.normal.x() + 0.1 * hit.normal.y();
    return bgr(solid.side_rgb) * static_cast<float>(facing) * placed.light;
  }
  const Texture& picture = placed.look->picture;
  if (solid.carries_picture && !picture.empty()) {
    const Eigen::Vector3d at = ray.origin + hit.distance * ray.direction;
    const RobotModel& model = *placed.look->model;
    const Eigen::Vector2d centre = 0.5 * (model.plate.min + model.plate.max);
    const double mpp = placed.look->metres_per_px;
    const double row = 0.5 * (picture.height_px() - 1) - (at.x() - centre.x()) / mpp;
    const double column = 0.5 * (picture.width_px() - 1) - (at.y() - centre.y()) / mpp;
    if (row >= -0.5 && column >= -0.5 && row <= picture.height_px() - 0.5 &&
        column <= picture.width_px() - 0.5) {
      return picture.sample(placed.level, static_cast<float>(column), static_cast<float>(row)) * placed.light;
    }
  }
  return bgr(solid.top_rgb) * placed.light;
}

}  // namespace skylight::sim
