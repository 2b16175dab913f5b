// The simulator: frames drawn, the world stepped up to them; and what each effect costs.
#include <algorithm>
#include <string>

#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>

#include "sim/scenario/scenario_file.hpp"
#include "sim/simulation.hpp"
#include "tests/bench/recording.hpp"

namespace skylight::bench {
namespace {

void run(benchmark::State& state, const sim::Scenario& scenario) {
  sim::Simulation simulation(scenario);
  simulation.next();  // the floor is drawn once
  for (auto _ : state) benchmark::DoNotOptimize(simulation.next());
  state.counters["frames_per_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void render_frame(benchmark::State& state) {
  const RoomOptions options{.robots = static_cast<int>(state.range(0)), .depth = state.range(1) != 0};
  run(state, room(options));
  state.SetLabel(room_label(options));
}
BENCHMARK(render_frame)
    ->ArgNames({"robots", "depth"})
    ->ArgsProduct({{1, 3, 10}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

/// Image and depth with every effect on (no compression, no moving camera); half of the robots drive.
sim::Scenario full_room(int robots) {
  sim::Scenario scenario = sim::parse_scenario(R"({
    "seed": 1, "room": { "size_m": [8, 6], "floor": { "material": "speckle" } },
    "cameras": [{ "id": "ceiling", "shutter": "rolling", "auto_exposure": { "enabled": true },
                  "depth": { "enabled": true } }]
  })",
                                               "benchmark room");
  const int columns = robots > 10 ? 14 : 5;
  const int rows = (robots + columns - 1) / columns;
  for (int i = 0; i < robots; ++i) {
    sim::RobotSpec robot;
    robot.id = "waffle" + std::to_string(i);
    robot.start = {-3.4 + 6.8 * (i % columns) / std::max(1, columns - 1),
                   -2.1 + 4.2 * (i / columns) / std::max(1, rows - 1), i % 2 == 0 ? 90.0 : 17.0 * (i % 20)};
    if (i % 2 == 0)
      robot.program = {{sim::CircleStep{.radius_m = 0.05, .rounds = 1000.0, .speed_mps = 0.05}}};
    scenario.robots.push_back(robot);
  }
  return scenario;
}

/// A hundred robots are drawn by two threads.
void all_effects(benchmark::State& state) {
  const int threads = state.range(0) < 100 ? 1 : 2;
  cv::setNumThreads(threads);
  run(state, full_room(static_cast<int>(state.range(0))));
  cv::setNumThreads(1);
  state.SetLabel("1920 x 1080, image and depth, all effects, " +
                 std::string(threads == 1 ? "one thread" : "two threads"));
}
BENCHMARK(all_effects)->ArgName("robots")->Arg(1)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK(all_effects)->ArgName("robots")->Arg(100)->UseRealTime()->Unit(benchmark::kMicrosecond);

/// Ten robots without one of the effects: the difference to all_effects/robots:10 is its share.
template <typename SwitchOff>
void without(benchmark::State& state, SwitchOff switch_off) {
  sim::Scenario scenario = full_room(10);
  switch_off(scenario, scenario.cameras.front());
  run(state, scenario);
}
using sim::CameraSpec;
using sim::Scenario;
BENCHMARK_CAPTURE(without, depth, [](Scenario&, CameraSpec& c) {
  c.depth.enabled = false;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, depth_noise, [](Scenario&, CameraSpec& c) {
  c.depth.noise = false;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, sensor_noise, [](Scenario&, CameraSpec& c) {
  c.sensor.noise = false;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, rolling_shutter, [](Scenario&, CameraSpec& c) {
  c.shutter = sim::Shutter::global;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, lamps, [](Scenario& s, CameraSpec&) {
  s.light.lamps.clear();
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, gloss, [](Scenario& s, CameraSpec&) {
  s.room.floor.gloss = 0.0;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, motion_blur, [](Scenario&, CameraSpec& c) {
  c.exposure_s = 0.0001;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, contact_shadow, [](Scenario& s, CameraSpec&) {
  s.light.contact_shadow = 0.0;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, flicker, [](Scenario& s, CameraSpec&) {
  s.light.flicker.depth = 0.0;
})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(without, auto_exposure, [](Scenario&, CameraSpec& c) {
  c.auto_exposure.enabled = false;
})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace skylight::bench
