#include "service/sources/simulator.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include "service/resources.hpp"
#include "settings/fields.hpp"
#include "settings/text.hpp"
#include "sim/camera/camera_model.hpp"
#include "sim/render/artwork.hpp"
#include "sim/scenario/fields.hpp"
#include "sim/scenario/robot_model.hpp"
#include "sim/scenario/scenario_file.hpp"
#include "sim/simulation.hpp"

namespace skylight::service {

struct ScenarioRun::Data {
  sim::Scenario scenario;
  std::vector<Expected> expected;
  double until_s = 0.0;  ///< where it is cut off; 0: it is not

  double duration_s() const { return until_s > 0.0 ? until_s : scenario.duration_s; }
};

namespace {

namespace fs = std::filesystem;

constexpr double kDegrees = 180.0 / std::numbers::pi;

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

// Scenarios' own words.
std::string_view word_of(sim::Figure figure) {
  using sim::Figure;
  switch (figure) {
    case Figure::mean_error_m:
      return "mean_error_m";
    case Figure::p95_error_m:
      return "p95_error_m";
    case Figure::p99_error_m:
      return "p99_error_m";
    case Figure::max_error_m:
      return "max_error_m";
    case Figure::mean_yaw_error_deg:
      return "mean_yaw_error_deg";
    case Figure::max_yaw_error_deg:
      return "max_yaw_error_deg";
    case Figure::availability:
      return "availability";
    case Figure::measured:
      return "measured";
    case Figure::usable:
      return "usable";
    case Figure::confident_wrong:
      return "confident_wrong";
    case Figure::nees_mean:
      return "nees_mean";
    case Figure::find_mean_s:
      return "find_mean_s";
    case Figure::find_worst_s:
      return "find_worst_s";
    case Figure::hidden_told:
      return "hidden_told";
    case Figure::id_switches:
      return "id_switches";
    case Figure::idf1:
      return "idf1";
    case Figure::mota:
      return "mota";
  }
  return "unknown";
}

std::vector<Expected> expected_of(const sim::Scenario& scenario) {
  std::vector<Expected> out;
  for (const sim::Expectation& line : scenario.expect) {
    out.push_back({.figure = std::string(word_of(line.figure)),
                   .robot = line.robot,
                   .kind = pose_kind_from_string(line.kind).value_or(PoseKind::filtered),
                   .at_most = line.at_most,
                   .at_least = line.at_least});
  }
  return out;
}

ScenarioRun run_of(sim::Scenario scenario) {
  auto expected = expected_of(scenario);
  return ScenarioRun({.scenario = std::move(scenario), .expected = std::move(expected)});
}

bool same_artwork(const Picture& a, const Picture& b) {
  return a.metres_per_pixel == b.metres_per_pixel && a.surface_height_m == b.surface_height_m &&
         a.reference_point_m == b.reference_point_m && a.image.size() == b.image.size() &&
         a.image.type() == b.image.type() && cv::norm(a.image, b.image, cv::NORM_INF) == 0.0;
}

// As its owner would measure it.
std::optional<TagSpec> tag_of(const sim::Simulation& simulation, std::size_t robot) {
  if (!simulation.robots()[robot].tag) return std::nullopt;
  sim::Scenario scenario = simulation.scenario();
  scenario.robots = simulation.robots();  // with the copies
  const auto place = sim::tag_place(scenario, robot);
  if (!place) return std::nullopt;
  const sim::RobotSpec& spec = scenario.robots[robot];
  const sim::RobotModel& model = sim::robot_model(spec.model);
  const Eigen::Vector2d plate = 0.5 * (model.plate.min + model.plate.max);
  return TagSpec{.family = spec.tag->family,
                 .id = spec.tag->id,
                 .size_m = spec.tag->size_m,
                 .height_m = model.plate_height_m,
                 .mounting = {plate.x() + place->x_m, plate.y() + place->y_m, wrap_angle(place->yaw)}};
}

// A tag that several robots carry tells nothing of who they are.
void drop_shared_tags(std::vector<SimulatedRobot>& robots) {
  const auto same = [](const TagSpec& a, const TagSpec& b) { return a.family == b.family && a.id == b.id; };
  std::vector<bool> shared(robots.size(), false);
  for (std::size_t i = 0; i < robots.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (!robots[i].tag || !robots[k].tag || !same(*robots[i].tag, *robots[k].tag)) continue;
      shared[i] = shared[k] = true;
    }
  }
  for (std::size_t i = 0; i < robots.size(); ++i) {
    if (shared[i]) robots[i].tag.reset();
  }
}

// Identical robots share one appearance: what tells the tracker that they are copies.
std::vector<SimulatedRobot> robots_of(const sim::Simulation& simulation) {
  std::vector<SimulatedRobot> robots;
  for (std::size_t i = 0; i < simulation.robots().size(); ++i) {
    const sim::RobotSpec& spec = simulation.robots()[i];
    const Pose2 start{spec.start.x_m, spec.start.y_m, wrap_angle(spec.start.yaw_deg / kDegrees)};
    robots.push_back({.id = spec.id, .appearance = nullptr, .start = start, .tag = tag_of(simulation, i)});
    if (!spec.picture.enabled && !spec.tag) continue;
    const sim::RobotPicture artwork = simulation.picture(i);
    const Picture picture{.image = artwork.image,
                          .metres_per_pixel = artwork.metres_per_pixel,
                          .surface_height_m = artwork.surface_height_m,
                          .reference_point_m = artwork.reference_point_m};
    const auto twin = std::find_if(robots.begin(), robots.end(), [&](const SimulatedRobot& robot) {
      return robot.appearance && same_artwork(robot.appearance->picture(), picture);
    });
    if (twin == robots.end()) {
      robots.back().appearance = std::make_shared<const Appearance>(spec.id, picture);
      continue;
    }
    twin->copy = robots.back().copy = true;
    robots.back().appearance = twin->appearance;
  }
  drop_shared_tags(robots);
  return robots;
}

// As the simulation counts it: from the scenario's start to the end of the last row's exposure.
double exposure_end_s(const sim::CameraSpec& camera, const Frame& frame) {
  const double readout = camera.shutter == sim::Shutter::rolling ? camera.readout_s : 0.0;
  return camera.first_frame_s + static_cast<double>(frame.sequence) / camera.frame_rate_hz +
         camera.exposure_s + readout;
}

// The camera as it hangs now.
sim::CameraModel lens_of(const sim::Simulation& simulation, std::size_t camera) {
  sim::CameraParameters parameters = sim::camera_model(simulation.scenario().cameras.at(camera)).parameters();
  parameters.map_from_camera = simulation.map_from_camera(camera);
  return sim::CameraModel(parameters);
}

// Box of everything that the robot's solids show, by the corners of their bounds.
std::optional<cv::Rect2d> box_of(const sim::RobotModel& model, const Pose2& pose,
                                 const sim::CameraModel& camera) {
  const Eigen::Rotation2Dd turn(pose.yaw);
  Eigen::AlignedBox2d box;
  for (const sim::Solid& solid : model.solids) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector2d flat((corner & 1) != 0 ? solid.max.x() : solid.min.x(),
                                 (corner & 2) != 0 ? solid.max.y() : solid.min.y());
      const Eigen::Vector2d on_floor = pose.position() + turn * flat;
      const double height = (corner & 4) != 0 ? solid.max.z() : solid.min.z();
      const auto pixel = camera.project_map({on_floor.x(), on_floor.y(), height});
      if (pixel) box.extend(*pixel);
    }
  }
  const sim::CameraParameters& parameters = camera.parameters();
  const Eigen::AlignedBox2d picture(Eigen::Vector2d(-0.5, -0.5),
                                    Eigen::Vector2d(parameters.width_px - 0.5, parameters.height_px - 0.5));
  const Eigen::AlignedBox2d seen = box.isEmpty() ? box : box.intersection(picture);
  if (seen.isEmpty() || seen.volume() <= 0.0) return std::nullopt;
  return cv::Rect2d(seen.min().x(), seen.min().y(), seen.sizes().x(), seen.sizes().y());
}

}  // namespace

