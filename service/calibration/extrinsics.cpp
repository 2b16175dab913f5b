#include "service/calibration/extrinsics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "service/calibration/floor_fit.hpp"
#include "service/calibration/floor_start.hpp"
#include "service/calibration/median.hpp"
#include "service/calibration/text.hpp"

namespace skylight::calibration {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kFewest = 4;
/// Standard deviations beyond which a point is taken less seriously, and is left out.
constexpr double kRobust = 3.0;
constexpr double kOutlier = 6.0;
/// Residuals below are never called wrong, px.
constexpr double kGoodEnough = 0.5;
/// Standard deviations of the points are believed to be wrong by no more than so many times.
constexpr double kLeastNoise = 0.1;
/// The stated standard deviation counts as so many residuals.
constexpr double kStatedCounts = 4.0;
constexpr int kMostRounds = 8;
/// A tag or board measures what is stated to so much; several agree on their size to so much.
constexpr double kSizeTolerance = 0.04;
constexpr double kSizeSpread = 0.03;
/// Floor further away than so many times the camera's height is not what the camera is for.
constexpr double kFarFloor = 4.0;
/// Residuals and floor that deserve a warning.
constexpr double kPoorRms = 2.0;
constexpr double kPoorFloor = 0.005;
constexpr double kPoorHeight = 0.03;

/// The fit as it goes on.
struct Work {
  const ExtrinsicsInput& input;
  FloorState state;
  FloorFitOptions options;
  std::vector<std::vector<std::string>> why_not;  ///< by camera and point; empty: used
};

void check_camera(const ExtrinsicsInput& input, const SeeingCamera& camera) {
  // What only the lens says is checked even where its numbers are still to be found.
  if (!camera.unknown_intrinsics) {
    if (const std::string wrong = check(camera.intrinsics); !wrong.empty())
      throw std::invalid_argument(camera.name + ": " + wrong);
  }
  const Intrinsics& in = camera.intrinsics;
  for (const SeenPoint& point : camera.points) {
    const auto refuse = [&](const std::string& why) {
      throw std::invalid_argument(camera.name + ": " + point.name + " " + why);
    };
    if (point.sheet >= input.sheets.size()) refuse("is on no sheet");
    if (!point.at.allFinite() || !point.pixel.allFinite()) refuse("is not finite");
    if (!(point.sigma_px > 0.0)) refuse("has a standard deviation that is not above 0");
    if (point.pixel.x() < -0.5 || point.pixel.y() < -0.5 || point.pixel.x() > in.width_px - 0.5 ||
        point.pixel.y() > in.height_px - 0.5)
      refuse("at (" + fixed(point.pixel.x(), 1) + ", " + fixed(point.pixel.y(), 1) +
             ") px lies outside the picture of " + std::to_string(in.width_px) + " x " +
             std::to_string(in.height_px) + " px");
  }
  if (camera.height_m && !(*camera.height_m > 0.0 && camera.height_sigma_m > 0.0))
    throw std::invalid_argument(camera.name +
                                ": its height and the standard deviation of it must be above 0");
  if (camera.points.size() < kFewest)
    throw std::invalid_argument(camera.name + ": at least 4 points at known places are needed, there are " +
                                std::to_string(camera.points.size()));
}

/// By camera and point: residual over its standard deviation (as the options have it), and its length in px.
struct Residual {
  Eigen::Vector2d error_px{kNan, kNan};
  double deviations = std::numeric_limits<double>::infinity();
};

Residual residual_of(const Work& work, std::size_t camera, const SeenPoint& point) {
  CameraModel::PixelByPoint by_map;
  const auto pixel =
      work.state.cameras[camera].pixel_from_map(in_map(work.state.sheets[point.sheet], point.at), &by_map);
  if (!pixel) return {};
  Residual out{.error_px = point.pixel - *pixel};
  const Eigen::Matrix2d covariance =
      point.sigma_px * point.sigma_px * Eigen::Matrix2d::Identity() +
      point.sigma_m * point.sigma_m * by_map.leftCols<2>() * by_map.leftCols<2>().transpose();
  out.deviations =
      std::sqrt(out.error_px.dot(covariance.inverse() * out.error_px)) / work.options.noise_scale;
  return out;
}

/// Where the camera sees the point less where it is stated to be; NaN where it sees no such place.
Eigen::Vector2d floor_residual(const Work& work, std::size_t camera, const SeenPoint& point) {
  const auto seen = work.state.cameras[camera].plane_from_pixel(point.pixel, point.at.z());
  if (!seen) return {kNan, kNan};
  return *seen - in_map(work.state.sheets[point.sheet], point.at).head<2>();
}

void leave_out(Work& work, std::size_t camera, std::size_t point, std::string why) {
  work.options.used[camera][point] = false;
  work.why_not[camera][point] = std::move(why);
}

void leave_out_unseen(Work& work) {
  for (std::size_t camera = 0; camera < work.input.cameras.size(); ++camera) {
    const auto& points = work.input.cameras[camera].points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!std::isfinite(residual_of(work, camera, points[i]).deviations))
        leave_out(work, camera, i,
                  "cannot be seen from where the camera hangs: it would lie behind the camera");
    }
  }
}

