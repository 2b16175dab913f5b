#include "service/reproduce/skylight_frames.hpp"

#include "service/evaluation/camera_error.hpp"
#include "service/reproduce/watch.hpp"
#include "settings/text.hpp"
#include "tracker/tracker.hpp"

namespace skylight::service::reproduce {
namespace {

/// Counts up when the detector or what is done here changes what is seen.
constexpr int kDetectorVersion = 1;

/// A tracker for the first robot by the first camera, as it is or as a calibration gives it.
Tracker tracker_for(const SimulatorFrames& simulator, const CameraModel& camera,
                    const std::vector<CameraUncertainty>& told) {
  TrackerConfig config;
  config.calibration = told;
  Tracker tracker({camera}, config);
  const SimulatedRobot& robot = simulator.robots().at(0);
  tracker.add({.id = robot.id, .appearance = robot.appearance});
  return tracker;
}

}  // namespace

ObservedRun skylight_run(const ScenarioRun& scenario, const std::string& route) {
  SimulatorFrames simulator(scenario);
  const CameraModel& camera = simulator.cameras().at(0).model;
  const WrongCamera calibrated = wrong_camera(camera, {.rms_m = kCalibrationRms, .seed = simulator.seed()});
  Tracker with_truth = tracker_for(simulator, camera, {});
  Tracker with_calibration = tracker_for(simulator, calibrated.model, {calibrated.told});
  return watch(simulator, route, {"true", "calibrated"}, [&](const Frame& frame) {
    return std::vector{with_truth.process(frame).at(0).measured,
                       with_calibration.process(frame).at(0).measured};
  });
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

}  // namespace skylight::service::reproduce
