#include "sim/simulation.hpp"

#include <algorithm>
#include <deque>
#include <stdexcept>
#include <utility>

#include "sim/cast.hpp"
#include "sim/imager.hpp"
#include "sim/lighting.hpp"
#include "sim/render/textures.hpp"
#include "sim/scenario/scenario_checks.hpp"
#include "sim/world/stage.hpp"

namespace skylight::sim {

struct Simulation::Impl {
  explicit Impl(const Scenario& scenario_in);
  void run_until(Duration time);
  void apply_effects(Duration until);
  void apply(const Effect& effect);
  Imager& camera(const std::string& id);
  std::size_t robot(const std::string& id) const;
  bool over(const Imager& imager) const;

  Scenario scenario;
  Stage stage;
  Cast cast;
  Lighting lighting;
  std::vector<Imager> imagers;
  std::deque<Effect> effects;  ///< of the stage, not yet seen by any camera
  Duration longest_reach{};
};

Simulation::Impl::Impl(const Scenario& scenario_in)
    : scenario((validate(scenario_in), scenario_in)),
      stage(scenario),
      cast(scenario, stage.robots()),
      lighting(scenario.light, scenario.room) {
  const FloorTexture floor = make_floor(scenario.room, scenario.seed, scenario.folder);
  for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
    imagers.emplace_back(scenario, i, floor);
    longest_reach = std::max(longest_reach, imagers.back().reach());
  }
}

void Simulation::Impl::run_until(Duration time) {
  while (stage.time() < time) stage.advance();
  for (Effect& effect : stage.take_effects()) effects.push_back(std::move(effect));
}

/// What happened up to the middle of an exposure shows in it.
void Simulation::Impl::apply_effects(Duration until) {
  while (!effects.empty() && effects.front().at <= until) {
    apply(effects.front());
    effects.pop_front();
  }
}

void Simulation::Impl::apply(const Effect& effect) {
  if (const auto* light = std::get_if<LightAction>(&effect.action)) lighting.change(*light, effect.at);
  if (const auto* shadow = std::get_if<ShadowAction>(&effect.action)) lighting.pass(*shadow, effect.at);
  if (const auto* bump = std::get_if<BumpAction>(&effect.action)) camera(bump->camera).bump(*bump);
  if (const auto* freeze = std::get_if<FreezeAction>(&effect.action))
    camera(freeze->camera).freeze(*freeze, effect.at);
  if (const auto* black = std::get_if<BlackoutAction>(&effect.action))
    camera(black->camera).black_out(*black, effect.at);
  if (const auto* cover = std::get_if<CoverAction>(&effect.action))
    cast.cover(robot(cover->robot), *cover, effect.at);
}

Imager& Simulation::Impl::camera(const std::string& id) {
  const auto at = std::find_if(scenario.cameras.begin(), scenario.cameras.end(),
                               [&](const CameraSpec& camera) { return camera.id == id; });
  return imagers.at(static_cast<std::size_t>(at - scenario.cameras.begin()));
}

std::size_t Simulation::Impl::robot(const std::string& id) const {
  const auto at = std::find_if(stage.robots().begin(), stage.robots().end(),
                               [&](const RobotSpec& robot) { return robot.id == id; });
  return static_cast<std::size_t>(at - stage.robots().begin());
}

bool Simulation::Impl::over(const Imager& imager) const {
  return scenario.duration_s > 0.0 && to_seconds(imager.next_middle() + imager.reach()) > scenario.duration_s;
}

Simulation::Simulation(const Scenario& scenario) : impl_(std::make_unique<Impl>(scenario)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const Scenario& Simulation::scenario() const {
  return impl_->scenario;
}

const std::vector<RobotSpec>& Simulation::robots() const {
  return impl_->stage.robots();
}

RobotPicture Simulation::picture(std::size_t robot) const {
  RobotPicture picture = impl_->cast.picture(robot);
  picture.image = picture.image.clone();
  return picture;
}

std::optional<Shot> Simulation::next() {
  for (;;) {
    auto& imagers = impl_->imagers;
    const auto first = std::min_element(imagers.begin(), imagers.end(), [](const Imager& a, const Imager& b) {
      return a.next_middle() < b.next_middle();
    });
    if (first == imagers.end() || impl_->over(*first)) return std::nullopt;
    const Duration middle = first->next_middle();
    impl_->run_until(middle + first->reach());
    impl_->apply_effects(middle);
    impl_->stage.forget_before(middle - impl_->longest_reach);  // the next camera may have begun earlier
    if (auto shot = first->shoot(impl_->stage, impl_->lighting, impl_->cast)) return shot;
  }
}

Time Simulation::now() const {
  return Time{from_seconds(impl_->scenario.start_unix_s)} + impl_->stage.time();
}

Eigen::Isometry3d Simulation::map_from_camera(std::size_t camera) const {
  return impl_->imagers.at(camera).map_from_camera();
}

void Simulation::act(const Action& action) {
  // What is in the room now only the stage knows: it may have been put there since.
  const bool of_now = std::holds_alternative<RemoveAction>(action);
  const auto problem = of_now ? std::nullopt : find_action_problem(impl_->scenario, action, "");
  if (problem) throw std::invalid_argument(problem->path + ": " + problem->message);
  impl_->stage.act(action);
}

std::vector<OdometryReport> Simulation::take_odometry() {
  return impl_->stage.take_odometry();
}

std::vector<Happening> Simulation::take_happenings() {
  return impl_->stage.take_happenings();
}

}  // namespace skylight::sim
