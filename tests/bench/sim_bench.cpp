// The simulator: one frame drawn, the world stepped up to it.
#include <benchmark/benchmark.h>

#include "sim/simulation.hpp"
#include "tests/bench/recording.hpp"

namespace skylight::bench {
namespace {

void render_frame(benchmark::State& state) {
  const RoomOptions options{.robots = static_cast<int>(state.range(0)), .depth = state.range(1) != 0};
  sim::Simulation simulation(room(options));
  simulation.next();  // the floor is drawn once
  for (auto _ : state) benchmark::DoNotOptimize(simulation.next());
  state.counters["frames_per_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.SetLabel(room_label(options));
}
BENCHMARK(render_frame)
    ->ArgNames({"robots", "depth"})
    ->ArgsProduct({{1, 3, 10}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace skylight::bench
