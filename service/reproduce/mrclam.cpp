#include "service/reproduce/mrclam.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "service/evaluation/random.hpp"
#include "tracker/filter/motion.hpp"
#include "tracker/filter/window.hpp"

namespace skylight::service::reproduce {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(100);
constexpr std::size_t kEach = 5;  // frames from one look back and ahead to the next
constexpr Duration kLag = std::chrono::seconds(1);
constexpr Duration kHalf = std::chrono::milliseconds(500);
constexpr Duration kOne = std::chrono::seconds(1);
constexpr double kLeastBetween = 3.0;  // s from one gap's end to the next gap: the filter has settled
constexpr double kMoves = 0.02;        // m/s

void require(double value, double low, double high, const char* name) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument(std::string(name) + " must be " + std::to_string(low) + " to " +
                              std::to_string(high) + ", not " + std::to_string(value));
}

void require_valid(const MrclamNoise& noise) {
  require(noise.white_m, 1e-4, 1.0, "white_m");
  require(noise.white_rad, 1e-4, 1.0, "white_rad");
  require(noise.slow_m, 0.0, 1.0, "slow_m");
  require(noise.slow_time_s, 0.1, 1000.0, "slow_time_s");
  require(noise.single_miss, 0.0, 0.9, "single_miss");
  require(noise.gap_s, 0.2, 4.0, "gap_s");
  require(noise.gap_every_s, noise.gap_s + 4.0, 1000.0, "gap_every_s");
}

/// What a camera makes of the truth, frame by frame.
class Observer {
 public:
  Observer(const MrclamNoise& noise, std::uint64_t seed)
      : noise_(noise), random_(seed), keep_(std::exp(-to_seconds(kPeriod) / noise.slow_time_s)) {
    slow_ = noise_.slow_m * random_.normal2();
    const double place = noise_.white_m * noise_.white_m + noise_.slow_m * noise_.slow_m;
    covariance_ = Eigen::Vector3d(place, place, noise_.white_rad * noise_.white_rad).asDiagonal();
  }
  /// To be called for every frame, whether the robot is seen in it or not.
  Observation see(Time at, const Pose2& truth) {
    const Eigen::Vector2d error = slow_ + noise_.white_m * random_.normal2();
    const double turn = noise_.white_rad * random_.normal();
    slow_ = keep_ * slow_ + noise_.slow_m * std::sqrt(1.0 - keep_ * keep_) * random_.normal2();
    missed_ = random_.uniform() < noise_.single_miss;
    return {.captured = at,
            .pose = {truth.x + error.x(), truth.y + error.y(), wrap_angle(truth.yaw + turn)},
            .covariance = covariance_};
  }
  bool missed() const { return missed_; }

 private:
  MrclamNoise noise_;
  Random random_;
  double keep_;
  Eigen::Vector2d slow_;
  Covariance3 covariance_;
  bool missed_ = false;
};

/// Marks the gaps; the waits between them are kLeastBetween and a memoryless rest.
void mark_gaps(std::vector<MrclamFrame>& frames, const MrclamNoise& noise, std::uint64_t seed) {
  Random random(seed);
  const auto length = static_cast<std::size_t>(std::lround(noise.gap_s * kMrclamRateHz));
  const double rest = noise.gap_every_s - noise.gap_s - kLeastBetween;
  const auto wait = [&] {
    return static_cast<std::size_t>(std::lround((kLeastBetween + random.exponential(rest)) * kMrclamRateHz));
  };
  for (std::size_t at = wait(); at + length <= frames.size(); at += length + wait()) {
    for (std::size_t i = at; i < at + length; ++i) frames[i].in_gap = true;
    frames[at + length - 1].ends_gap = true;
  }
}

