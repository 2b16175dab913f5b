#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "service/calibration/robot_fit.hpp"

namespace skylight::calibration {
namespace {

// Looks nearer to each other share their errors and tell little new.
constexpr double kSpinStep_rad = 0.05;
constexpr double kDriveStep_m = 0.15;
constexpr double kDriveStep_rad = 0.35;
constexpr double kStandStep_s = 0.1;
constexpr double kMostLooks = 500.0;  // at a place
// What is known without having looked: a height measured with a ruler is not off by more; of the rest nothing
// to speak of. It keeps the equations solvable where a run says nothing, and what comes out as uncertain as
// this is no result.
constexpr double kRuler_m = 0.05;
constexpr double kVague_m = 1.0;
constexpr double kVague_rad = 1.0;
constexpr double kFarAway_m = 100.0;
// Before the residuals tell.
constexpr double kFirstSigma_m = 1e-3;

std::vector<std::size_t> looks_of(const RobotRun& run, const Stretch& stretch) {
  std::vector<std::size_t> out;
  for (std::size_t i = stretch.first; i <= stretch.last; ++i) {
    if (run.seen[i].camera == stretch.camera) out.push_back(i);
  }
  return out;
}

// How much rarer than usual looks are taken of a stretch that goes on and on.
double thinned(const RobotRun& run, const Stretch& stretch) {
  const double time = to_seconds(run.seen[stretch.last].captured - run.seen[stretch.first].captured);
  const double looks = stretch.kind == StretchKind::stand  ? time / kStandStep_s
                       : stretch.kind == StretchKind::spin ? std::abs(stretch.turned_rad) / kSpinStep_rad
                                                           : 0.0;
  return std::max(1.0, looks / kMostLooks);
}

// Far enough from the look before to tell something new.
bool is_new(const RobotRun& run, StretchKind kind, double rarer, std::size_t before, std::size_t now) {
  const SeenRobot& a = run.seen[before];
  const SeenRobot& b = run.seen[now];
  const double turn = std::abs(wrap_angle(b.pose.yaw - a.pose.yaw));
  switch (kind) {
    case StretchKind::stand:
      return to_seconds(b.captured - a.captured) >= rarer * kStandStep_s;
    case StretchKind::spin:
      return turn >= std::min(rarer * kSpinStep_rad, 1.0);
    case StretchKind::drive:
      return turn >= kDriveStep_rad || (b.pose.position() - a.pose.position()).norm() >= kDriveStep_m;
  }
  return true;
}

void add_stretch(const RobotRun& run, const OdometryPath& odometry, const Stretch& stretch, std::size_t index,
                 std::vector<Equation>& out) {
  const double rarer = thinned(run, stretch);
  std::optional<std::size_t> before;
  for (const std::size_t now : looks_of(run, stretch)) {
    if (before && !is_new(run, stretch.kind, rarer, *before, now)) continue;
    Equation e{.stretch = index, .a = now, .b = now, .p = place_of(index), .sigma = kFirstSigma_m};
    if (stretch.kind != StretchKind::drive) {
      e.kind = EquationKind::spot_x;
      out.push_back(e);
      e.kind = EquationKind::spot_y;
      out.push_back(e);
    } else if (before) {
      e.a = *before;
      const auto way = odometry.between(run.seen[*before].captured, run.seen[now].captured);
      e.kind = EquationKind::sideways;
      if (run.known.holonomic && way) e.said = way->y();
      if (!run.known.holonomic || way) out.push_back(e);
      e.kind = EquationKind::forward;
      if (way) e.said = way->x();
      if (way) out.push_back(e);
    }
    before = now;
  }
}

void add_circle(const RobotRun& run, const std::vector<Stretch>& stretches, std::vector<Equation>& out) {
  const auto circle = circle_of(stretches);
  if (!run.known.radius || !circle) return;
  std::optional<std::size_t> before;
  for (const std::size_t now : looks_of(run, stretches[*circle])) {
    if (before && !is_new(run, StretchKind::drive, 1.0, *before, now)) continue;
    out.push_back({.kind = EquationKind::circle,
                   .stretch = *circle,
                   .a = now,
                   .b = now,
                   .p = place_of(*circle),
                   .sigma = kFirstSigma_m});
    before = now;
  }
}

double variance_by_camera(const RobotRun& run, std::size_t look, int axis) {
  const std::size_t camera = run.seen[look].camera;
  if (camera >= run.uncertainty.size()) return 0.0;
  const auto floor = floor_covariance(run.cameras[camera], run.uncertainty[camera],
                                      run.seen[look].pose.position(), run.assumed.surface_height_m);
  return floor ? (*floor)(axis, axis) : 0.0;
}

// One place, seen by two cameras at once.
void add_shared_places(const RobotRun& run, const std::vector<Stretch>& stretches,
                       std::vector<Equation>& out) {
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    for (std::size_t k = i + 1; k < stretches.size(); ++k) {
      const Stretch& a = stretches[i];
      const Stretch& b = stretches[k];
      if (a.camera == b.camera || a.kind != b.kind || a.kind == StretchKind::drive) continue;
      if (run.seen[a.last].captured < run.seen[b.first].captured ||
          run.seen[b.last].captured < run.seen[a.first].captured)
        continue;
      for (const int axis : {0, 1}) {
        const double noise = 2.0 * kPlaceError_m * kPlaceError_m;
        const double cameras =
            variance_by_camera(run, a.first, axis) + variance_by_camera(run, b.first, axis);
        out.push_back({.kind = axis == 0 ? EquationKind::same_x : EquationKind::same_y,
                       .stretch = i,
                       .p = place_of(i),
                       .q = place_of(k),
                       .sigma = std::sqrt(noise + cameras),
                       .noise = std::sqrt(noise)});
      }
    }
  }
}

void add_known(const RobotRun& run, const std::vector<Stretch>& stretches, std::vector<Equation>& out) {
  const auto prior = [&](Eigen::Index parameter, double value, double sigma) {
    out.push_back({.p = parameter, .said = value, .sigma = sigma, .noise = sigma});
  };
  const Pose2& mounting = run.assumed.mounting;
  const Eigen::Vector2d along = Eigen::Rotation2Dd(-mounting.yaw) * mounting.position();
  prior(kHeight, run.assumed.surface_height_m, kRuler_m);
  prior(kAlong, along.x(), kVague_m);
  prior(kAcross, along.y(), kVague_m);
  prior(kHeading, mounting.yaw, kVague_rad);
  prior(kScale, 1.0, run.known.odometry_scale_sigma);
  const KnownLength radius = run.known.radius.value_or(KnownLength{.length_m = 1.0, .sigma_m = kVague_m});
  prior(kRadius, radius.length_m, radius.sigma_m);
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const auto members = looks_of(run, stretches[i]);
    Eigen::Vector2d middle(0.0, 0.0);
    for (const std::size_t look : members)
      middle += run.seen[look].pose.position() / static_cast<double>(members.size());
    for (const int axis : {0, 1}) prior(place_of(i) + axis, middle[axis], kFarAway_m);
  }
  const auto ends = ends_of(run, stretches);
  if (!run.known.distance || !ends) return;
  const double sigma = std::hypot(run.known.distance->sigma_m, std::sqrt(2.0) * kPlaceError_m);
  out.push_back({.kind = EquationKind::distance,
                 .p = place_of((*ends)[0]),
                 .q = place_of((*ends)[1]),
                 .said = run.known.distance->length_m,
                 .sigma = sigma,
                 .noise = sigma});
}

}  // namespace

