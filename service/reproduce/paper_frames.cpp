#include "service/reproduce/paper_frames.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include <Eigen/Geometry>
#include <opencv2/core/version.hpp>

#include "service/reproduce/watch.hpp"
#include "settings/text.hpp"

namespace skylight::service::reproduce {
namespace {

/// Counts up whenever the pipeline below gives other observations for the same frames.
constexpr int kPipelineVersion = 2;
constexpr double kFloorWidth = 6.0;     // m
constexpr double kPlateLength = 0.266;  // m: sim/scenario/robot_model.cpp

/// What is changed in a route's scenario.
std::vector<std::string> changes_of(const PaperSetup& setup) {
  using settings::number_text;
  const std::string side = std::to_string(std::lround(kFloorWidth * setup.px_per_metre));
  const std::string focal = number_text(kCameraHeight * setup.px_per_metre);
  return {"cameras[0].position_m=[0, 0, " + number_text(kCameraHeight) + "]",
          "cameras[0].width_px=" + side,
          "cameras[0].height_px=" + side,
          "cameras[0].fx_px=" + focal,
          "cameras[0].fy_px=" + focal,
          "cameras[0].frame_rate_hz=" + number_text(setup.frame_rate_hz),
          "cameras[0].depth.enabled=true",
          "room.floor.material=" + setup.floor};
}

HomographyConfig detector_of(const PaperVariant& variant) {
  HomographyConfig config;
  config.drop = variant.drop;
  config.reference_m = {variant.reference_x_m, 0.0};
  return config;
}

std::string key_of(const ScenarioRun& run) {
  std::ostringstream key;
  key << "paper pipeline " << kPipelineVersion << ", OpenCV " << CV_VERSION << '\n';
  for (const PaperVariant& variant : paper_variants()) {
    const HomographyConfig c = detector_of(variant);
    key << variant.name << ' ' << static_cast<int>(c.drop) << ' ' << settings::number_text(c.reference_m.x())
        << ' ' << c.features << ' ' << settings::number_text(c.ratio) << ' '
        << settings::number_text(c.ransac_px) << ' ' << c.min_inliers << ' ' << c.picture_px << ' '
        << c.margin_px << ' ' << c.match_object_to_scene << ' '
        << settings::number_text(c.depth_noise_floor_m) << ' ' << settings::number_text(c.depth_noise_growth)
        << '\n';
  }
  key << run.text();
  return key.str();
}

/// The paper's detector, in all its variants.
class PaperEyes {
 public:
  explicit PaperEyes(const std::shared_ptr<const Appearance>& appearance)
      : height_(appearance->picture().surface_height_m) {
    for (const PaperVariant& variant : paper_variants())
      detectors_.emplace_back(appearance, detector_of(variant));
  }

  std::vector<std::optional<Observation>> look(const Frame& frame, const CameraModel& camera) const {
    std::vector<std::optional<Observation>> seen(detectors_.size());
    // What the variants differ in comes after the match.
    const HomographyDetector& first = detectors_.front();
    const auto match = first.match(extract_homography_features(frame.image, first.config().features));
    if (!match) return seen;
    for (std::size_t i = 0; i < seen.size(); ++i)
      seen[i] = detectors_[i].observe(*match, frame, camera, height_);
    return seen;
  }

