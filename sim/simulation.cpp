#include "sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/camera/depth.hpp"
#include "sim/camera/noise.hpp"
#include "sim/render/artwork.hpp"
#include "sim/render/render.hpp"
#include "sim/world/program.hpp"
#include "sim/world/timeline.hpp"
#include "sim/world/world.hpp"

namespace skylight::sim {
namespace {

/// Programs steer this many steps apart (100 Hz); the motors see to the rest.
constexpr int kStepsPerCommand = 5;

std::vector<BodyState> states_of(const World& world) {
  std::vector<BodyState> states;
  for (std::size_t i = 0; i < world.robot_count(); ++i) states.push_back(world.state(i));
  return states;
}

/// Midpoint of a camera's frame, counted from the scenario's start.
Duration midpoint(const CameraSpec& camera, std::uint64_t sequence) {
  return from_seconds(camera.first_frame_s + 0.5 * camera.exposure_s) +
         from_seconds(static_cast<double>(sequence) / camera.frame_rate_hz);
}

/// From a frame's midpoint to the end of its last row's exposure.
Duration half_exposure(const CameraSpec& camera) {
  const double readout = camera.shutter == Shutter::rolling ? camera.readout_s : 0.0;
  return from_seconds(0.5 * (camera.exposure_s + readout));
}

}  // namespace

struct Simulation::Impl {
  explicit Impl(const Scenario& scenario_in);
  void run_until(Duration time);
  Shot shoot(std::size_t camera, Duration middle);

  Scenario scenario;
  World world;
  Timeline timeline;
  std::vector<Program> programs;
  std::vector<Command> commands;
  std::int64_t steps = 0;
  Duration longest_exposure{};
  std::vector<RobotPicture> pictures;
  std::vector<Renderer> renderers;
  std::vector<std::uint64_t> sequences;  ///< next frame of each camera
};

Simulation::Impl::Impl(const Scenario& scenario_in)
    : scenario((validate(scenario_in), scenario_in)),
      world(scenario.room, (scenario.robots = all_robots(scenario))),
      timeline(states_of(world)),
      commands(scenario.robots.size()),
      sequences(scenario.cameras.size(), 0) {
  std::vector<SceneActor> actors;
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    const RobotSpec& robot = scenario.robots[i];
    const RobotModel& model = robot_model(robot.model);
    programs.emplace_back(
        robot.program, DriveLimits{model.max_speed_mps, model.max_side_speed_mps, model.max_yaw_rate_radps});
    pictures.push_back(make_picture(scenario, i));
    actors.push_back({std::make_shared<const Look>(body_of(make_look(robot, pictures.back())))});
  }
  for (const CameraSpec& camera : scenario.cameras) {
    longest_exposure = std::max(longest_exposure, 2 * half_exposure(camera));
  }
  const FloorTexture floor = make_floor(scenario.room, scenario.seed, scenario.folder);
  for (const CameraSpec& camera : scenario.cameras) {
    renderers.emplace_back(scenario, camera, floor);
    renderers.back().set_actors(actors, [&](std::size_t robot, double) { return world.state(robot).pose; });
  }
}

void Simulation::Impl::run_until(Duration time) {
  while (timeline.end() < time) {
    if (steps % kStepsPerCommand == 0) {
      const double now = to_seconds(steps * World::kStep);
      for (std::size_t i = 0; i < programs.size(); ++i)
        commands[i] = programs[i].command({.time_s = now, .pose = world.state(i).pose});
    }
    world.step(commands);
    ++steps;
    timeline.append(states_of(world));
  }
}

Shot Simulation::Impl::shoot(std::size_t camera, Duration middle) {
  const CameraSpec& spec = scenario.cameras[camera];
  const Duration exposure = from_seconds(spec.exposure_s);
  run_until(middle + half_exposure(spec));
  timeline.forget_before(middle - longest_exposure);  // cameras that come later may have begun earlier
  Renderer& renderer = renderers[camera];
  renderer.draw([&](std::size_t robot, double since_midpoint) {
    return timeline.at(robot, middle + from_seconds(since_midpoint)).pose;
  });

  Shot shot;
  shot.frame.camera = camera;
  shot.frame.sequence = sequences[camera]++;
  shot.frame.captured = Time{from_seconds(scenario.start_unix_s)} + middle;
  shot.delivered = shot.frame.captured + exposure / 2;
  const NoiseStream stream{scenario.seed, camera, shot.frame.sequence, false};
  const RowLight level{.light = static_cast<float>(scenario.light.level)};
  const std::vector<RowLight> rows(static_cast<std::size_t>(spec.height_px), level);
  expose({renderer.mean(), rows}, spec.sensor, stream, shot.frame.image);
  if (spec.depth.enabled) {
    const NoiseStream depth_stream{scenario.seed, camera, shot.frame.sequence, true};
    measure_depth(renderer.metres(), spec, depth_stream, shot.frame.depth);
  }
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    const BodyState state = timeline.at(i, middle);
    const Eigen::Vector2d plate = -pictures[i].reference_point_m;
    const Eigen::Rotation2Dd turn(state.pose.yaw);
    const Eigen::Vector2d at = state.pose.position() + turn * plate;
    const auto pixel = renderer.camera().project_map({at.x(), at.y(), pictures[i].surface_height_m});
    shot.truth.push_back({.id = scenario.robots[i].id,
                          .at = shot.frame.captured,
                          .pose = state.pose,
                          .velocity = state.velocity,
                          .in_view = pixel && renderer.camera().contains(*pixel),
                          .visible = renderer.visible(i)});
  }
  return shot;
}

Simulation::Simulation(const Scenario& scenario) : impl_(std::make_unique<Impl>(scenario)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const Scenario& Simulation::scenario() const {
  return impl_->scenario;
}
const std::vector<RobotSpec>& Simulation::robots() const {
  return impl_->scenario.robots;
}
Time Simulation::now() const {
  return Time{from_seconds(impl_->scenario.start_unix_s)} + impl_->timeline.end();
}
void Simulation::act(const Action&) {
  throw std::invalid_argument("actions are not taken yet");
}
std::vector<OdometryReport> Simulation::take_odometry() {
  return {};
}
std::vector<Happening> Simulation::take_happenings() {
  return {};
}

RobotPicture Simulation::picture(std::size_t robot) const {
  RobotPicture picture = impl_->pictures.at(robot);
  picture.image = picture.image.clone();
  return picture;
}

std::optional<Shot> Simulation::next() {
  const auto& cameras = impl_->scenario.cameras;
  if (cameras.empty()) return std::nullopt;
  std::size_t first = 0;
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    if (midpoint(cameras[i], impl_->sequences[i]) < midpoint(cameras[first], impl_->sequences[first]))
      first = i;
  }
  const Duration middle = midpoint(cameras[first], impl_->sequences[first]);
  const double duration = impl_->scenario.duration_s;
  if (duration > 0.0 && to_seconds(middle) + 0.5 * cameras[first].exposure_s > duration) return std::nullopt;
  return impl_->shoot(first, middle);
}

}  // namespace skylight::sim