ScenarioRun::ScenarioRun(Data data) : data_(std::make_shared<const Data>(std::move(data))) {}
const std::string& ScenarioRun::name() const {
  return data_->scenario.name;
}
std::uint64_t ScenarioRun::seed() const {
  return data_->scenario.seed;
}
double ScenarioRun::duration_s() const {
  return data_->duration_s();
}
const std::vector<Expected>& ScenarioRun::expected() const {
  return data_->expected;
}
std::string ScenarioRun::text() const {
  return sim::write_scenario(data_->scenario) + "\nends at " + settings::number_text(data_->duration_s()) +
         " s\n";
}
void ScenarioRun::cut(double duration_s) {
  if (data_->duration_s() > 0.0 && data_->duration_s() <= duration_s) return;
  Data shorter = *data_;
  shorter.until_s =
      duration_s;  // the scenario stays as it is: its later events would be none of a shorter one
  data_ = std::make_shared<const Data>(std::move(shorter));
}

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

ScenarioRun scenario_run(const std::string& name_or_path, std::optional<std::uint64_t> seed,
                         const std::vector<std::string>& changes) {
  sim::Scenario scenario = sim::load_scenario(find_scenario(name_or_path), changes);
  if (seed) scenario.seed = *seed;
  return run_of(std::move(scenario));
}

