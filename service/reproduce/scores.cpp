#include "service/reproduce/scores.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace skylight::service::reproduce {
namespace {

/// Everything that a filter said of a run, frame by frame.
struct Told {
  std::vector<std::optional<Observation>> seen;  ///< as the filter was given them
  std::vector<FilterStep> steps;
  std::vector<std::optional<Estimate>> smoothed;
  std::vector<std::optional<Estimate>> expected;  ///< for this frame, before it was looked at
  std::vector<std::optional<Estimate>> ahead;     ///< for this frame, ahead_s before
};

/// Plays a run into a filter and takes down what it says.
class Player {
 public:
  Player(const ObservedRun& run, const ScoreOptions& options)
      : run_(run),
        options_(options),
        filter_(options.filter()),
        lag_(filter_->smoothing_lag()),
        variant_(variant_index(run, options.variant)) {
    const std::size_t n = run.frames.size();
    told_ = {.seen = {}, .steps = {}, .smoothed = {}, .expected = {}, .ahead = {}};
    told_.smoothed.resize(n);
    told_.ahead.resize(n);
  }

  Told play() {
    for (std::size_t i = 0; i < run_.frames.size(); ++i) frame(i);
    if (!run_.frames.empty()) smooth(run_.frames.back().captured, run_.frames.back().captured);
    return std::move(told_);
  }

 private:
  void frame(std::size_t i) {
    const ObservedFrame& frame = run_.frames[i];
    if (options_.odometry) {
      for (; heard_ < run_.odometry.size() && run_.odometry[heard_].at <= frame.captured; ++heard_)
        filter_->odometry(run_.odometry[heard_]);
    }
    told_.expected.push_back(filter_->predict(frame.captured));
    const std::optional<Observation>& seen = frame.seen.at(variant_);
    told_.seen.push_back(seen);
    told_.steps.push_back(filter_->update(frame.captured, seen));
    predict(i);
    // As the tracker does: half a lag's frames at a time.
    if (options_.smoothed && lag_ > Duration::zero() &&
        frame.captured - run_.frames[smoothed_].captured >= lag_ + lag_ / 3)
      smooth(frame.captured, frame.captured - lag_);
  }

  void predict(std::size_t i) {
    const Time due = run_.frames[i].captured + from_seconds(options_.ahead_s) - std::chrono::microseconds(1);
    while (ahead_ < run_.frames.size() && run_.frames[ahead_].captured < due) ++ahead_;
    if (ahead_ < run_.frames.size()) told_.ahead[ahead_] = filter_->predict(run_.frames[ahead_].captured);
  }

  void smooth(Time newest, Time until) {
    if (!options_.smoothed || lag_ <= Duration::zero() || smoothed_ >= run_.frames.size()) return;
    const Time first = std::max(run_.frames[smoothed_].captured, newest - lag_ - lag_ / 2);
    const std::vector<Estimate> poses = filter_->smoothed_from(first);
    auto pose = poses.begin();
    for (; smoothed_ < run_.frames.size() && run_.frames[smoothed_].captured <= until; ++smoothed_) {
      const Time at = run_.frames[smoothed_].captured;
      while (pose != poses.end() && pose->at < at) ++pose;
      if (pose != poses.end() && pose->at == at) told_.smoothed[smoothed_] = *pose;
    }
  }

  const ObservedRun& run_;
  const ScoreOptions& options_;
  std::unique_ptr<Filter> filter_;
  Duration lag_;
  std::size_t variant_;
  Told told_;
  std::size_t heard_ = 0;
  std::size_t ahead_ = 0;
  std::size_t smoothed_ = 0;
};

std::optional<Estimate> as_estimate(const std::optional<Observation>& seen) {
  if (!seen) return std::nullopt;
  return Estimate{
      .at = seen->captured, .pose = seen->pose, .covariance = seen->covariance + seen->correlated};
}

ScoredFrame scored(const ObservedFrame& frame, const std::optional<Estimate>& estimate, TrackState state,
                   bool measured) {
  ScoredFrame out{.captured = frame.captured,
                  .truth = frame.truth,
                  .in_view = frame.in_view,
                  .estimate = {},
                  .covariance = {},
                  .state = state,
                  .measured = measured};
  if (estimate) {
    out.estimate = estimate->pose;
    out.covariance = estimate->covariance;
  }
  return out;
}

Eigen::Vector2d error_of(const Pose2& pose, const Pose2& truth) {
  return pose.position() - truth.position();
}

Eigen::Vector2d in_robot(const Eigen::Vector2d& error, const Pose2& truth) {
  return Eigen::Rotation2Dd(-truth.yaw) * error;
}

/// Mean length of vectors about their own mean.
double mean_about_mean(const std::vector<Eigen::Vector2d>& errors) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& e : errors) mean += e / static_cast<double>(errors.size());
  double sum = 0.0;
  for (const auto& e : errors) sum += (e - mean).norm();
  return sum;
}

}  // namespace

