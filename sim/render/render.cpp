#include "sim/render/render.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace skylight::sim {
namespace {

constexpr std::size_t kMidpoint = kSamples;
constexpr double kShadowReach = 0.06;  ///< m, how far a contact shadow spreads
constexpr std::size_t kMaxSolids = 16;

/// robot_from_map at one instant, as rays need it.
struct Stance {
  double cosine = 1.0;
  double sine = 0.0;
  Eigen::Vector3d eye{0.0, 0.0, 0.0};  ///< the camera in the robot frame

  Eigen::Vector3d turned(const Eigen::Vector3d& d) const {
    return {cosine * d.x() + sine * d.y(), cosine * d.y() - sine * d.x(), d.z()};
  }
  Eigen::Vector3d turned_back(const Eigen::Vector3d& d) const {
    return {cosine * d.x() - sine * d.y(), cosine * d.y() + sine * d.x(), d.z()};
  }
};

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

/// The part of the picture that a robot and its shadow may cover at these poses. The whole picture where they
/// reach behind the camera or out of the lens's range; empty where nothing of them is in front of it.
cv::Rect covered(const CameraModel& camera, const Solid& bound, const std::array<Pose2, 2>& poses) {
  cv::Rect2d region;
  bool some = false;
  bool all = true;
  for (int i = 0; i < 36; ++i) {  // 3 x 3 points, on the floor with the shadow and at the top, at both poses
    const Pose2& pose = poses[i < 18 ? 0 : 1];
    const bool on_floor = i % 18 < 9;
    const double margin = on_floor ? kShadowReach : 0.0;
    const double x = bound.min.x() - margin + 0.5 * (i % 3) * (bound.max.x() - bound.min.x() + 2.0 * margin);
    const double y =
        bound.min.y() - margin + 0.5 * (i / 3 % 3) * (bound.max.y() - bound.min.y() + 2.0 * margin);
    const double c = std::cos(pose.yaw);
    const double s = std::sin(pose.yaw);
    const auto pixel =
        camera.project_map({pose.x + c * x - s * y, pose.y + s * x + c * y, on_floor ? 0.0 : bound.max.z()});
    if (!pixel) {
      all = false;
      continue;
    }
    constexpr double kMargin = 3.0;  // a lens bends straight edges a little
    const cv::Rect2d point(pixel->x() - kMargin, pixel->y() - kMargin, 2.0 * kMargin + 1.0,
                           2.0 * kMargin + 1.0);
    region = some ? (region | point) : point;
    some = true;
  }
  const cv::Rect whole(0, 0, camera.parameters().width_px, camera.parameters().height_px);
  if (!some) return {};
  if (!all) return whole;
  const cv::Rect2d seen = region & cv::Rect2d(whole);
  const cv::Point low(static_cast<int>(seen.x), static_cast<int>(seen.y));
  const cv::Point high(static_cast<int>(std::ceil(seen.br().x)), static_cast<int>(std::ceil(seen.br().y)));
  return cv::Rect(low, high) & whole;
}

}  // namespace

/// A robot in one exposure.
struct Renderer::Placed {
  const RobotLook* look = nullptr;
  std::array<Stance, kSamples + 1> stances;  ///< of the samples, and of the midpoint
  Eigen::Vector2d position;                  ///< at the midpoint
  Solid bound;                               ///< one box around all solids
  double motion = 0.0;            ///< m, how far any part of it gets from its place at the midpoint
  cv::Rect region;                ///< of the picture that it and its shadow may cover
  int level = 0;                  ///< of the picture's pyramid
  float light = 1.0F;             ///< on faces that look up
  Bgr plate_color = Bgr::Zero();  ///< beside the picture
};

/// A robot that may be seen in a pixel, and those of its solids that may be, highest top first.
struct Renderer::Candidate {
  const Placed* robot = nullptr;
  std::array<const Solid*, kMaxSolids> solids{};
  std::size_t count = 0;
  double margin = 0.0;  ///< m, within which all samples pass around the middle ray, in the robot frame
};

