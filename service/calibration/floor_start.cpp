#include "service/calibration/floor_start.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <opencv2/calib3d.hpp>

#include "service/calibration/text.hpp"

namespace skylight::calibration {
namespace {

constexpr std::size_t kFewest = 4;
/// Below this share of its length, and below so much, a set of points is a line.
constexpr double kLineShare = 0.02;
constexpr double kLineWidth = 0.005;
/// Residuals beyond are as bad as any: px, or a share of the picture's width.
constexpr double kFarPx = 6.0;
constexpr double kFarShare = 0.004;
constexpr std::size_t kSamples = 300;
/// So many points judge a sample.
constexpr std::size_t kJudges = 200;
constexpr int kStartSteps = 30;
/// At least this share of the points must agree with the pose that most agree with.
constexpr double kAgree = 0.5;
/// Focal lengths to start from where the lens is unknown, in widths of the picture.
constexpr std::array kStarts{0.2, 0.28, 0.4, 0.55, 0.75, 1.0, 1.4, 2.0, 3.0, 5.0};

/// A point at a known place of `map`, as seen.
struct Known {
  Eigen::Vector3d at;
  Pixel pixel;
  Eigen::Vector3d ray;
};

struct Guess {
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  double cost = 0.0;   ///< mean over the points of the squared residual over the far one's, each at most 1
  double agree = 0.0;  ///< share of the points
};

/// Steele, Lea and Flood, "Fast splittable pseudorandom number generators" (2014).
std::uint64_t next_random(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

bool flat(const std::vector<Known>& points) {
  const auto [low, high] = std::minmax_element(
      points.begin(), points.end(), [](const Known& a, const Known& b) { return a.at.z() < b.at.z(); });
  return high->at.z() - low->at.z() < 1e-6;
}

/// Length of the points along their longest axis and across it (two standard deviations each).
Eigen::Vector2d extent(const std::vector<Known>& points) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Known& point : points) middle += point.at.head<2>() / static_cast<double>(points.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Known& point : points) {
    const Eigen::Vector2d off = point.at.head<2>() - middle;
    spread += off * off.transpose() / static_cast<double>(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(spread, Eigen::EigenvaluesOnly);
  return 2.0 * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().reverse();
}

void refuse_line(const std::string& camera, const std::vector<Known>& points) {
  const Eigen::Vector2d size = extent(points);
  if (!flat(points) || size.y() > std::max(kLineWidth, kLineShare * size.x())) return;
  throw std::invalid_argument(camera + ": its points lie in one line (" + fixed(size.x(), 3) + " m long, " +
                              fixed(size.y(), 3) + " m wide), which leaves the camera free to turn about it");
}

std::optional<Eigen::Isometry3d> pose_of(const std::vector<Known>& points, bool in_plane) {
  // OpenCV's plane solver wants z = 0.
  const double height = in_plane ? points.front().at.z() : 0.0;
  std::vector<cv::Point3d> places;
  std::vector<cv::Point2d> seen;
  for (const Known& point : points) {
    if (!(point.ray.z() > 0.05)) continue;
    places.emplace_back(point.at.x(), point.at.y(), point.at.z() - height);
    seen.emplace_back(point.ray.x() / point.ray.z(), point.ray.y() / point.ray.z());
  }
  if (places.size() < kFewest) return std::nullopt;
  cv::Vec3d rotation;
  cv::Vec3d translation;
  const int method = in_plane ? cv::SOLVEPNP_IPPE : cv::SOLVEPNP_SQPNP;
  if (!cv::solvePnP(places, seen, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation, translation, false,
                    method))
    return std::nullopt;
  const Eigen::Vector3d turn(rotation[0], rotation[1], rotation[2]);
  Eigen::Isometry3d camera_from_map = Eigen::Isometry3d::Identity();
  camera_from_map.translation() << translation[0], translation[1], translation[2];
  if (turn.norm() > 0.0)
    camera_from_map.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  if (!camera_from_map.matrix().allFinite()) return std::nullopt;
  Eigen::Isometry3d out = camera_from_map.inverse();
  out.translation().z() += height;
  return out;
}

Guess judged(const Intrinsics& intrinsics, const Eigen::Isometry3d& pose, const std::vector<Known>& points,
             double far_px) {
  // The ray's distance from where the point is, by the angle between both, is quick and good enough to
  // compare.
  const double per_rad = intrinsics.fx_px;
  const Eigen::Isometry3d camera_from_map = pose.inverse();
  Guess out{.map_from_camera = pose};
  const std::size_t step = std::max<std::size_t>(1, points.size() / kJudges);
  double count = 0.0;
  for (std::size_t i = 0; i < points.size(); i += step) {
    const Eigen::Vector3d direction = camera_from_map * points[i].at;
    const double angle = std::atan2(points[i].ray.cross(direction).norm(), points[i].ray.dot(direction));
    const double off = angle * per_rad / far_px;
    out.cost += std::min(1.0, off * off);
    out.agree += off < 1.0 ? 1.0 : 0.0;
    count += 1.0;
  }
  out.cost /= count;
  out.agree /= count;
  return out;
}

/// The pose that most points agree with, from all of them and from fours of them (Fischler and Bolles,
/// "Random sample consensus", CACM 24 (1981)).
std::optional<Guess> best_pose(const Intrinsics& intrinsics, const std::vector<Known>& points) {
  const bool in_plane = flat(points);
  const double far_px = std::max(kFarPx, kFarShare * intrinsics.width_px);
  std::optional<Guess> best;
  const auto consider = [&](const std::vector<Known>& sample) {
    if (in_plane && extent(sample).y() < kLineShare * extent(sample).x()) return;
    const auto pose = pose_of(sample, in_plane);
    if (!pose) return;
    const Guess guess = judged(intrinsics, *pose, points, far_px);
    if (!best || guess.cost < best->cost) best = guess;
  };
  consider(points);
  std::uint64_t random = 1;
  for (std::size_t i = 0; i < kSamples && (!best || best->agree < 1.0 || i < 20); ++i) {
    std::vector<Known> sample;
    std::vector<std::size_t> taken;
    const std::size_t wanted = in_plane ? kFewest : std::min<std::size_t>(6, points.size());
    while (sample.size() < wanted) {
      const auto at = static_cast<std::size_t>(next_random(random) % points.size());
      if (std::find(taken.begin(), taken.end(), at) != taken.end()) continue;
      taken.push_back(at);
      sample.push_back(points[at]);
    }
    consider(sample);
  }
  return best;
}

std::vector<Known> known_points(const SeeingCamera& camera, const CameraModel& model,
                                const std::vector<std::optional<FloorPlace>>& places) {
  std::vector<Known> out;
  for (const SeenPoint& point : camera.points) {
    const auto ray = model.ray_from_pixel(point.pixel);
    if (places[point.sheet] && ray)
      out.push_back({in_map(*places[point.sheet], point.at), point.pixel, *ray});
  }
  return out;
}

[[noreturn]] void refuse_mirrored(const std::string& camera) {
  throw std::invalid_argument(
      camera +
      ": the places are mirrored: they fit only seen from below the floor. x and y are exchanged, or one "
      "of them has the wrong sign (x, y and z make a right hand), or the picture is mirrored");
}

/// Points of different heights that fit only as their mirror image.
bool fits_mirrored(const Intrinsics& intrinsics, std::vector<Known> points) {
  for (Known& point : points) std::swap(point.at.x(), point.at.y());
  const auto guess = best_pose(intrinsics, points);
  return guess && guess->agree > 0.9;
}

CameraModel posed(const SeeingCamera& camera, const std::vector<Known>& points) {
  refuse_line(camera.name, points);
  const auto guess = best_pose(camera.intrinsics, points);
  if (!guess) throw std::invalid_argument(camera.name + ": its points fit no pose");
  double floor = points.front().at.z();
  for (const Known& point : points) floor = std::min(floor, point.at.z());
  if (guess->agree >= kAgree && guess->map_from_camera.translation().z() < floor)
    refuse_mirrored(camera.name);
  if (guess->agree < kAgree || guess->agree * static_cast<double>(points.size()) < kFewest - 0.5) {
    if (fits_mirrored(camera.intrinsics, points)) refuse_mirrored(camera.name);
    throw std::invalid_argument(
        camera.name + ": no pose of the camera agrees with more than " + fixed(100.0 * guess->agree, 0) +
        " % of its " + std::to_string(points.size()) +
        " points: are the places in metres, in this order, and the intrinsics this camera's?");
  }
  return {camera.intrinsics, guess->map_from_camera};
}

/// Every so many-th point, which is enough to start from.
void thin(std::vector<SeenPoint>& points) {
  const std::size_t step = std::max<std::size_t>(1, points.size() / kJudges);
  std::size_t index = 0;
  std::erase_if(points, [&](const SeenPoint&) { return index++ % step != 0; });
}

/// A lens from nothing: the focal length with which the points agree best, the rest improved from there.
CameraModel posed_anyhow(const ExtrinsicsInput& input, std::size_t camera,
                         const std::vector<std::optional<FloorPlace>>& places) {
  ExtrinsicsInput alone{.sheets = input.sheets, .cameras = {input.cameras[camera]}};
  SeeingCamera& only = alone.cameras.front();
  std::vector<FloorPlace> all_places;
  for (std::size_t i = 0; i < places.size(); ++i) {
    all_places.push_back(places[i].value_or(FloorPlace{}));
    alone.sheets[i].place = all_places.back();
    alone.sheets[i].sigma_m = alone.sheets[i].sigma_rad = 0.0;
  }
  std::erase_if(only.points, [&](const SeenPoint& point) { return !places[point.sheet]; });
  thin(only.points);
  FloorFitOptions options{
      .used = {std::vector<bool>(only.points.size(), true)}, .robust = 5.0, .most_steps = kStartSteps};
  std::optional<FloorState> best;
  double least = 0.0;
  bool below = false;
  for (const double start : kStarts) {
    Intrinsics& in = only.intrinsics;
    in.fx_px = in.fy_px = start * in.width_px;
    in.cx_px = (in.width_px - 1) / 2.0;
    in.cy_px = (in.height_px - 1) / 2.0;
    in.distortion.fill(0.0);
    const CameraModel ideal(in, Eigen::Isometry3d::Identity());
    const std::vector<Known> points = known_points(only, ideal, places);
    if (points.size() < only.points.size()) continue;
    refuse_line(only.name, points);
    const auto pose = pose_of(points, flat(points));
    if (!pose) continue;
    FloorState state{.cameras = {CameraModel(in, *pose)}, .sheets = all_places};
    if (!improve(alone, options, state)) continue;
    const double cost = surplus(alone, options, state).chi_square;
    if (best && cost >= least) continue;
    best = state;
    least = cost;
    below = state.cameras.front().map_from_camera().translation().z() < points.front().at.z();
  }
  if (!best) throw std::invalid_argument(only.name + ": its points fit no lens and pose");
  if (below) refuse_mirrored(only.name);
  return best->cameras.front();
}

/// Where a camera whose pose is known sees a sheet: the rigid motion in the plane that fits its points best.
std::optional<FloorPlace> seen_place(const CameraModel& camera, const std::vector<const SeenPoint*>& points) {
  std::vector<Eigen::Vector2d> own;
  std::vector<Eigen::Vector2d> floor;
  for (const SeenPoint* point : points) {
    const auto at = camera.plane_from_pixel(point->pixel, point->at.z());
    if (!at) continue;
    own.emplace_back(point->at.head<2>());
    floor.push_back(*at);
  }
  if (own.size() < 2) return std::nullopt;
  const auto count = static_cast<double>(own.size());
  Eigen::Vector2d own_middle = Eigen::Vector2d::Zero();
  Eigen::Vector2d floor_middle = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < own.size(); ++i) {
    own_middle += own[i] / count;
    floor_middle += floor[i] / count;
  }
  double along = 0.0;
  double across = 0.0;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Eigen::Vector2d a = own[i] - own_middle;
    const Eigen::Vector2d b = floor[i] - floor_middle;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  FloorPlace out{.yaw_rad = std::atan2(across, along)};
  const Eigen::Vector2d origin = floor_middle - Eigen::Rotation2Dd(out.yaw_rad) * own_middle;
  out.x_m = origin.x();
  out.y_m = origin.y();
  return out;
}

std::vector<const SeenPoint*> points_on(const SeeingCamera& camera, std::size_t sheet) {
  std::vector<const SeenPoint*> out;
  for (const SeenPoint& point : camera.points) {
    if (point.sheet == sheet) out.push_back(&point);
  }
  return out;
}

/// Places the sheets that this camera sees and nobody knew. True where there was one.
bool place_sheets(const SeeingCamera& camera, const CameraModel& model,
                  std::vector<std::optional<FloorPlace>>& places) {
  bool placed = false;
  for (std::size_t sheet = 0; sheet < places.size(); ++sheet) {
    if (places[sheet]) continue;
    places[sheet] = seen_place(model, points_on(camera, sheet));
    placed = placed || places[sheet];
  }
  return placed;
}

}  // namespace

FloorState floor_start(const ExtrinsicsInput& input) {
  std::vector<std::optional<FloorPlace>> places;
  for (const Sheet& sheet : input.sheets) places.push_back(sheet.place);
  std::vector<std::optional<CameraModel>> cameras(input.cameras.size());
  for (bool progress = true; progress;) {
    progress = false;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      if (cameras[i]) continue;
      const SeeingCamera& camera = input.cameras[i];
      const auto known =
          std::count_if(camera.points.begin(), camera.points.end(),
                        [&](const SeenPoint& point) { return places[point.sheet].has_value(); });
      if (static_cast<std::size_t>(known) < kFewest) continue;
      if (camera.unknown_intrinsics) {
        cameras[i] = posed_anyhow(input, i, places);
      } else {
        const CameraModel model(camera.intrinsics, Eigen::Isometry3d::Identity());
        cameras[i] = posed(camera, known_points(camera, model, places));
      }
      place_sheets(camera, *cameras[i], places);
      progress = true;
    }
  }
  FloorState state;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!cameras[i])
      throw std::invalid_argument(
          input.cameras[i].name +
          ": it sees fewer than 4 points whose place is known, and shares no sheet with a "
          "camera that does");
    state.cameras.push_back(*cameras[i]);
  }
  for (const auto& place : places) state.sheets.push_back(place.value_or(FloorPlace{}));
  return state;
}

}  // namespace skylight::calibration
