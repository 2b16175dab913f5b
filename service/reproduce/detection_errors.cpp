#include "service/reproduce/detection_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Geometry>

#include "tracker/metrics.hpp"

namespace skylight::service::reproduce {
namespace {

constexpr double kNoSpread = 1e-9;  ///< m: what is left of equal errors by rounding

/// A run's error vectors less their mean, frame by frame; none where nothing was detected.
using Residuals = std::vector<std::optional<Eigen::Vector2d>>;

Residuals without_mean(Residuals errors) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (const auto& error : errors) {
    if (!error) continue;
    sum += *error;
    ++count;
  }
  for (auto& error : errors)
    if (error) *error -= sum / count;
  return errors;
}

/// Mean product of the residuals that lie so many frames apart, over all runs; none where there are no two.
std::optional<double> covariance(const std::vector<Residuals>& runs, std::size_t lag) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Residuals& run : runs) {
    for (std::size_t i = 0; i + lag < run.size(); ++i) {
      if (!run[i] || !run[i + lag]) continue;
      sum += run[i]->dot(*run[i + lag]);
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return sum / static_cast<double>(count);
}

void judge_correlation(const std::vector<Residuals>& runs, double frame_rate_hz, DetectionErrors& out) {
  const double variance = covariance(runs, 0).value_or(0.0);
  out.std_m = std::sqrt(variance);
  if (out.std_m < kNoSpread) return;
  const auto correlation = [&](std::size_t lag) { return covariance(runs, lag).value_or(0.0) / variance; };
  out.lag_1 = correlation(1);
  std::size_t longest = 0;
  for (const Residuals& run : runs) longest = std::max(longest, run.size() / 2);
  constexpr double kFallen = 1.0 / std::numbers::e;
  double before = 1.0;
  for (std::size_t lag = 1; lag <= longest; ++lag) {
    const double now = correlation(lag);
    if (now <= kFallen) {
      const double frames = static_cast<double>(lag - 1) + (before - kFallen) / (before - now);
      out.e_folding_s = frames / frame_rate_hz;
      return;
    }
    before = now;
  }
}

/// Sums over one route's runs.
class Route {
 public:
  explicit Route(std::string name) { out_.route = std::move(name); }

  void add(const ObservedRun& run, std::string_view variant) {
    frame_rate_hz_ = run.frame_rate_hz;
    Residuals errors;
    for (const TracedFrame& frame : trace(run, variant)) {
      errors.emplace_back();
      ++out_.frames;
      if (!frame.detected) continue;
      errors.back() = *frame.detected - frame.truth;
      take(*errors.back(), frame);
    }
    residuals_.push_back(without_mean(std::move(errors)));
  }

  DetectionErrors result() {
    out_.found = distances_.size();
    if (out_.found == 0) return out_;
    const auto count = static_cast<double>(out_.found);
    out_.bias_map_m /= count;
    out_.bias_robot_m /= count;
    out_.bias_outward_m /= count;
    out_.mean_yaw_error /= count;
    std::sort(distances_.begin(), distances_.end());
    out_.mean_m = std::accumulate(distances_.begin(), distances_.end(), 0.0) / count;
    out_.p99_m = percentile(distances_, 0.99);
    judge_correlation(residuals_, frame_rate_hz_, out_);
    return out_;
  }

 private:
  void take(const Eigen::Vector2d& error, const TracedFrame& frame) {
    distances_.push_back(error.norm());
    out_.bias_map_m += error;
    out_.bias_robot_m += Eigen::Rotation2Dd(-frame.truth_yaw) * error;
    const double outward = std::atan2(frame.truth.y(), frame.truth.x());
    out_.bias_outward_m += Eigen::Rotation2Dd(-outward) * error;
    out_.mean_yaw_error += std::abs(wrap_angle(frame.detected_yaw - frame.truth_yaw));
  }

  DetectionErrors out_;
  double frame_rate_hz_ = 0.0;
  std::vector<double> distances_;
  std::vector<Residuals> residuals_;
};

}  // namespace

std::vector<DetectionErrors> detection_errors(const Runs& runs, std::string_view variant) {
  std::vector<DetectionErrors> out;
  for (const std::string& name : routes_of(runs)) {
    Route route(name);
    for (const ObservedRun& run : runs)
      if (run.route == name) route.add(run, variant);
    out.push_back(route.result());
  }
  return out;
}

}  // namespace skylight::service::reproduce