std::vector<std::vector<ScenarioRun>> scenario_runs(const std::string& name_or_path,
                                                    std::optional<std::uint64_t> seed,
                                                    std::optional<int> repeats) {
  const std::vector<sim::Scenario> all = sim::load_runs(find_scenario(name_or_path));
  std::vector<std::vector<ScenarioRun>> variants;
  for (std::size_t i = 0; i < all.size();) {
    // The file's own repeats of a variant follow each other under one name and differ in the seed alone.
    std::size_t next = i;
    while (next < all.size() && all[next].name == all[i].name) ++next;
    const auto count = repeats ? static_cast<std::size_t>(*repeats) : next - i;
    std::vector<ScenarioRun> runs;
    for (std::size_t k = 0; k < count; ++k) {
      sim::Scenario scenario = all[i];
      scenario.seed = seed.value_or(scenario.seed) + k;
      runs.push_back(run_of(std::move(scenario)));
    }
    variants.push_back(std::move(runs));
    i = next;
  }
  return variants;
}

std::vector<ScenarioSummary> shipped_scenarios() {
  std::vector<ScenarioSummary> out;
  const fs::path folder = find_resource("sim/scenarios");
  if (folder.empty()) return out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".json") continue;
    try {
      const sim::Scenario scenario = sim::load_scenario(entry.path());
      out.push_back({.name = fs::relative(entry.path(), folder).replace_extension().generic_string(),
                     .description = scenario.description,
                     .cameras = scenario.cameras.size(),
                     .robots = sim::all_robots(scenario).size(),
                     .duration_s = scenario.duration_s});
    } catch (const std::exception&) {  // not a scenario that could be run
    }
  }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return out;
}

std::string scenario_schema() {
  return sim::scenario_schema();
}

struct SimulatorFrames::Impl {
  explicit Impl(const ScenarioRun::Data& run) : simulation(run.scenario), duration_s(run.duration_s()) {}

  sim::Simulation simulation;
  double duration_s = 0.0;
  std::vector<SimulatedCamera> cameras;
  std::vector<SimulatedRobot> robots;
  std::vector<Truth> truth;
  Time delivered = Time::min();
};

SimulatorFrames::SimulatorFrames(const ScenarioRun& run) : impl_(std::make_unique<Impl>(run.data())) {
  for (const sim::CameraSpec& camera : impl_->simulation.scenario().cameras) {
    impl_->cameras.push_back({camera.id, CameraModel(intrinsics_of(camera), sim::map_from_camera(camera)),
                              camera.frame_rate_hz, camera.exposure_s});
  }
  impl_->robots = robots_of(impl_->simulation);
}

SimulatorFrames::~SimulatorFrames() = default;

