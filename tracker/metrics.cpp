#include "tracker/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

namespace skylight {
namespace {

/// Correlations closer to 1 than this leave nothing to invert.
constexpr double kLeastPivot = 1e-9;

bool finite(const Pose2& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.yaw);
}

/// e^T P^-1 e; none where P is no covariance. Scaled to correlations first, so that metres and radians
/// of very different size do not pass for a singular matrix.
template <int N>
std::optional<double> normalised_square(const Eigen::Matrix<double, N, 1>& error,
                                        const Eigen::Matrix<double, N, N>& p) {
  const Eigen::Matrix<double, N, 1> variances = p.diagonal();
  if (!p.allFinite() || !(variances.minCoeff() > 0.0)) return std::nullopt;
  const Eigen::Matrix<double, N, 1> per_sigma = variances.cwiseSqrt().cwiseInverse();
  const Eigen::Matrix<double, N, N> correlation = per_sigma.asDiagonal() * p * per_sigma.asDiagonal();
  if (!correlation.allFinite() || (correlation - correlation.transpose()).cwiseAbs().maxCoeff() > 1e-6)
    return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix<double, N, N>> factors(correlation);
  if (!(factors.vectorD().minCoeff() > kLeastPivot)) return std::nullopt;
  const Eigen::Matrix<double, N, 1> scaled = per_sigma.cwiseProduct(error);
  return scaled.dot(factors.solve(scaled));
}

ErrorSummary summarise(std::vector<double> errors) {
  ErrorSummary out;
  if (errors.empty()) return out;
  std::sort(errors.begin(), errors.end());
  const auto n = static_cast<double>(errors.size());
  out.count = errors.size();
  out.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / n;
  double squares = 0.0;
  for (const double e : errors) squares += (e - out.mean) * (e - out.mean);
  out.std = std::sqrt(squares / n);
  out.min = errors.front();
  out.p50 = percentile(errors, 0.50);
  out.p95 = percentile(errors, 0.95);
  out.p99 = percentile(errors, 0.99);
  out.max = errors.back();
  return out;
}

}  // namespace

