#include "service/simulator_desk.hpp"

#include <algorithm>
#include <utility>

#include "service/routes/context.hpp"

namespace skylight::service {

namespace {

// No path of this machine goes out.
std::string public_name(const Config& config, const std::shared_ptr<LiveSimulator>& live) {
  const auto* source = std::get_if<SimulatorSource>(&config.source.input);
  if (source == nullptr || !live) return {};
  return source->scenario.ends_with(".json") ? live->shows().name() : source->scenario;
}

}  // namespace

SimulatorDesk::SimulatorDesk(Config config, std::shared_ptr<LiveSimulator> live, Pipeline& pipeline,
                             AppearanceStore& appearances)
    : pipeline_(pipeline),
      appearances_(appearances),
      config_(std::move(config)),
      running_{live, public_name(config_, live)} {}

SimulatorDesk::Running SimulatorDesk::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

void SimulatorDesk::load(const std::string& scenario, std::optional<std::uint64_t> seed) {
  const auto shipped = shipped_scenarios();
  // By its name alone: no path of a request reaches the file system.
  if (std::none_of(shipped.begin(), shipped.end(), [&](const auto& each) { return each.name == scenario; }))
    throw SourceError("no scenario called '" + scenario + "' comes with Skylight");
  const std::lock_guard changing(changing_);
  Config config = config_;
  config.source.input = SimulatorSource{.scenario = scenario, .seed = seed};
  config.cameras.clear();
  config.appearances.clear();
  config.robots.clear();
  begin(config);
  config_ = std::move(config);
}

void SimulatorDesk::reset() {
  const std::lock_guard changing(changing_);
  read_calibrations(config_);  // they may be new
  begin(config_);
}

// Everything that can fail comes before the pipeline is touched.
void SimulatorDesk::begin(const Config& config) {
  const auto& source = std::get<SimulatorSource>(config.source.input);
  const SimulatorStatus before = running().live->status();
  auto next = std::make_shared<LiveSimulator>(std::make_unique<SimulatorFrames>(source.scenario, source.seed),
                                              before.speed);
  if (before.state == RunState::paused) next->pause();
  const Assembly assembly = assemble(config, next);
  PipelineParts parts = pipeline_parts(assembly);
  pipeline_.restart(std::move(parts));
  appearances_.replace(assembly.appearances);
  const std::string name = public_name(config, next);
  {
    const std::lock_guard lock(mutex_);
    running_ = {next, name};
  }
  pipeline_.events().add({.kind = "simulator.scenario",
                          .message = "the simulator shows " + name + " from its beginning",
                          .data = {{"scenario", name}, {"seed", next->shows().seed()}}});
}

}  // namespace skylight::service