const std::string& SimulatorFrames::name() const {
  return impl_->simulation.scenario().name;
}
std::uint64_t SimulatorFrames::seed() const {
  return impl_->simulation.scenario().seed;
}
double SimulatorFrames::duration_s() const {
  return impl_->duration_s;
}
Eigen::Vector2d SimulatorFrames::room_m() const {
  const auto& size = impl_->simulation.scenario().room.size_m;
  return {size[0], size[1]};
}
const std::vector<SimulatedCamera>& SimulatorFrames::cameras() const {
  return impl_->cameras;
}
const std::vector<SimulatedRobot>& SimulatorFrames::robots() const {
  return impl_->robots;
}
std::vector<FloorTag> SimulatorFrames::floor_tags() const {
  std::vector<FloorTag> out;
  for (const sim::FloorTagSpec& tag : impl_->simulation.scenario().room.floor.tags) {
    if (tag.family == "Standard41h12") continue;  // robots carry it; no camera is calibrated by it
    out.push_back({.family = tag.family,
                   .id = tag.id,
                   .size_m = tag.size_m,
                   .x_m = tag.x_m,
                   .y_m = tag.y_m,
                   .yaw_deg = tag.yaw_deg,
                   .place_sigma_m = 0.001});
  }
  return out;
}
const std::vector<Truth>& SimulatorFrames::truth() const {
  return impl_->truth;
}
Eigen::Isometry3d SimulatorFrames::map_from_camera(std::size_t camera) const {
  return impl_->simulation.map_from_camera(camera);
}
Time SimulatorFrames::delivered() const {
  return impl_->delivered;
}
Time SimulatorFrames::start() const {
  return Time{from_seconds(impl_->simulation.scenario().start_unix_s)};
}
Time SimulatorFrames::now() const {
  return impl_->simulation.now();
}

std::optional<Frame> SimulatorFrames::next() {
  auto shot = impl_->simulation.next();
  if (!shot) return std::nullopt;
  const double end_s = exposure_end_s(impl_->simulation.scenario().cameras[shot->frame.camera], shot->frame);
  if (impl_->duration_s > 0.0 && end_s > impl_->duration_s + 1e-9) return std::nullopt;
  impl_->truth.clear();
  const sim::CameraModel lens = lens_of(impl_->simulation, shot->frame.camera);
  for (std::size_t i = 0; i < shot->truth.size(); ++i) {
    sim::RobotTruth& robot = shot->truth[i];
    const sim::RobotModel& model = sim::robot_model(impl_->simulation.robots()[i].model);
    impl_->truth.push_back({.id = robot.id,
                            .at = robot.at,
                            .pose = robot.pose,
                            .velocity = robot.velocity,
                            .present = robot.present,
                            .in_view = robot.in_view,
                            .visible = robot.visible,
                            .touches = std::move(robot.touches),
                            .box_px = robot.present ? box_of(model, robot.pose, lens) : std::nullopt});
  }
  impl_->delivered = shot->delivered;
  return std::move(shot->frame);
}

void SimulatorFrames::act(std::string_view json, const std::string& name) {
  impl_->simulation.act(sim::parse_action(json, name));
}

void SimulatorFrames::drive(const DriveCommand& command) {
  impl_->simulation.act(sim::DriveAction{.robot = command.robot,
                                         .v_mps = command.v_mps,
                                         .side_mps = command.side_mps,
                                         .w_degps = command.w_radps * kDegrees,
                                         .for_s = command.for_s});
}

std::vector<Odometry> SimulatorFrames::take_odometry() {
  std::vector<Odometry> out;
  for (const sim::OdometryReport& report : impl_->simulation.take_odometry()) {
    out.push_back({.robot = impl_->simulation.robots().at(report.robot).id,
                   .at = report.at,
                   .pose = report.pose,
                   .v_mps = report.v_mps,
                   .side_mps = report.side_mps,
                   .w_radps = report.w_radps});
  }
  return out;
}

std::vector<Happening> SimulatorFrames::take_happenings() {
  std::vector<Happening> out;
  for (const sim::Happening& happening : impl_->simulation.take_happenings()) {
    const std::string action = settings::write(sim::ActionSpec{happening.action});
    out.push_back({happening.at, happening.name, action});
  }
  return out;
}

}  // namespace skylight::service