double percentile(const std::vector<double>& sorted, double q) {
  if (sorted.empty()) return 0.0;
  const double rank = static_cast<double>(sorted.size() - 1) * std::clamp(q, 0.0, 1.0);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (rank - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

void RobotMetrics::add(const ScoredFrame& frame) {
  const bool has_pose = frame.estimate && finite(*frame.estimate);
  const double distance = has_pose ? (frame.estimate->position() - frame.truth.position()).norm() : 0.0;
  const bool wrong = frame.estimate && !(has_pose && distance <= kUsableError);
  if (frame.state == TrackState::tracking && wrong) ++confident_wrong_;
  judge_finding(frame, has_pose, wrong);

  if (frame.in_view && !came_into_view_) came_into_view_ = frame.captured;
  if (!came_into_view_ || frame.captured - *came_into_view_ < kGrace) return;
  ++frames_;
  if (frame.measured) ++measured_;
  if (!has_pose) return;
  if (distance < kUsableError) ++usable_;
  const double yaw_error = wrap_angle(frame.estimate->yaw - frame.truth.yaw);
  position_errors_.push_back(distance);
  yaw_errors_.push_back(std::abs(yaw_error));
  if (frame.covariance) {
    judge_covariance({frame.estimate->x - frame.truth.x, frame.estimate->y - frame.truth.y, yaw_error},
                     *frame.covariance, frame.in_view && frame.visible < kHidden);
  }
}

void RobotMetrics::away() {
  last_truth_.reset();
  was_visible_ = false;
  if (waiting_since_) ++never_found_;
  waiting_since_.reset();
}

void RobotMetrics::judge_finding(const ScoredFrame& frame, bool has_pose, bool wrong) {
  const bool visible = frame.visible >= kHidden;
  const bool carried = last_truth_ && (frame.truth.position() - last_truth_->position()).norm() > kCarried;
  if (waiting_since_ && (!visible || carried)) {
    ++never_found_;
    waiting_since_.reset();
  }
  if (visible && (!was_visible_ || carried)) waiting_since_ = frame.captured;
  if (waiting_since_ && has_pose && !wrong && frame.state == TrackState::tracking) {
    find_times_.push_back(to_seconds(frame.captured - *waiting_since_));
    waiting_since_.reset();
  }
  if (frame.in_view && !visible) {
    ++hidden_;
    if (wrong) ++hidden_wrong_;
    if (frame.state == TrackState::occluded) ++hidden_told_;
  }
  was_visible_ = visible;
  last_truth_ = frame.truth;
}

void RobotMetrics::judge_covariance(const Eigen::Vector3d& error, const Covariance3& covariance,
                                    bool hidden) {
  const std::optional<double> nees = normalised_square<3>(error, covariance);
  const std::optional<double> on_floor =
      normalised_square<2>(error.head<2>(), Eigen::Matrix2d(covariance.topLeftCorner<2, 2>()));
  if (!nees || !on_floor) {
    ++bad_covariances_;
    return;
  }
  ++nees_frames_;
  nees_sum_ += *nees;
  if (*on_floor <= kEllipse95) ++inside_ellipse_;
  if (!hidden) return;
  ++hidden_nees_frames_;
  hidden_nees_sum_ += *nees;
}

void RobotMetrics::merge(const RobotMetrics& other) {
  // By index and with the space made first: a robot's metrics may be merged with themselves.
  const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
    const std::size_t n = from.size();
    to.reserve(to.size() + n);
    for (std::size_t i = 0; i < n; ++i) to.push_back(from[i]);
  };
  frames_ += other.frames_;
  measured_ += other.measured_;
  usable_ += other.usable_;
  confident_wrong_ += other.confident_wrong_;
  append(position_errors_, other.position_errors_);
  append(yaw_errors_, other.yaw_errors_);
  nees_sum_ += other.nees_sum_;
  nees_frames_ += other.nees_frames_;
  inside_ellipse_ += other.inside_ellipse_;
  bad_covariances_ += other.bad_covariances_;
  append(find_times_, other.find_times_);
  never_found_ += other.never_found_ + (other.waiting_since_ ? 1 : 0);
  hidden_ += other.hidden_;
  hidden_wrong_ += other.hidden_wrong_;
  hidden_told_ += other.hidden_told_;
  hidden_nees_sum_ += other.hidden_nees_sum_;
  hidden_nees_frames_ += other.hidden_nees_frames_;
}

RobotScore RobotMetrics::score() const {
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
  };
  RobotScore out;
  out.frames = frames_;
  out.position_error_m = summarise(position_errors_);
  out.yaw_error_rad = summarise(yaw_errors_);
  out.availability = share(position_errors_.size(), frames_);
  out.measured = share(measured_, frames_);
  out.usable = share(usable_, frames_);
  out.confident_wrong = confident_wrong_;
  out.nees_mean = nees_frames_ == 0 ? 0.0 : nees_sum_ / static_cast<double>(nees_frames_);
  out.ellipse_95 = share(inside_ellipse_, nees_frames_);
  out.nees_frames = nees_frames_;
  out.bad_covariances = bad_covariances_;
  out.finds = find_times_.size();
  for (const double time : find_times_) {
    out.find_mean_s += time / static_cast<double>(find_times_.size());
    out.find_worst_s = std::max(out.find_worst_s, time);
  }
  out.never_found = never_found_ + (waiting_since_ ? 1 : 0);
  out.hidden = hidden_;
  out.hidden_wrong = hidden_wrong_;
  out.hidden_told = hidden_told_;
  out.hidden_nees_frames = hidden_nees_frames_;
  if (hidden_nees_frames_ > 0)
    out.hidden_nees_mean = hidden_nees_sum_ / static_cast<double>(hidden_nees_frames_);
  return out;
}

}  // namespace skylight
