// From a frame in memory to poses: tracking, searching, and the baseline on the same frames.
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "tests/bench/recording.hpp"
#include "tracker/search.hpp"

namespace skylight::bench {
namespace {

constexpr int kWarmUpFrames = 60;

void count_frames(benchmark::State& state, const Recording& recording, int robots) {
  const auto& image = recording.images.at(0);
  state.counters["frames_per_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["robots"] = robots;
  state.counters["width_px"] = image.cols;
  state.counters["height_px"] = image.rows;
  state.SetLabel(room_label({.robots = static_cast<int>(recording.robots.size())}));
}

// Every robot must have been measured in every frame: a tracker that has lost them is quick for nothing.
void tracked(benchmark::State& state, bool depth) {
  const auto robots = static_cast<int>(state.range(0));
  const Recording& room = recording({.robots = robots, .depth = depth});
  Tracker tracker({room.camera});
  for (const RobotSpec& spec : room.robots) tracker.add(spec);
  Player player(room);
  for (int i = 0; i < kWarmUpFrames; ++i) tracker.process(player.next());
  std::size_t measured = 0;
  for (auto _ : state) {
    for (const RobotReport& report : tracker.process(player.next())) measured += report.measured ? 1 : 0;
  }
  const auto all = static_cast<std::size_t>(state.iterations()) * room.robots.size();
  state.counters["measured"] = static_cast<double>(measured) / static_cast<double>(all);
  if (measured < all) state.SkipWithError("robots were not measured in every frame");
  count_frames(state, room, robots);
}
void tracked_frame(benchmark::State& state) {
  tracked(state, false);
}
void tracked_frame_with_depth(benchmark::State& state) {
  tracked(state, true);
}
BENCHMARK(tracked_frame)->ArgName("robots")->Arg(1)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK(tracked_frame_with_depth)->ArgName("robots")->Arg(1)->Arg(10)->Unit(benchmark::kMicrosecond);

// A tracker's CPU time for each frame.
struct Contender {
  Tracker tracker;
  Player player;
  bool sees_depth;
  std::vector<double> seconds{};

  std::size_t process() {
    Frame frame = player.next();
    if (!sees_depth) frame.depth.release();
    const std::clock_t begin = std::clock();
    const std::vector<RobotReport> reports = tracker.process(frame);
    seconds.push_back(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    return static_cast<std::size_t>(
        std::count_if(reports.begin(), reports.end(), [](const auto& report) { return report.measured; }));
  }
  double median() {
    std::nth_element(seconds.begin(), seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2),
                     seconds.end());
    return seconds[seconds.size() / 2];
  }
};

// The same frames to all, in turn, so that what else the machine does falls on all alike: of a camera without
// depth, of one with depth but without the depth's pictures, with them unused, with them used.
void depth_costs(benchmark::State& state) {
  const auto robots = static_cast<int>(state.range(0));
  const Recording& plain = recording({.robots = robots, .depth = false});
  const Recording& deep = recording({.robots = robots, .depth = true});
  TrackerConfig unused;
  unused.depth.use = false;
  std::array<Contender, 4> all{{{Tracker({plain.camera}), Player(plain), false},
                                {Tracker({deep.camera}), Player(deep), false},
                                {Tracker({deep.camera}, unused), Player(deep), true},
                                {Tracker({deep.camera}), Player(deep), true}}};
  for (Contender& each : all) {
    for (const RobotSpec& spec : deep.robots) each.tracker.add(spec);
    for (int i = 0; i < kWarmUpFrames; ++i) each.process();
    each.seconds.clear();
  }
  std::size_t measured = 0;
  std::size_t first = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < all.size(); ++i) measured += all[(first + i) % all.size()].process();
    ++first;
  }
  if (measured < static_cast<std::size_t>(state.iterations()) * all.size() * deep.robots.size())
    state.SkipWithError("robots were not measured in every frame");
  const double without = all[0].median();
  state.counters["no_picture"] = all[1].median() / without;
  state.counters["unused"] = all[2].median() / without;
  state.counters["used"] = all[3].median() / without;
  state.SetLabel(room_label({.robots = robots, .depth = true}));
}
BENCHMARK(depth_costs)->ArgName("robots")->Arg(1)->Arg(10)->Iterations(2000)->Unit(benchmark::kMicrosecond);

void homography_frame(benchmark::State& state) {
  const Recording& room = recording(1);
  Tracker tracker({room.camera});
  RobotSpec spec = room.robots.at(0);
  spec.detector = DetectorKind::homography;
  spec.homography.features = static_cast<int>(state.range(0));
  tracker.add(spec);
  Player player(room);
  std::size_t measured = 0;
  for (auto _ : state) measured += tracker.process(player.next()).at(0).measured ? 1 : 0;
  state.counters["measured"] = static_cast<double>(measured) / static_cast<double>(state.iterations());
  count_frames(state, room, 1);
}
BENCHMARK(homography_frame)->ArgName("features")->Arg(500)->Unit(benchmark::kMicrosecond);

// Flat patches of colour, in which ORB finds too little: searched by correlation.
std::shared_ptr<const Appearance> flat_patches() {
  cv::Mat image(120, 120, CV_8UC3, cv::Scalar(35, 40, 38));
  cv::rectangle(image, {10, 10, 48, 48}, cv::Scalar(230, 120, 60), cv::FILLED);
  cv::rectangle(image, {60, 60, 48, 48}, cv::Scalar(70, 200, 90), cv::FILLED);
  return std::make_shared<const Appearance>(
      "flat patches", Picture{.image = image, .metres_per_pixel = 0.0025, .surface_height_m = 0.14});
}

// Artwork of a robot that is not in the room.
std::shared_ptr<const Appearance> absent_artwork() {
  return recording(10).robots.back().appearance;
}

// How many steps cover the frame, as the tracker takes them for a robot of this size.
int steps_of_a_sweep(const Recording& room, const Appearance& appearance) {
  const Intrinsics& in = room.camera.intrinsics();
  Eigen::Matrix2d metres_by_px;
  room.camera.plane_from_pixel({in.cx_px, in.cy_px}, appearance.picture().surface_height_m, &metres_by_px);
  const double robot_px = appearance.size_m().norm() / std::sqrt(std::abs(metres_by_px.determinant()));
  Sweep sweep;
  const auto next = [&] {
    return sweep.next({in.width_px, in.height_px}, SearchConfig{}.tile_px,
                      static_cast<int>(std::ceil(robot_px)));
  };
  const cv::Rect first = next();
  int steps = 1;
  while (next() != first) ++steps;
  return steps;
}

// A frame in which a robot that is not there is searched for.
void search(benchmark::State& state, const std::shared_ptr<const Appearance>& appearance, bool whole_floor) {
  const Recording& room = recording(1);
  const int steps = steps_of_a_sweep(room, *appearance);
  TrackerConfig config;
  config.search.steps_per_frame = whole_floor ? steps : 1;
  config.search.first_steps_per_frame = config.search.steps_per_frame;
  Tracker tracker({room.camera}, config);
  tracker.add({.id = "absent", .appearance = appearance});
  Player player(room);
  std::size_t found = 0;
  for (auto _ : state) found += tracker.process(player.next()).at(0).measured ? 1 : 0;
  if (found > 0) state.SkipWithError("something was found that is not there");
  state.counters["steps"] = config.search.steps_per_frame;
  state.counters["steps_of_a_sweep"] = steps;
  count_frames(state, room, 1);
}
void search_step(benchmark::State& state) {
  search(state, absent_artwork(), false);
}
void search_whole_floor(benchmark::State& state) {
  search(state, absent_artwork(), true);
}
void search_step_flat_patches(benchmark::State& state) {
  search(state, flat_patches(), false);
}
void search_whole_floor_flat_patches(benchmark::State& state) {
  search(state, flat_patches(), true);
}
BENCHMARK(search_step)->Unit(benchmark::kMicrosecond);
BENCHMARK(search_whole_floor)->Unit(benchmark::kMicrosecond);
BENCHMARK(search_step_flat_patches)->Unit(benchmark::kMicrosecond);
BENCHMARK(search_whole_floor_flat_patches)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace skylight::bench