 private:
  double height_;
  std::vector<HomographyDetector> detectors_;
};

}  // namespace

const std::vector<PaperVariant>& paper_variants() {
  static const std::vector<PaperVariant> variants{{"vertical", FloorDrop::vertical, 0.0},
                                                  {"ray", FloorDrop::ray, kBaseScanX},
                                                  {"vertical_scan", FloorDrop::vertical, kBaseScanX}};
  return variants;
}

double reference_of(std::string_view variant) {
  for (const PaperVariant& one : paper_variants())
    if (one.name == variant) return one.reference_x_m;
  return 0.0;
}

Eigen::Vector2d point_of(const Pose2& pose, double reference_x_m) {
  return pose.position() + Eigen::Rotation2Dd(pose.yaw) * Eigen::Vector2d(reference_x_m, 0.0);
}

const std::vector<std::string>& paper_routes() {
  static const std::vector<std::string> routes{"line-1",    "line-2",    "line-3",   "line-4",   "line-5",
                                               "line-6",    "line-7",    "line-8",   "circle-1", "circle-2",
                                               "chaotic-1", "chaotic-2", "chaotic-3"};
  return routes;
}

bool is_linear(const std::string& route) {
  return route.rfind("line-", 0) == 0;
}

double robot_length_px(double px_per_metre) {
  return kPlateLength * px_per_metre * kCameraHeight / kPictureDepth;
}

PaperPlan::PaperPlan() = default;

PaperPlan quick_paper_plan() {
  PaperPlan plan;
  plan.routes = {"line-2", "line-7", "circle-2", "chaotic-1", "chaotic-2"};
  plan.seeds = 1;
  plan.at_most_s = 15.0;
  return plan;
}

ResolutionPlan quick_resolution_plan() {
  ResolutionPlan plan;
  plan.px_per_metre = {150, 240, 280};
  plan.floors = {"plain"};
  plan.routes = {"line-1", "chaotic-1"};
  plan.at_most_s = 25.0;
  return plan;
}

ObservedRun paper_run(const ScenarioRun& scenario, const std::string& route) {
  SimulatorFrames simulator(scenario);
  const CameraModel& camera = simulator.cameras().at(0).model;
  const PaperEyes eyes(simulator.robots().at(0).appearance);
  std::vector<std::string> names;
  for (const PaperVariant& variant : paper_variants()) names.emplace_back(variant.name);
  return watch(simulator, route, std::move(names),
               [&](const Frame& frame) { return eyes.look(frame, camera); });
}

std::vector<Job> paper_jobs(const PaperPlan& plan) {
  const std::vector<std::string> changes = changes_of(plan.setup);
  std::vector<Job> jobs;
  for (int seed = 1; seed <= plan.seeds; ++seed) {
    for (const std::string& route : plan.routes) {
      ScenarioRun scenario = scenario_run("paper/" + route, static_cast<std::uint64_t>(seed), changes);
      if (plan.at_most_s > 0.0) scenario.cut(plan.at_most_s);
      const double pixels = plan.setup.px_per_metre * plan.setup.px_per_metre;
      jobs.push_back({.name = "paper " + route + " seed " + std::to_string(seed),
                      .key = key_of(scenario),
                      .run = [scenario, route] { return paper_run(scenario, route); },
                      .weight = scenario.duration_s() * plan.setup.frame_rate_hz * pixels});
    }
  }
  return jobs;
}

std::vector<ResolutionPoint> resolution_curve(const ResolutionPlan& plan, const JobOptions& options) {
  std::vector<ResolutionPoint> curve;
  std::vector<Job> jobs;
  for (const std::string& floor : plan.floors) {
    for (const double px_per_metre : plan.px_per_metre) {
      PaperPlan one;
      one.setup.px_per_metre = px_per_metre;
      one.setup.frame_rate_hz = 1.0;
      one.setup.floor = floor;
      one.routes = plan.routes;
      one.seeds = 1;
      one.at_most_s = plan.at_most_s;
      std::vector<Job> more = paper_jobs(one);
      std::move(more.begin(), more.end(), std::back_inserter(jobs));
      curve.push_back({px_per_metre, robot_length_px(px_per_metre), floor});
    }
  }
  const std::vector<ObservedRun> runs = run_jobs(jobs, options);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    ResolutionPoint& point = curve[i / plan.routes.size()];
    for (const ObservedFrame& frame : runs[i].frames) {
      ++point.frames;
      if (frame.seen.front()) ++point.found;
    }
  }
  return curve;
}

}  // namespace skylight::service::reproduce
