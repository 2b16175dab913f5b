#include "service/sources/simulator.hpp"

#include "service/resources.hpp"
#include "sim/camera/camera_model.hpp"
#include "sim/scenario/scenario_file.hpp"
#include "sim/simulation.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

Intrinsics intrinsics_of(const sim::CameraSpec& camera) {
  return {
      .width_px = camera.width_px,
      .height_px = camera.height_px,
      .fx_px = camera.fx_px,
      .fy_px = camera.fy_px,
      .cx_px = camera.cx_px.value_or((camera.width_px - 1) / 2.0),
      .cy_px = camera.cy_px.value_or((camera.height_px - 1) / 2.0),
      .lens = camera.lens == sim::Lens::kannala_brandt ? LensModel::kannala_brandt : LensModel::brown_conrady,
      .distortion = camera.distortion};
}

sim::Scenario load(const std::string& name_or_path, std::optional<std::uint64_t> seed) {
  sim::Scenario scenario = sim::load_scenario(find_scenario(name_or_path));
  if (seed) scenario.seed = *seed;
  return scenario;
}

}  // namespace

struct SimulatorFrames::Impl {
  explicit Impl(const sim::Scenario& scenario) : simulation(scenario) {}

  sim::Simulation simulation;
  std::vector<SimulatedCamera> cameras;
  std::vector<SimulatedRobot> robots;
  std::vector<Truth> truth;
};

fs::path find_scenario(const std::string& name_or_path) {
  const fs::path given(name_or_path);
  std::error_code error;
  if (given.extension() == ".json") {
    if (!fs::exists(given, error)) throw SourceError(name_or_path + ": no such scenario file");
    return given;
  }
  const fs::path found = find_resource(fs::path("sim/scenarios") / (name_or_path + ".json"));
  if (found.empty())
    throw SourceError("no scenario called '" + name_or_path +
                      "' comes with Skylight; a file's path must end in .json");
  return found;
}

SimulatorFrames::SimulatorFrames(const std::string& name_or_path, std::optional<std::uint64_t> seed)
    : impl_(std::make_unique<Impl>(load(name_or_path, seed))) {
  const sim::Scenario& scenario = impl_->simulation.scenario();
  for (const sim::CameraSpec& camera : scenario.cameras) {
    impl_->cameras.push_back({camera.id, CameraModel(intrinsics_of(camera), sim::map_from_camera(camera)),
                              camera.frame_rate_hz, camera.exposure_s});
  }
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    const sim::RobotPicture picture = impl_->simulation.picture(i);
    const std::string& id = scenario.robots[i].id;
    impl_->robots.push_back({id, std::make_shared<const Appearance>(
                                     id, Picture{.image = picture.image,
                                                 .metres_per_pixel = picture.metres_per_pixel,
                                                 .surface_height_m = picture.surface_height_m,
                                                 .reference_point_m = picture.reference_point_m})});
  }
}

SimulatorFrames::~SimulatorFrames() = default;

const std::string& SimulatorFrames::name() const {
  return impl_->simulation.scenario().name;
}
std::uint64_t SimulatorFrames::seed() const {
  return impl_->simulation.scenario().seed;
}
double SimulatorFrames::duration_s() const {
  return impl_->simulation.scenario().duration_s;
}
const std::vector<SimulatedCamera>& SimulatorFrames::cameras() const {
  return impl_->cameras;
}
const std::vector<SimulatedRobot>& SimulatorFrames::robots() const {
  return impl_->robots;
}
const std::vector<Truth>& SimulatorFrames::truth() const {
  return impl_->truth;
}

std::optional<Frame> SimulatorFrames::next() {
  auto shot = impl_->simulation.next();
  if (!shot) return std::nullopt;
  impl_->truth.clear();
  for (const sim::RobotTruth& robot : shot->truth)
    impl_->truth.push_back({robot.id, robot.pose, robot.velocity, robot.in_view});
  return std::move(shot->frame);
}

}  // namespace skylight::service