/// Runs each(0) to each(count - 1); the first failure, by its number, is thrown when all have ended.
void in_parallel(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& each) {
  std::atomic<std::size_t> next{0};
  std::vector<std::exception_ptr> failures(count);
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        each(i);
      } catch (...) {
        failures[i] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> others;
    for (std::size_t i = 1; i < std::min(threads, count); ++i) others.emplace_back(work);
    work();
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

/// Metrics of a run: its first second is not counted, as RobotMetrics has it.
RobotMetrics metrics_of(const MrclamRun& run) {
  RobotMetrics metrics;
  if (!run.frames.empty()) metrics.add({.captured = run.frames.front().captured});
  return metrics;
}

struct FilterMetrics {
  RobotMetrics filtered, smoothed, half_ahead, one_ahead, gap_end, all;

  static FilterMetrics of(const MrclamRun& run) {
    const RobotMetrics m = metrics_of(run);
    return {.filtered = m, .smoothed = m, .half_ahead = m, .one_ahead = m, .gap_end = m, .all = m};
  }
  void merge(const FilterMetrics& other) {
    filtered.merge(other.filtered);
    smoothed.merge(other.smoothed);
    half_ahead.merge(other.half_ahead);
    one_ahead.merge(other.one_ahead);
    gap_end.merge(other.gap_end);
    all.merge(other.all);
  }
  MrclamScore score() const {
    return {.filtered = filtered.score(),
            .smoothed = smoothed.score(),
            .half_ahead = half_ahead.score(),
            .one_ahead = one_ahead.score(),
            .gap_end = gap_end.score(),
            .all = all.score()};
  }
};

struct Replay {
  FilterMetrics metrics;
  std::vector<std::optional<Pose2>> filtered, smoothed;
};

ScoredFrame scored(Time at, const Pose2& truth, const std::optional<Estimate>& estimate) {
  ScoredFrame out{.captured = at, .truth = truth};
  if (estimate) {
    out.estimate = estimate->pose;
    out.covariance = estimate->covariance;
  }
  return out;
}

void judge_frame(const MrclamFrame& frame, const FilterStep& step, FilterMetrics& metrics) {
  if (!frame.truth) return;
  ScoredFrame now = scored(frame.captured, *frame.truth, step.estimate);
  now.state = step.state;
  now.measured = frame.seen.has_value();
  metrics.all.add(now);
  if (!frame.in_gap) metrics.filtered.add(now);
  if (frame.ends_gap) metrics.gap_end.add(now);
}

void judge_ahead(const MrclamRun& run, Time now, const Filter& filter, FilterMetrics& metrics) {
  const auto judge = [&](Duration ahead, RobotMetrics& into) {
    if (const auto truth = truth_at(run.robot, now + ahead))
      into.add(scored(now + ahead, *truth, filter.predict(now + ahead)));
  };
  judge(kHalf, metrics.half_ahead);
  judge(kOne, metrics.one_ahead);
}

/// The frames that have become kLag old since the last time.
void judge_back(const MrclamRun& run, std::size_t newest, const Filter& filter, Replay& replay) {
  const auto lag = static_cast<std::size_t>(kLag / kPeriod);
  if (filter.smoothing_lag() < kLag || newest < lag + kEach) return;
  std::size_t i = newest - lag - kEach + 1;
  for (const Estimate& estimate : filter.smoothed_from(run.frames[i].captured)) {
    while (i <= newest - lag && run.frames[i].captured < estimate.at) ++i;
    if (i > newest - lag) break;
    if (run.frames[i].captured == estimate.at) replay.smoothed[i] = estimate.pose;
    if (run.frames[i].captured != estimate.at || !run.frames[i].truth || run.frames[i].in_gap) continue;
    replay.metrics.smoothed.add(scored(estimate.at, *run.frames[i].truth, estimate));
  }
}

std::unique_ptr<Filter> make_filter(std::size_t which, const MrclamNoise& noise) {
  if (which == kWindow)
    return std::make_unique<WindowFilter>(WindowFilterConfig{.window_size = 12, .alpha = 0.3});
  MotionFilterConfig config;
  if (which == kMotionTold) {
    config.observation_bias_m = noise.slow_m;
    config.bias_time_s = noise.slow_time_s;
  }
  return std::make_unique<MotionFilter>(config);
}

Replay replay_run(const MrclamRun& run, std::size_t which, const MrclamNoise& noise) {
  Replay out{.metrics = FilterMetrics::of(run), .filtered = {}, .smoothed = {}};
  out.filtered.resize(run.frames.size());
  out.smoothed.resize(run.frames.size());
  const std::unique_ptr<Filter> filter = make_filter(which, noise);
  auto reading = run.robot.odometry.begin();
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const MrclamFrame& frame = run.frames[i];
    if (which == kMotionOdometry) {
      for (; reading != run.robot.odometry.end() && reading->at <= frame.captured; ++reading)
        filter->odometry(*reading);
    }
    const FilterStep step = filter->update(frame.captured, frame.seen);
    if (step.estimate) out.filtered[i] = step.estimate->pose;
    judge_frame(frame, step, out.metrics);
    if (i % kEach != 0) continue;
    if (!frame.in_gap) judge_ahead(run, frame.captured, *filter, out.metrics);
    judge_back(run, i, *filter, out);
  }
  return out;
}

RobotMetrics judge_measured(const MrclamRun& run) {
  RobotMetrics out = metrics_of(run);
  for (const MrclamFrame& frame : run.frames) {
    if (!frame.seen || !frame.truth) continue;
    out.add({.captured = frame.captured,
             .truth = *frame.truth,
             .estimate = frame.seen->pose,
             .covariance = frame.seen->covariance,
             .measured = true});
  }
  return out;
}

