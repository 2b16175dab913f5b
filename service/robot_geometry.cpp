#include "service/robot_geometry.hpp"

#include <algorithm>
#include <cmath>

#include "service/pose_query.hpp"

namespace skylight::service {
namespace {

using calibration::GeometryFigure;
using calibration::RobotFit;
using calibration::RobotGeometry;
using calibration::RobotRun;
using calibration::Stretch;

constexpr double kClearlyOff = 3.0;  // standard deviations

Json figure_json(const NamedFigure& named) {
  const GeometryFigure& figure = *named.figure;
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); };
  return {{"configured", figure.assumed},
          {"measured", number(figure.value)},
          {"sigma", figure.sigma},
          {"sigmas_off", number(figure.sigmas_off())},
          {"verdict", verdict(figure)},
          {"missing", figure.missing.empty() ? Json(nullptr) : Json(figure.missing)}};
}

Json stretch_json(const Stretch& stretch, const RobotRun& run, const std::vector<std::string>& cameras) {
  return {{"kind", calibration::to_string(stretch.kind)},
          {"camera", cameras.at(stretch.camera)},
          {"from", unix_seconds(run.seen[stretch.first].captured)},
          {"to", unix_seconds(run.seen[stretch.last].captured)},
          {"turned_rad", stretch.turned_rad},
          {"driven_m", stretch.driven_m},
          {"used", stretch.used},
          {"dropped", stretch.dropped},
          {"rms_m", stretch.rms_m}};
}

void leave_out(RobotFit& fit, std::string_view reason, std::size_t looks) {
  if (looks == 0) return;
  calibration::LeftOut out;
  out.reason = reason;
  out.count = looks;
  fit.left_out.push_back(std::move(out));
}

}  // namespace

RobotGeometry configured_geometry(const RobotSpec& spec) {
  if (!spec.appearance) return {seen_height_m(spec), spec.tag ? spec.tag->mounting : Pose2{}};
  const Eigen::Vector2d centre = seen_centre_m(spec);
  return {seen_height_m(spec),
          {centre.x(), centre.y(), spec.picture_mounting ? spec.picture_mounting->yaw : 0.0}};
}

bool same_geometry(const RobotSpec& a, const RobotSpec& b) {
  const RobotGeometry one = configured_geometry(a);
  const RobotGeometry other = configured_geometry(b);
  return a.appearance == b.appearance && one.surface_height_m == other.surface_height_m &&
         one.mounting == other.mounting;
}

RobotSpec with_geometry(RobotSpec spec, const RobotFit& fit) {
  const RobotGeometry found = fit.geometry();
  const bool mounted = fit.mounting_x_m.value || fit.mounting_y_m.value || fit.mounting_yaw.value;
  if (spec.appearance) {
    if (fit.surface_height_m.value) spec.surface_height_m = found.surface_height_m;
    if (mounted) spec.picture_mounting = found.mounting;
  } else if (spec.tag) {
    spec.tag->height_m = found.surface_height_m;
    spec.tag->mounting = found.mounting;
  }
  return spec;
}

GeometryRun::GeometryRun(const RobotSpec& spec, std::vector<CameraModel> cameras,
                         std::vector<CameraUncertainty> uncertainty, const calibration::RobotKnowledge& known)
    : by_tag_(!spec.appearance),
      run_{.cameras = std::move(cameras),
           .uncertainty = std::move(uncertainty),
           .assumed = configured_geometry(spec),
           .known = known} {}

void GeometryRun::add(const Observation& observation) {
  if ((observation.source == PoseSource::apriltag) != by_tag_) {
    ++other_;
  } else if (observation.heading_turns != 1) {
    ++unturned_;
  } else {
    run_.seen.push_back(calibration::seen_robot(observation, run_.assumed));
  }
}

RobotFit GeometryRun::fit() const {
  RobotFit fit = calibration::fit_robot(run_);
  leave_out(fit, by_tag_ ? "not seen by its tag" : "seen by its tag, not its picture", other_);
  leave_out(fit, "its picture is symmetric and its heading was not known yet", unturned_);
  return fit;
}

std::string_view verdict(const GeometryFigure& figure) {
  if (!figure.value) return "open";
  return *figure.sigmas_off() > kClearlyOff ? "change" : "agrees";
}

std::vector<NamedFigure> figures_of(const RobotSpec& spec, const RobotFit& fit) {
  const bool tag = !spec.appearance;
  const std::string height = tag ? "robots[].tag.height_m" : "robots[].surface_height_m";
  const std::string place = tag ? "robots[].tag." : "robots[].picture_mounting.";
  return {{"surface_height_m", height, "m", &fit.surface_height_m},
          {"mounting_x_m", place + "position_m[0]", "m", &fit.mounting_x_m},
          {"mounting_y_m", place + "position_m[1]", "m", &fit.mounting_y_m},
          {"mounting_yaw_rad", place + "yaw_rad", "rad", &fit.mounting_yaw},
          {"odometry_scale", "", "", &fit.odometry_scale}};
}

HeightCost height_cost(const RobotFit& fit, const CameraModel& camera) {
  const GeometryFigure& height = fit.surface_height_m;
  const Eigen::Vector3d at = camera.map_from_camera().translation();
  HeightCost cost{.error_m = height.value.value_or(height.assumed) - height.assumed};
  cost.per_metre_m = calibration::shift_by_height(cost.error_m, 1.0, at.z(), height.assumed);
  const double right = camera.intrinsics().width_px - 1.0;
  const double bottom = camera.intrinsics().height_px - 1.0;
  for (const Pixel& side : {Pixel(0.0, 0.5 * bottom), Pixel(right, 0.5 * bottom), Pixel(0.5 * right, 0.0),
                            Pixel(0.5 * right, bottom)}) {
    const auto seen = camera.plane_from_pixel(side, height.assumed);
    if (seen) cost.edge_m = std::max(cost.edge_m, (*seen - at.head<2>()).norm());
  }
  cost.at_edge_m = cost.per_metre_m * cost.edge_m;
  return cost;
}

Json to_json(const RobotSpec& spec, const RobotFit& fit, const RobotRun& run,
             const std::vector<std::string>& cameras) {
  Json figures = Json::object();
  for (const NamedFigure& named : figures_of(spec, fit)) figures[named.name] = figure_json(named);
  Json stretches = Json::array();
  for (const Stretch& stretch : fit.stretches) stretches.push_back(stretch_json(stretch, run, cameras));
  Json left_out = Json::array();
  for (const auto& reason : fit.left_out)
    left_out.push_back({{"reason", reason.reason}, {"count", reason.count}});
  Json costs = Json::array();
  for (std::size_t i = 0; i < run.cameras.size(); ++i) {
    const HeightCost cost = height_cost(fit, run.cameras[i]);
    costs.push_back({{"camera", cameras.at(i)},
                     {"per_metre_m", cost.per_metre_m},
                     {"edge_m", cost.edge_m},
                     {"at_edge_m", cost.at_edge_m}});
  }
  return {{"robot", spec.id},
          {"of", spec.appearance ? "picture" : "tag"},
          {"figures", figures},
          {"covered",
           {{"looks", run.seen.size()},
            {"spun_rad", fit.spun_rad},
            {"driven_m", fit.driven_m},
            {"circled_rad", fit.circled_rad},
            {"circle_radius_m", fit.circle_radius_m},
            {"places", fit.places},
            {"span_m", fit.span_m}}},
          {"height_cost", costs},
          {"stretches", stretches},
          {"left_out", left_out},
          {"remarks", fit.remarks}};
}

}  // namespace skylight::service
