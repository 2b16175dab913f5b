#include "service/reproduce/skylight_frames.hpp"

#include "service/evaluation/camera_error.hpp"
#include "settings/text.hpp"
#include "tracker/tracker.hpp"

namespace skylight::service::reproduce {
namespace {

/// Counts up when the detector or what is done here changes what is seen.
constexpr int kDetectorVersion = 1;

Tracker tracker_for(const SimulatorFrames& simulator, const CameraModel& camera) {
  Tracker tracker({camera});
  const SimulatedRobot& robot = simulator.robots().at(0);
  tracker.add({.id = robot.id, .appearance = robot.appearance});
  return tracker;
}

WrongCamera calibrated(const SimulatorFrames& simulator) {
  return wrong_camera(simulator.cameras().at(0).model, {.rms_m = kCalibrationRms, .seed = simulator.seed()});
}

std::optional<Observation> look(Tracker& tracker, const Frame& frame) {
  return tracker.process(frame).at(0).measured;
}

}  // namespace

ObservedRun skylight_run(const ScenarioRun& scenario, const std::string& route) {
  SimulatorFrames simulator(scenario);
  const SimulatedCamera& camera = simulator.cameras().at(0);
  ObservedRun run{.route = route,
                  .seed = scenario.seed(),
                  .frame_rate_hz = camera.frame_rate_hz,
                  .width_px = camera.model.intrinsics().width_px,
                  .height_px = camera.model.intrinsics().height_px,
                  .variants = {"true", "calibrated"}};
  Tracker with_truth = tracker_for(simulator, camera.model);
  Tracker with_calibration = tracker_for(simulator, calibrated(simulator).model);
  while (const auto frame = simulator.next()) {
    const Truth& truth = simulator.truth().at(0);
    run.frames.push_back({.captured = frame->captured,
                          .truth = truth.pose,
                          .in_view = truth.in_view,
                          .visible = truth.visible,
                          .seen = {look(with_truth, *frame), look(with_calibration, *frame)}});
    for (const Odometry& said : simulator.take_odometry()) {
      run.odometry.push_back(
          {.at = said.at, .forward = said.v_mps, .sideways = said.side_mps, .yaw_rate = said.w_radps});
    }
  }
  return run;
}

std::vector<Job> skylight_jobs(const SkylightPlan& plan) {
  std::vector<std::string> changes{"cameras[0].depth.enabled=false"};
  changes.insert(changes.end(), plan.changes.begin(), plan.changes.end());
  std::vector<Job> jobs;
  for (int seed = 1; seed <= plan.seeds; ++seed) {
    for (const std::string& route : plan.routes) {
      ScenarioRun scenario =
          scenario_run(plan.folder + "/" + route, static_cast<std::uint64_t>(seed), changes);
      if (plan.at_most_s > 0.0) scenario.cut(plan.at_most_s);
      std::string name = plan.folder;
      name.append(" by skylight ").append(route).append(" seed ").append(std::to_string(seed));
      std::string key = "skylight detector ";
      key.append(std::to_string(kDetectorVersion)).append(", calibration off by ");
      key.append(settings::number_text(kCalibrationRms)).append(" m\n").append(scenario.text());
      jobs.push_back({.name = std::move(name),
                      .key = std::move(key),
                      .run = [scenario, route] { return skylight_run(scenario, route); },
                      .weight = scenario.duration_s() * 30.0 * 1e5});
    }
  }
  return jobs;
}

CorrelatedError calibration_error(const ScenarioRun& scenario) {
  const SimulatorFrames simulator(scenario);
  const double height = simulator.robots().at(0).appearance->picture().surface_height_m;
  return [camera = calibrated(simulator), height](const Pose2& pose) {
    return floor_covariance(camera.model, camera.told, pose.position(), height).value_or(Covariance3::Zero());
  };
}

}  // namespace skylight::service::reproduce