/// What a ray sees of the robots; no robot: nothing of them.
struct Renderer::Seen {
  const Placed* robot = nullptr;
  const Stance* stance = nullptr;
  Ray ray;  ///< in the robot frame
  Hit hit;
};

Renderer::Renderer(const Scenario& scenario, const CameraSpec& camera, const FloorTexture& floor)
    : camera_(camera_model(camera)),
      light_(scenario.light, scenario.room, camera),
      rays_(camera_),
      standing_(draw_standing({scenario.room, floor, light_}, camera_, rays_)),
      contact_shadow_(scenario.light.contact_shadow),
      sample_angle_(0.25 / std::max(camera.fx_px, camera.fy_px)),
      eye_(camera_.map_from_camera().translation()),
      axis_(camera_.map_from_camera().linear().col(2)),
      mean_(standing_.mean.clone()) {
  if (camera.depth.enabled) metres_ = standing_.metres.clone();
}

void Renderer::draw(const std::vector<RobotLook>& robots, const PoseDuring& pose) {
  restore();
  std::vector<Placed> placed;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    Placed robot = place(robots[i], i, pose);
    if (!robot.region.empty()) placed.push_back(std::move(robot));
  }
  for (std::size_t i = 0; i < placed.size(); ++i) draw_region(placed, i);
  for (const Placed& robot : placed) drawn_.push_back(robot.region);
}

void Renderer::restore() {
  for (const cv::Rect& region : drawn_) {
    standing_.mean(region).copyTo(mean_(region));
    if (!metres_.empty()) standing_.metres(region).copyTo(metres_(region));
  }
  drawn_.clear();
}

Renderer::Placed Renderer::place(const RobotLook& look, std::size_t index, const PoseDuring& pose) const {
  Placed robot;
  robot.look = &look;
  robot.bound = bounding_box(look.model->solids);
  const std::array<Pose2, 2> ends{pose(index, 0.0), pose(index, 1.0)};
  robot.region = covered(camera_, robot.bound, ends);
  if (robot.region.empty()) return robot;
  for (std::size_t i = 0; i <= kSamples; ++i) {
    const Pose2 there = pose(index, i == kMidpoint ? 0.5 : sixteenth(kTime[i]));
    Stance& stance = robot.stances[i];
    stance.cosine = std::cos(there.yaw);
    stance.sine = std::sin(there.yaw);
    stance.eye = stance.turned(eye_ - Eigen::Vector3d(there.x, there.y, 0.0));
  }
  const Pose2 middle = pose(index, 0.5);
  robot.position = middle.position();
  const double radius = robot.bound.min.cwiseAbs().cwiseMax(robot.bound.max.cwiseAbs()).head<2>().norm();
  for (const Pose2& end : ends) {
    const double turned = std::abs(wrap_angle(end.yaw - middle.yaw));
    robot.motion = std::max(robot.motion, (end.position() - middle.position()).norm() + turned * radius);
  }
  const Eigen::Vector3d plate(middle.x, middle.y, look.model->plate_height_m);
  robot.level = look.picture.level_for((plate - eye_).norm() * sample_angle_ / look.metres_per_px);
  robot.light = light_.at(middle.x, middle.y);
  for (const Solid& solid : look.model->solids) {
    if (solid.carries_picture) robot.plate_color = bgr(solid.top_rgb);
  }
  return robot;
}

void Renderer::draw_region(const std::vector<Placed>& placed, std::size_t index) {
  const cv::Rect region = placed[index].region;
  std::vector<const Placed*> robots;
  std::vector<cv::Rect> done;
  for (std::size_t j = 0; j < placed.size(); ++j) {
    if ((placed[j].region & region).empty()) continue;
    robots.push_back(&placed[j]);
    if (j < index) done.push_back(placed[j].region);
  }
  std::vector<Candidate> scratch;
  for (int y = region.y; y < region.y + region.height; ++y) {
    for (int x = region.x; x < region.x + region.width; ++x) {
      const bool drawn = std::any_of(done.begin(), done.end(), [&](const cv::Rect& r) {
        return r.contains({x, y});
      });
      if (!drawn) draw_pixel(robots, scratch, {x, y});
    }
  }
}