double moving_share(const std::vector<MrclamFrame>& frames) {
  std::size_t moving = 0;
  std::size_t known = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (!frames[i].truth || !frames[i - 1].truth) continue;
    ++known;
    const double way = (frames[i].truth->position() - frames[i - 1].truth->position()).norm();
    if (way * kMrclamRateHz > kMoves) ++moving;
  }
  return known == 0 ? 0.0 : static_cast<double>(moving) / static_cast<double>(known);
}

/// Of one robot, or of several.
struct Metrics {
  RobotMetrics measured;
  std::array<FilterMetrics, kMrclamFilters> filters;

  MrclamScores scores(int robot) const {
    MrclamScores out{.robot = robot, .measured = measured.score(), .filters = {}};
    for (std::size_t f = 0; f < kMrclamFilters; ++f) out.filters.at(f) = filters.at(f).score();
    return out;
  }
};

using Replays = std::vector<std::array<Replay, kMrclamFilters>>;

MrclamResults gather(std::vector<MrclamRun> runs, Replays replays, const MrclamNoise& noise) {
  MrclamResults out{.noise = noise, .seconds = 0.0, .pooled = {}, .robots = {}, .traces = {}};
  Metrics pooled;
  double moving = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const double seconds = static_cast<double>(runs[r].frames.size()) / kMrclamRateHz;
    Metrics one{.measured = judge_measured(runs[r]), .filters = {}};
    MrclamTrace trace{.robot = runs[r].robot.robot, .frames = {}, .filtered = {}, .smoothed = {}};
    pooled.measured.merge(one.measured);
    for (std::size_t f = 0; f < kMrclamFilters; ++f) {
      one.filters.at(f) = std::move(replays[r].at(f).metrics);
      pooled.filters.at(f).merge(one.filters.at(f));
      trace.filtered.at(f) = std::move(replays[r].at(f).filtered);
      trace.smoothed.at(f) = std::move(replays[r].at(f).smoothed);
    }
    out.robots.push_back(one.scores(trace.robot));
    out.robots.back().moving = moving_share(runs[r].frames);
    out.robots.back().commands = judge_commands(runs[r]);
    out.seconds += seconds;
    moving += seconds * out.robots.back().moving;
    trace.frames = std::move(runs[r].frames);
    out.traces.push_back(std::move(trace));
  }
  out.pooled = pooled.scores(0);
  if (out.seconds > 0.0) out.pooled.moving = moving / out.seconds;
  return out;
}

}  // namespace

MrclamRun make_mrclam_run(MrclamRobot robot, const MrclamNoise& noise, double seconds) {
  require_valid(noise);
  require(seconds, 0.0, 1e6, "seconds");
  MrclamRun run{.robot = std::move(robot), .frames = {}};
  if (run.robot.truth.empty() || run.robot.odometry.empty()) return run;
  const Time begin = std::max(run.robot.truth.front().at, run.robot.odometry.front().at);
  Time end = std::min(run.robot.truth.back().at, run.robot.odometry.back().at);
  if (seconds > 0.0) end = std::min(end, begin + from_seconds(seconds));
  for (Time at = begin; at <= end; at += kPeriod)
    run.frames.push_back({.captured = at, .truth = truth_at(run.robot, at)});
  const std::uint64_t seed = noise.seed * 1000003U + static_cast<std::uint64_t>(run.robot.robot) * 2U;
  mark_gaps(run.frames, noise, seed);
  Observer observer(noise, seed + 1U);
  for (MrclamFrame& frame : run.frames) {
    const Observation seen = observer.see(frame.captured, frame.truth.value_or(Pose2{}));
    if (frame.truth && !frame.in_gap && !observer.missed()) frame.seen = seen;
  }
  return run;
}

MrclamResults run_mrclam(const std::filesystem::path& folder, const MrclamOptions& options) {
  const std::size_t threads =
      options.threads > 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  std::vector<MrclamRun> runs(kMrclamRobots);
  in_parallel(runs.size(), threads, [&](std::size_t i) {
    runs[i] =
        make_mrclam_run(read_mrclam_robot(folder, static_cast<int>(i) + 1), options.noise, options.seconds);
  });
  Replays replays(runs.size());
  in_parallel(runs.size() * kMrclamFilters, threads, [&](std::size_t i) {
    constexpr std::array kLongestFirst{kMotionOdometry, kMotion, kMotionTold, kWindow};
    const std::size_t which = kLongestFirst.at(i / runs.size());
    replays[i % runs.size()].at(which) = replay_run(runs[i % runs.size()], which, options.noise);
  });
  return gather(std::move(runs), std::move(replays), options.noise);
}

}  // namespace skylight::service::reproduce
