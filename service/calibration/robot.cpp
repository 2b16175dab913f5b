#include "service/calibration/robot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <Eigen/Geometry>

#include "service/calibration/robot_fit.hpp"

namespace skylight::calibration {
namespace {

// A figure that is known worse than this is of no use: it would be told for something that was not measured.
constexpr double kUsefulHeight_m = 0.003;
constexpr double kUsefulMounting_m = 0.002;
constexpr double kUsefulHeading_rad = 0.01;
constexpr double kUsefulScale = 0.001;
// A robot whose place wanders by more while it turns does not turn on the spot.
constexpr double kWandering_m = 0.003;
constexpr double kOften = 0.1;

std::string text(const char* format, auto... values) {
  char out[400];
  std::snprintf(out, sizeof out, format, values...);
  return out;
}

constexpr double kDegrees = 180.0 / std::numbers::pi;

GeometryFigure figure(double assumed, double value, double variance, double useful) {
  GeometryFigure out{.assumed = assumed, .sigma = std::sqrt(variance < 0.0 ? 0.0 : variance)};
  if (out.sigma <= useful && std::isfinite(value)) out.value = value;  // not where sigma is no number
  return out;
}

void cover(const RobotRun& run, const FittedRobot& fit, RobotFit& out) {
  for (std::size_t i = 0; i < out.stretches.size(); ++i) {
    Stretch& stretch = out.stretches[i];
    double squares = 0.0;
    for (const Equation& e : fit.equations) {
      const bool own = stretch.kind == StretchKind::drive
                           ? e.kind == EquationKind::sideways
                           : e.kind == EquationKind::spot_x || e.kind == EquationKind::spot_y;
      if (!own || e.stretch != i) continue;
      ++(e.used ? stretch.used : stretch.dropped);
      if (e.used) squares += std::pow(residual(e, fit, run), 2);
    }
    const double axes = stretch.kind == StretchKind::drive ? 1.0 : 2.0;
    if (stretch.used > 0) stretch.rms_m = std::sqrt(axes * squares / static_cast<double>(stretch.used));
    if (stretch.kind == StretchKind::drive) {
      out.driven_m += stretch.driven_m;
      continue;
    }
    ++out.places;
    if (stretch.kind == StretchKind::spin) out.spun_rad += std::abs(stretch.turned_rad);
  }
  if (const auto circle = circle_of(out.stretches)) {
    const Stretch& stretch = out.stretches[*circle];
    out.circled_rad = std::abs(stretch.turned_rad);
    out.circle_radius_m = stretch.driven_m / out.circled_rad;
  }
  if (const auto ends = ends_of(run, out.stretches))
    out.span_m = (fit.place(place_of((*ends)[0])) - fit.place(place_of((*ends)[1]))).norm();
}

void find_mounting(const RobotRun& run, const FittedRobot& fit, RobotFit& out) {
  const Pose2& assumed = run.assumed.mounting;
  out.mounting_yaw = figure(assumed.yaw, wrap_angle(fit.x[kHeading]), fit.covariance(kHeading, kHeading),
                            kUsefulHeading_rad);
  // Where it is not known which way the robot faces, its axes are those that were assumed.
  const bool faces = out.mounting_yaw.value.has_value();
  const double heading = faces ? fit.x[kHeading] : assumed.yaw;
  const Eigen::Vector2d in_picture = fit.x.segment<2>(kAlong);
  const Eigen::Vector2d middle = Eigen::Rotation2Dd(heading) * in_picture;
  Eigen::Matrix<double, 2, 3> by = Eigen::Matrix<double, 2, 3>::Zero();
  by.leftCols<2>() = Eigen::Rotation2Dd(heading).toRotationMatrix();
  by.col(2) = Eigen::Vector2d(-middle.y(), middle.x());
  Eigen::Matrix3d covariance = fit.covariance.block<3, 3>(kAlong, kAlong);
  if (!faces) covariance.row(2) = covariance.col(2).transpose() = Eigen::Vector3d::Zero();
  const Eigen::Matrix2d spread = by * covariance * by.transpose();
  out.mounting_x_m = figure(assumed.x, middle.x(), spread(0, 0), kUsefulMounting_m);
  out.mounting_y_m = figure(assumed.y, middle.y(), spread(1, 1), kUsefulMounting_m);
}

// Which manoeuvre or measure is missing.
std::string missing_height(const RobotRun& run, const RobotFit& fit) {
  const double sigma_mm = 1e3 * fit.surface_height_m.sigma;
  if (run.known.distance && fit.places < 2) {
    return text(
        "the distance is between the first and the last place of standing or turning, and the run has %zu",
        fit.places);
  }
  if (run.known.radius && fit.circled_rad < std::numbers::pi)
    return text(
        "the circle's radius is known, but of a circle only %.0f degrees were driven, 180 or more are needed",
        kDegrees * fit.circled_rad);
  if (run.known.distance || run.known.radius)
    return text("what was measured leaves it open by %.1f mm: measure a longer way, or more exactly",
                sigma_mm);
  const std::string way =
      "stand or turn at two places and measure between them with a tape (4 m to 1 mm tell it to 1 mm)";
  if (!run.odometry.empty() && fit.driven_m > 0.0)
    return text("odometry known to %g %% leaves it open by %.0f mm: ", 100.0 * run.known.odometry_scale_sigma,
                sigma_mm) +
           way;
  return "nothing tells how long a metre is at that height: " + way;
}

std::string missing_mounting(const RobotFit& fit) {
  if (fit.spun_rad == 0.0) return "turn on the spot, at least once round";
  return text("turn on the spot further: %.0f degrees so far leave it open by %.1f mm",
              kDegrees * fit.spun_rad, 1e3 * std::max(fit.mounting_x_m.sigma, fit.mounting_y_m.sigma));
}

std::string missing_heading(const RobotRun& run, const RobotFit& fit) {
  if (run.known.holonomic && run.odometry.empty())
    return "a robot that can move sideways has to say by its odometry which way it goes";
  return text("drive straight on, a metre or more: %.1f m so far", fit.driven_m);
}

void say_what_is_missing(const RobotRun& run, RobotFit& fit) {
  if (!fit.surface_height_m.value) fit.surface_height_m.missing = missing_height(run, fit);
  for (GeometryFigure* figure : {&fit.mounting_x_m, &fit.mounting_y_m}) {
    if (!figure->value) figure->missing = missing_mounting(fit);
  }
  if (!fit.mounting_yaw.value) fit.mounting_yaw.missing = missing_heading(run, fit);
  if (!fit.odometry_scale.value)
    fit.odometry_scale.missing = run.odometry.empty() ? "odometry of this robot" : "a height that is known";
}

void remark(const RobotRun& run, const OdometryPath& odometry, RobotFit& fit) {
  if (!odometry.problem().empty()) fit.remarks.push_back(odometry.problem());
  for (const Stretch& stretch : fit.stretches) {
    const double time = to_seconds(run.seen[stretch.first].captured - run.seen.front().captured);
    if (stretch.kind == StretchKind::spin && stretch.rms_m > kWandering_m)
      fit.remarks.push_back(
          text("the robot does not turn on the spot: its place wandered by %.1f mm RMS in the turn at %.1f s",
               1e3 * stretch.rms_m, time));
    const auto all = static_cast<double>(stretch.used + stretch.dropped);
    if (static_cast<double>(stretch.dropped) > kOften * all)
      fit.remarks.push_back(text("%zu of %.0f looks of the %s at %.1f s contradict the others",
                                 stretch.dropped, all, std::string(to_string(stretch.kind)).c_str(), time));
  }
  if (run.uncertainty.empty())
    fit.remarks.emplace_back(
        "how well the cameras are known is not configured: their error is not in the standard deviations");
}

void check_run(const RobotRun& run) {
  if (const std::string wrong = check(run.known); !wrong.empty()) throw std::invalid_argument(wrong);
  if (!run.uncertainty.empty() && run.uncertainty.size() != run.cameras.size())
    throw std::invalid_argument("there must be one uncertainty for each camera, or none");
  for (const SeenRobot& seen : run.seen) {
    if (seen.camera >= run.cameras.size())
      throw std::invalid_argument("a look is of camera " + std::to_string(seen.camera) + ", there are " +
                                  std::to_string(run.cameras.size()));
  }
}

std::string check(const char* name, const std::optional<KnownLength>& known) {
  if (!known) return {};
  if (!(known->length_m >= 0.1 && known->length_m <= 1000.0))
    return text("%s is %g m, allowed 0.1 to 1000", name, known->length_m);
  if (!(known->sigma_m >= 1e-5 && known->sigma_m <= 1.0))
    return text("%s is known to %g m, allowed 0.00001 to 1", name, known->sigma_m);
  return {};
}

}  // namespace

SeenRobot seen_robot(const Observation& observation, const RobotGeometry& assumed) {
  const Pose2& base = observation.pose;
  const Eigen::Vector2d middle = base.position() + Eigen::Rotation2Dd(base.yaw) * assumed.mounting.position();
  return {.captured = observation.captured,
          .camera = observation.camera,
          .pose = {middle.x(), middle.y(), wrap_angle(base.yaw + assumed.mounting.yaw)}};
}

std::optional<double> GeometryFigure::sigmas_off() const {
  if (!value) return std::nullopt;
  return std::abs(*value - assumed) / std::max(sigma, 1e-12);
}

std::string_view to_string(StretchKind kind) {
  switch (kind) {
    case StretchKind::stand:
      return "stand";
    case StretchKind::spin:
      return "spin";
    case StretchKind::drive:
      return "drive";
  }
  return "unknown";
}

RobotGeometry RobotFit::geometry() const {
  const auto of = [](const GeometryFigure& figure) { return figure.value.value_or(figure.assumed); };
  return {of(surface_height_m), {of(mounting_x_m), of(mounting_y_m), of(mounting_yaw)}};
}

std::string check(const RobotKnowledge& known) {
  for (const std::string& wrong : {check("distance", known.distance), check("radius", known.radius)}) {
    if (!wrong.empty()) return wrong;
  }
  if (known.odometry_scale_sigma >= 1e-5 && known.odometry_scale_sigma <= 0.5) return {};
  return text("odometry_scale_sigma is %g, allowed 0.00001 to 0.5", known.odometry_scale_sigma);
}

RobotFit fit_robot(const RobotRun& run) {
  check_run(run);
  RobotFit out;
  out.stretches = stretches_of(run, out.left_out);
  const OdometryPath odometry(run);
  const FittedRobot fit = fit_equations(run, out.stretches, odometry);
  out.surface_height_m =
      figure(run.assumed.surface_height_m, fit.x[kHeight], fit.covariance(kHeight, kHeight), kUsefulHeight_m);
  find_mounting(run, fit, out);
  out.odometry_scale = figure(1.0, fit.x[kScale], fit.covariance(kScale, kScale), kUsefulScale);
  cover(run, fit, out);
  say_what_is_missing(run, out);
  remark(run, odometry, out);
  return out;
}

double shift_by_height(double error_m, double from_nadir_m, double camera_height_m, double surface_height_m) {
  return error_m * from_nadir_m / (camera_height_m - surface_height_m);
}

}  // namespace skylight::calibration