/// Which robots and which of their solids any sample of the pixel may meet: those that its middle ray passes
/// near enough.
void Renderer::gather(const std::vector<const Placed*>& robots, const PixelRays& pixel,
                      std::vector<Candidate>& candidates) {
  candidates.clear();
  const double spread = 0.75 * (pixel.along_x.norm() + pixel.along_y.norm()) / pixel.centre.norm();
  for (const Placed* robot : robots) {
    const Stance& stance = robot->stances[kMidpoint];
    const Ray ray{stance.eye, stance.turned(pixel.centre)};
    Candidate candidate;
    candidate.robot = robot;
    candidate.margin = spread * (stance.eye.norm() + 1.0) + robot->motion + 1e-4;
    if (!passes_near(robot->bound, ray, candidate.margin)) continue;
    for (const Solid& solid : robot->look->model->solids) {
      if (passes_near(solid, ray, candidate.margin)) candidate.solids.at(candidate.count++) = &solid;
    }
    if (candidate.count > 0) candidates.push_back(candidate);
  }
}

void Renderer::draw_pixel(const std::vector<const Placed*>& robots, std::vector<Candidate>& candidates,
                          const cv::Point& at) {
  const PixelRays pixel = rays_.pixel(at.x, at.y);
  if (!pixel.valid()) return;
  gather(robots, pixel, candidates);
  // Nothing of a robot shows behind this (with some slack: it is the pixel centre's; the floor hides
  // nothing).
  const auto standing_metres = static_cast<double>(standing_.metres.at<float>(at));
  const double limit = standing_metres > 0.0 ? standing_metres / pixel.centre.dot(axis_) + 0.02
                                             : std::numeric_limits<double>::infinity();
  Bgr sum = Bgr::Zero();
  std::size_t misses = 0;
  if (candidates.empty()) {
    misses = kSamples;
  } else if (candidates.size() == 1 && standing_.floor.at<std::uint8_t>(at) != 0 &&
             only_plate(candidates[0], pixel.centre)) {
    sum = plate_sum(candidates[0], pixel);
  } else {
    for (std::size_t i = 0; i < kSamples; ++i) {
      const Seen seen = trace(candidates, i, pixel.sample(i), limit);
      if (seen.robot == nullptr) ++misses;
      if (seen.robot != nullptr) sum += shade(seen);
    }
  }
  sum *= light_.vignette(at.x, at.y);
  if (misses > 0) sum += static_cast<float>(misses) * behind(robots, pixel.centre, at);
  put_pixel(mean_, at, sum / static_cast<float>(kSamples));
  if (metres_.empty() || candidates.empty()) return;
  const Seen seen = trace(candidates, kMidpoint, pixel.centre, limit);
  if (seen.robot != nullptr)
    metres_.at<float>(at) = static_cast<float>(seen.hit.distance * pixel.centre.dot(axis_));
}

/// The standing picture at a pixel, in the robots' contact shadows.
Bgr Renderer::behind(const std::vector<const Placed*>& robots, const Eigen::Vector3d& direction,
                     const cv::Point& at) const {
  const bool on_floor = standing_.floor.at<std::uint8_t>(at) != 0;
  const double left = on_floor ? shadow(robots, direction) : 1.0;
  const auto& mean = standing_.mean.at<cv::Vec3w>(at);
  return Bgr(mean[0], mean[1], mean[2]) * static_cast<float>(left / kGreyOne);
}

Renderer::Seen Renderer::trace(const std::vector<Candidate>& candidates, std::size_t sample,
                               const Eigen::Vector3d& direction, double limit) const {
  Seen seen;
  seen.hit.distance = limit;
  for (const Candidate& candidate : candidates) {
    const Stance& stance = candidate.robot->stances[sample];
    const Ray ray{stance.eye, stance.turned(direction)};
    if (!intersect(std::span(candidate.solids.data(), candidate.count), ray, seen.hit)) continue;
    seen.robot = candidate.robot;
    seen.stance = &stance;
    seen.ray = ray;
  }
  return seen;
}