void fit(Work& work) {
  if (!improve(work.input, work.options, work.state))
    throw std::invalid_argument(
        "the points fit no cameras: one of them cannot be seen from where it should be");
}

/// The residuals' scale by their median: outliers do not move it.
void rescale(Work& work) {
  work.options.noise_scale = 1.0;
  std::vector<double> deviations;
  for (std::size_t camera = 0; camera < work.input.cameras.size(); ++camera) {
    const auto& points = work.input.cameras[camera].points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (work.options.used[camera][i]) deviations.push_back(residual_of(work, camera, points[i]).deviations);
    }
  }
  const Surplus extra = surplus(work.input, work.options, work.state);
  const double fitted = 2.0 * static_cast<double>(deviations.size()) / std::max(1, extra.freedom);
  work.options.noise_scale = std::max(kLeastNoise, median(deviations) / 1.1774 * std::sqrt(fitted));
}

/// How many times the stated size a group of points measures on the floor.
double size_ratio(const Work& work, std::size_t camera, const std::vector<std::size_t>& group) {
  const auto& points = work.input.cameras[camera].points;
  std::vector<Eigen::Vector2d> stated;
  std::vector<Eigen::Vector2d> seen;
  for (const std::size_t i : group) {
    const auto at = work.state.cameras[camera].plane_from_pixel(points[i].pixel, points[i].at.z());
    if (!at) return kNan;
    stated.emplace_back(in_map(work.state.sheets[points[i].sheet], points[i].at).head<2>());
    seen.push_back(*at);
  }
  // A similarity by least squares: its scale is the share of what is seen along what is stated.
  const auto count = static_cast<double>(group.size());
  Eigen::Vector2d a = Eigen::Vector2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < stated.size(); ++i) {
    a += stated[i] / count;
    b += seen[i] / count;
  }
  double along = 0.0;
  double across = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < stated.size(); ++i) {
    along += (stated[i] - a).dot(seen[i] - b);
    across += (stated[i] - a).x() * (seen[i] - b).y() - (stated[i] - a).y() * (seen[i] - b).x();
    size += (stated[i] - a).squaredNorm();
  }
  return std::hypot(along, across) / size;
}

using Groups = std::map<int, std::vector<std::size_t>>;

Groups groups_of(const SeeingCamera& camera) {
  Groups groups;
  for (std::size_t i = 0; i < camera.points.size(); ++i) {
    if (camera.points[i].group >= 0) groups[camera.points[i].group].push_back(i);
  }
  return groups;
}

/// The name of a tag is that of its corners up to the comma.
std::string group_name(const SeenPoint& point) {
  return point.name.substr(0, point.name.find(','));
}

/// Tags and boards of another size than stated: all of them is an error, single ones are left out.
void check_sizes(Work& work) {
  for (std::size_t camera = 0; camera < work.input.cameras.size(); ++camera) {
    const SeeingCamera& seeing = work.input.cameras[camera];
    const Groups groups = groups_of(seeing);
    if (groups.size() < 2) continue;  // one alone sets the scale
    std::map<int, double> ratios;
    std::vector<double> all;
    for (const auto& [number, group] : groups) {
      const double ratio = group.size() >= 3 ? size_ratio(work, camera, group) : kNan;
      if (!std::isfinite(ratio)) continue;
      ratios[number] = ratio;
      all.push_back(ratio);
    }
    const double middle = median(all);
    const auto agreeing = std::count_if(
        all.begin(), all.end(), [&](double ratio) { return std::abs(ratio / middle - 1.0) < kSizeSpread; });
    if (std::abs(middle - 1.0) > kSizeTolerance && 3 * agreeing > 2 * std::ssize(all))
      throw std::invalid_argument(seeing.name + ": its tags or boards measure " + fixed(100.0 * middle, 1) +
                                  " % of the stated size on the floor: the size is wrong");
    for (const auto& [number, ratio] : ratios) {
      if (std::abs(ratio - 1.0) <= kSizeTolerance) continue;
      for (const std::size_t i : groups.at(number))
        leave_out(
            work, camera, i,
            group_name(seeing.points[i]) + " measures " + fixed(100.0 * ratio, 1) + " % of its stated size");
    }
  }
}