std::optional<std::size_t> circle_of(const std::vector<Stretch>& stretches) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (stretches[i].kind != StretchKind::drive || stretches[i].turned_rad == 0.0) continue;
    if (!best || std::abs(stretches[i].turned_rad) > std::abs(stretches[*best].turned_rad)) best = i;
  }
  return best;
}

std::optional<std::array<std::size_t, 2>> ends_of(const RobotRun& run,
                                                  const std::vector<Stretch>& stretches) {
  std::optional<std::size_t> first;
  std::optional<std::size_t> last;
  const auto from = [&](std::size_t i) { return run.seen[stretches[i].first].captured; };
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (stretches[i].kind == StretchKind::drive) continue;
    if (!first || from(i) < from(*first)) first = i;
    if (!last || from(i) > from(*last)) last = i;
  }
  if (!first || first == last) return std::nullopt;
  return std::array{*first, *last};
}

std::vector<Equation> equations_of(const RobotRun& run, const std::vector<Stretch>& stretches,
                                   const OdometryPath& odometry) {
  std::vector<Equation> out;
  for (std::size_t i = 0; i < stretches.size(); ++i) add_stretch(run, odometry, stretches[i], i, out);
  add_circle(run, stretches, out);
  add_shared_places(run, stretches, out);
  add_known(run, stretches, out);
  return out;
}

}  // namespace skylight::calibration