Bgr Renderer::shade(const Seen& seen) const {
  const Placed& robot = *seen.robot;
  const Solid& solid = *seen.hit.solid;
  if (seen.hit.face == Face::side) {
    const Eigen::Vector3d normal = seen.stance->turned_back(seen.hit.normal);
    return bgr(solid.side_rgb) * light_.on_side(robot.position.x(), robot.position.y(), normal);
  }
  if (solid.carries_picture) return plate(robot, seen.ray.origin + seen.hit.distance * seen.ray.direction);
  return bgr(solid.top_rgb) * robot.light;
}

/// Colour of the top plate at a place of the robot frame: its picture, or the plate beside it.
Bgr Renderer::plate(const Placed& robot, const Eigen::Vector3d& at) const {
  const Texture& picture = robot.look->picture;
  const Rectangle& area = robot.look->model->plate;
  const double mpp = robot.look->metres_per_px;
  const double row = 0.5 * (picture.height_px() - 1) - (at.x() - 0.5 * (area.min.x() + area.max.x())) / mpp;
  const double column = 0.5 * (picture.width_px() - 1) - (at.y() - 0.5 * (area.min.y() + area.max.y())) / mpp;
  if (row < -0.5 || column < -0.5 || row > picture.height_px() - 0.5 || column > picture.width_px() - 0.5) {
    return robot.plate_color * robot.light;
  }
  return picture.sample(robot.level, static_cast<float>(column), static_cast<float>(row)) * robot.light;
}

/// Whether every sample of the pixel meets the plate's upper side and nothing before: nothing higher is near,
/// and the middle ray meets the plate far enough from its edge.
bool Renderer::only_plate(const Candidate& candidate, const Eigen::Vector3d& direction) {
  const Solid& highest = *candidate.solids.front();
  const Stance& stance = candidate.robot->stances[kMidpoint];
  const Eigen::Vector3d down = stance.turned(direction);
  if (!highest.carries_picture || down.z() >= 0.0 || stance.eye.z() <= highest.max.z()) return false;
  const Eigen::Vector3d at = stance.eye + down * ((highest.max.z() - stance.eye.z()) / down.z());
  const double along_plane = candidate.margin * down.norm() / -down.z();  // the margin is across the ray
  return ((at - highest.min).head<2>().array() > along_plane).all() &&
         ((highest.max - at).head<2>().array() > along_plane).all();
}

/// The sum of the samples of a pixel for which only_plate() holds.
Bgr Renderer::plate_sum(const Candidate& candidate, const PixelRays& pixel) const {
  const double top = candidate.solids.front()->max.z();
  Bgr sum = Bgr::Zero();
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Stance& stance = candidate.robot->stances[i];
    const Eigen::Vector3d direction = stance.turned(pixel.sample(i));
    sum += plate(*candidate.robot, stance.eye + direction * ((top - stance.eye.z()) / direction.z()));
  }
  return sum;
}

/// How much of the floor's light the robots' contact shadows leave where this ray meets the floor.
double Renderer::shadow(const std::vector<const Placed*>& robots, const Eigen::Vector3d& direction) const {
  double left = 1.0;
  for (const Placed* robot : robots) {
    const Stance& stance = robot->stances[kMidpoint];
    const Eigen::Vector3d along = stance.turned(direction);
    const Eigen::Vector2d point = (stance.eye - along * (stance.eye.z() / along.z())).head<2>();
    double nearest = kShadowReach;
    for (const Rectangle& part : robot->look->model->footprint) {
      nearest = std::min(nearest, (part.min - point).cwiseMax(point - part.max).cwiseMax(0.0).norm());
    }
    const double closeness = 1.0 - nearest / kShadowReach;
    left *= 1.0 - contact_shadow_ * closeness * closeness;
  }
  return left;
}

}  // namespace skylight::sim