std::string outlier_words(const Work& work, std::size_t camera, const SeenPoint& point) {
  const double off_m = floor_residual(work, camera, point).norm();
  const double off_px = residual_of(work, camera, point).error_px.norm();
  std::string words = "is seen " + fixed(off_px, 1) + " px";
  if (std::isfinite(off_m)) words += " (" + fixed(off_m, 3) + " m)";
  return words + " from where it should be: its place or its pixel is wrong";
}

/// True where something was left out.
bool leave_out_wrong(Work& work) {
  bool changed = false;
  for (std::size_t camera = 0; camera < work.input.cameras.size(); ++camera) {
    const SeeingCamera& seeing = work.input.cameras[camera];
    for (std::size_t i = 0; i < seeing.points.size(); ++i) {
      if (!work.options.used[camera][i]) continue;
      const Residual residual = residual_of(work, camera, seeing.points[i]);
      if (residual.deviations < kOutlier || residual.error_px.norm() < kGoodEnough) continue;
      leave_out(work, camera, i, outlier_words(work, camera, seeing.points[i]));
      changed = true;
    }
    for (const auto& [number, group] : groups_of(seeing)) {
      const auto& used = work.options.used[camera];
      const auto left = std::count_if(group.begin(), group.end(), [&](std::size_t i) { return used[i]; });
      if (left == 0 || 2 * left > std::ssize(group)) continue;
      for (const std::size_t i : group) {
        if (used[i])
          leave_out(work, camera, i, "belongs to " + group_name(seeing.points[i]) + ", which is misplaced");
      }
    }
  }
  return changed;
}

void check_left(const Work& work) {
  for (std::size_t camera = 0; camera < work.input.cameras.size(); ++camera) {
    const auto& used = work.options.used[camera];
    const auto count = static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
    if (count >= kFewest && 2 * count >= used.size()) continue;
    throw std::invalid_argument(
        work.input.cameras[camera].name + ": only " + std::to_string(count) + " of " +
        std::to_string(used.size()) + " points agree with each other; the first that does not, " +
        work.input.cameras[camera]
            .points[static_cast<std::size_t>(std::find(used.begin(), used.end(), false) - used.begin())]
            .name +
        ", is off: check places, pixels and intrinsics");
  }
}

void fit_all(Work& work) {
  work.options.robust = kRobust;
  fit(work);
  check_sizes(work);
  for (int round = 0; round < kMostRounds; ++round) {
    rescale(work);
    fit(work);
    if (!leave_out_wrong(work)) break;
    check_left(work);
  }
  check_left(work);
  work.options.robust = 0.0;
  // The stated standard deviations and the residuals together say what the points are worth.
  for (int round = 0; round < 2; ++round) {
    fit(work);
    work.options.noise_scale = 1.0;
    const Surplus extra = surplus(work.input, work.options, work.state);
    work.options.noise_scale = std::max(kLeastNoise, std::sqrt((extra.chi_square + kStatedCounts) /
                                                               (std::max(0, extra.freedom) + kStatedCounts)));
  }
  fit(work);
}

/// Standard deviation of places on the floor over the picture.
void judge_floor(CameraResult& result) {
  const CameraModel camera(result.intrinsics, result.map_from_camera);
  constexpr int kSteps = 8;
  result.best_floor_sigma_m = result.worst_floor_sigma_m = kNan;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Pixel pixel((result.intrinsics.width_px - 1.0) * i / kSteps,
                        (result.intrinsics.height_px - 1.0) * j / kSteps);
      const auto at = camera.plane_from_pixel(pixel, 0.0);
      const Eigen::Vector3d eye = result.map_from_camera.translation();
      if (!at || (*at - eye.head<2>()).norm() > kFarFloor * std::abs(eye.z())) continue;
      const auto covariance = floor_covariance(camera, result.uncertainty, *at, 0.0);
      if (!covariance) continue;
      const double sigma = std::sqrt(std::max(0.0, covariance->topLeftCorner<2, 2>().trace()));
      result.best_floor_sigma_m = std::fmin(result.best_floor_sigma_m, sigma);
      result.worst_floor_sigma_m = std::fmax(result.worst_floor_sigma_m, sigma);
    }
  }
}

