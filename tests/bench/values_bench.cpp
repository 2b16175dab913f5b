// What happens to a pose once it is measured: filter, history, look-up.
#include <benchmark/benchmark.h>

#include "tracker/filter/window.hpp"
#include "tracker/history.hpp"

namespace skylight::bench {
namespace {

Time frame_time(std::uint64_t i) {
  return Time{from_seconds(static_cast<double>(i) / 30.0)};
}

// To and fro on a line at 0.22 m/s.
Observation observation(std::uint64_t i) {
  const auto place = static_cast<double>(std::min(i % 600, 600 - i % 600));
  return {.captured = frame_time(i),
          .pose = {.x = place * 0.22 / 30.0},
          .covariance = Covariance3::Identity() * 1e-6};
}

void window_filter_update(benchmark::State& state) {
  WindowFilter filter({.window_size = static_cast<int>(state.range(0))});
  std::uint64_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(filter.update(frame_time(i), observation(i)));
    ++i;
  }
}
BENCHMARK(window_filter_update)->ArgName("window")->Arg(12)->Arg(100)->Unit(benchmark::kNanosecond);

HistoryEntry entry(std::uint64_t i) {
  const Observation measured = observation(i);
  return {.captured = measured.captured,
          .state = TrackState::tracking,
          .measured = measured,
          .filtered = Estimate{.at = measured.captured, .pose = measured.pose}};
}

constexpr std::uint64_t kTenMinutes = 18'000;  // at 30 Hz: what a history keeps by default

PoseHistory full_history() {
  PoseHistory history;
  for (std::uint64_t i = 0; i < kTenMinutes; ++i) history.append(entry(i));
  return history;
}

void history_append(benchmark::State& state) {
  PoseHistory history = full_history();
  std::uint64_t i = kTenMinutes;
  for (auto _ : state) benchmark::DoNotOptimize(history.append(entry(i++)));
  state.counters["entries"] = static_cast<double>(history.view().size());
}
BENCHMARK(history_append)->Unit(benchmark::kNanosecond);

// A view and the pose between two frames, at instants all over the ten minutes.
void history_pose(benchmark::State& state) {
  const PoseHistory history = full_history();
  std::uint64_t i = 0;
  for (auto _ : state) {
    i = (i + 7919) % (kTenMinutes - 1);
    const Time at = frame_time(i) + std::chrono::milliseconds(11);
    benchmark::DoNotOptimize(history.view().pose(PoseKind::filtered, at));
  }
  state.counters["entries"] = static_cast<double>(history.view().size());
}
BENCHMARK(history_pose)->Unit(benchmark::kNanosecond);

}  // namespace
}  // namespace skylight::bench