void KindMetrics::merge(const KindMetrics& other) {
  measured.merge(other.measured);
  filtered.merge(other.filtered);
  smoothed.merge(other.smoothed);
  predicted.merge(other.predicted);
}

KindMetrics score(const ObservedRun& run, const ScoreOptions& options) {
  const Told told = Player(run, options).play();
  KindMetrics out;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const ObservedFrame& frame = run.frames[i];
    const TrackState state = told.steps[i].state;
    const bool measured = told.seen[i].has_value();
    out.measured.add(scored(frame, as_estimate(told.seen[i]), state, measured));
    out.filtered.add(scored(frame, told.steps[i].estimate, state, measured));
    out.smoothed.add(scored(frame, told.smoothed[i], state, measured));
    out.predicted.add(scored(frame, told.ahead[i], TrackState::predicting, measured));
  }
  return out;
}

PooledScore pooled(const std::vector<const ObservedRun*>& runs, const ScoreOptions& options) {
  PooledScore out;
  for (const ObservedRun* run : runs) {
    const KindMetrics one = score(*run, options);
    const ErrorSummary errors = one.filtered.score().position_error_m;
    const double worst = errors.count > 0 ? errors.max : std::numeric_limits<double>::infinity();
    if (out.worst_run.empty() || worst > out.worst_error_m) {
      out.worst_run = run->route + ", seed " + std::to_string(run->seed);
      out.worst_error_m = worst;
    }
    out.kinds.merge(one);
  }
  return out;
}

std::vector<Reappearance> reappearances(const ObservedRun& run, const ScoreOptions& options, double least_s) {
  const Told told = Player(run, options).play();
  std::vector<Reappearance> out;
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    if (!told.seen[i]) continue;
    const double hidden = last ? to_seconds(run.frames[i].captured - run.frames[*last].captured) : 0.0;
    last = i;
    if (hidden < least_s) continue;
    const auto& expected = told.expected[i];
    Reappearance gap{.route = run.route, .seed = run.seed, .hidden_s = hidden, .lost = !expected};
    if (expected) {
      gap.error_m = error_of(expected->pose, run.frames[i].truth).norm();
      gap.stated_m = std::sqrt(expected->covariance(0, 0) + expected->covariance(1, 1));
    }
    out.push_back(gap);
  }
  return out;
}

Smoothing smoothing(const std::vector<const ObservedRun*>& runs, const ScoreOptions& options) {
  Smoothing out;
  std::size_t count = 0;
  for (const ObservedRun* run : runs) {
    const Told told = Player(*run, options).play();
    std::vector<Eigen::Vector2d> filtered;
    std::vector<Eigen::Vector2d> smoothed;
    for (std::size_t i = 0; i < run->frames.size(); ++i) {
      if (!told.steps[i].estimate || !told.smoothed[i]) continue;
      filtered.push_back(error_of(told.steps[i].estimate->pose, run->frames[i].truth));
      smoothed.push_back(error_of(told.smoothed[i]->pose, run->frames[i].truth));
    }
    out.filtered_m += mean_about_mean(filtered);
    out.smoothed_m += mean_about_mean(smoothed);
    count += filtered.size();
  }
  if (count == 0) return {};
  return {out.filtered_m / static_cast<double>(count), out.smoothed_m / static_cast<double>(count)};
}

ErrorParts error_parts(const std::vector<const ObservedRun*>& runs, const ScoreOptions& options) {
  ErrorParts out;
  double measured = 0.0;
  double filtered = 0.0;
  for (const ObservedRun* run : runs) {
    const Told told = Player(*run, options).play();
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < run->frames.size(); ++i) {
      const Pose2& truth = run->frames[i].truth;
      if (const auto& estimate = told.steps[i].estimate) {
        const Eigen::Vector2d error = error_of(estimate->pose, truth);
        out.filtered_bias_m += in_robot(error, truth);
        out.filtered_mean_m += error.norm();
        filtered += 1.0;
      }
      if (!told.seen[i]) continue;
      const Eigen::Vector2d error = error_of(told.seen[i]->pose, truth);
      out.measured_bias_m += in_robot(error, truth);
      out.measured_mean_m += error.norm();
      mean += error;
      squares += error.squaredNorm();
      count += 1.0;
    }
    measured += count;
    if (count > 0.0) out.measured_scatter_m += squares - mean.squaredNorm() / count;
  }
  if (measured == 0.0 || filtered == 0.0) return {};
  out.measured_bias_m /= measured;
  out.measured_mean_m /= measured;
  out.measured_scatter_m = std::sqrt(std::max(0.0, out.measured_scatter_m / measured));
  out.filtered_bias_m /= filtered;
  out.filtered_mean_m /= filtered;
  return out;
}

}  // namespace skylight::service::reproduce