CameraResult result_of(const Work& work, std::size_t camera, const CameraUncertainty& uncertainty) {
  const SeeingCamera& seeing = work.input.cameras[camera];
  CameraResult out{.name = seeing.name,
                   .intrinsics = work.state.cameras[camera].intrinsics(),
                   .map_from_camera = work.state.cameras[camera].map_from_camera(),
                   .uncertainty = uncertainty};
  double count = 0.0;
  for (std::size_t i = 0; i < seeing.points.size(); ++i) {
    const bool used = work.options.used[camera][i];
    const PointResult& point = out.points.emplace_back(
        PointResult{.name = seeing.points[i].name,
                    .used = used,
                    .why_not = work.why_not[camera][i],
                    .residual_px = residual_of(work, camera, seeing.points[i]).error_px,
                    .residual_m = floor_residual(work, camera, seeing.points[i])});
    if (!used) continue;
    out.rms_px += point.residual_px.squaredNorm();
    out.rms_m += point.residual_m.squaredNorm();
    count += 1.0;
  }
  out.rms_px = std::sqrt(out.rms_px / count);
  out.rms_m = std::sqrt(out.rms_m / count);
  judge_floor(out);
  return out;
}

void warn(const Work& work, ExtrinsicsResult& result) {
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    const CameraResult& camera = result.cameras[i];
    const SeeingCamera& seeing = work.input.cameras[i];
    if (!seeing.unknown_intrinsics && seeing.covariance.isZero(0.0))
      result.warnings.push_back(camera.name +
                                ": its intrinsics come without standard deviations and are taken for exact");
    const double height = std::abs(camera.map_from_camera.translation().z());
    const double height_sigma =
        std::sqrt(camera.uncertainty.covariance(kCameraPosition + 2, kCameraPosition + 2));
    if (height_sigma > kPoorHeight * height)
      result.warnings.push_back(
          camera.name + ": its height of " + fixed(height, 2) + " m is known to " + fixed(height_sigma, 2) +
          " m only, so that things above the floor are seen in the wrong place: measure it, or "
          "calibrate the intrinsics with a board");
    if (camera.rms_px > kPoorRms)
      result.warnings.push_back(camera.name + ": its points are " + fixed(camera.rms_px, 1) +
                                " px from where they should be: places measured roughly, or another lens");
    if (camera.worst_floor_sigma_m > kPoorFloor)
      result.warnings.push_back(camera.name + ": where it knows the floor least, it knows it to " +
                                fixed(1e3 * camera.worst_floor_sigma_m, 1) +
                                " mm: more points help, most of all near the picture's edge");
  }
  for (std::size_t sheet = 0; sheet < work.input.sheets.size(); ++sheet) {
    const bool seen =
        std::any_of(work.input.cameras.begin(), work.input.cameras.end(), [&](const auto& camera) {
          return std::any_of(camera.points.begin(), camera.points.end(),
                             [&](const SeenPoint& point) { return point.sheet == sheet; });
        });
    if (!seen) result.warnings.push_back(work.input.sheets[sheet].name + " is seen by no camera");
  }
}

}  // namespace

ExtrinsicsResult calibrate_extrinsics(const ExtrinsicsInput& input) {
  if (input.cameras.empty()) throw std::invalid_argument("there is no camera to calibrate");
  if (std::none_of(input.sheets.begin(), input.sheets.end(), [](const Sheet& sheet) { return sheet.place; }))
    throw std::invalid_argument("no place in map is known: at least one sheet needs one");
  Work work{.input = input};
  for (const SeeingCamera& camera : input.cameras) {
    check_camera(input, camera);
    work.options.used.emplace_back(camera.points.size(), true);
    work.why_not.emplace_back(camera.points.size());
  }
  work.state = floor_start(input);
  leave_out_unseen(work);
  check_left(work);
  fit_all(work);
  const auto uncertain = uncertainties(input, work.options, work.state);
  if (uncertain.empty())
    throw std::invalid_argument(
        "the points do not determine the cameras: more points are needed, spread over the picture, and for a "
        "lens "
        "from points alone at different heights or seen at a slant");
  ExtrinsicsResult result{.cameras = {}, .sheets = work.state.sheets};
  for (std::size_t camera = 0; camera < input.cameras.size(); ++camera)
    result.cameras.push_back(result_of(work, camera, uncertain[camera]));
  warn(work, result);
  return result;
}

}  // namespace skylight::calibration
