#include "tracker/filter/window.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include <Eigen/Eigenvalues>

namespace skylight {
namespace {

/// The random walk that a robot's velocity is taken for while nothing is seen of it: after about
/// kVelocityMemory it may be any other of its size, and one that stands may have started off.
constexpr double kVelocityMemory = 1.0;   // s
constexpr double kStartingSpeed = 0.2;    // m/s
constexpr double kStartingYawRate = 0.5;  // rad/s
/// The noise gains settle as exp(-0.64 n / W): past this many windows the limit stands for them.
constexpr int kWindowsToSettle = 6;
constexpr int kWindowsToLimit = 40;

/// The symmetric matrix nearest to `m` that is no negative variance in any direction.
Eigen::Matrix2d without_negative_variance(const Eigen::Matrix2d& m) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(m);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() *
         solver.eigenvectors().transpose();
}

bool usable(const Observation& observation) {
  return std::isfinite(observation.pose.x) && std::isfinite(observation.pose.y) &&
         std::isfinite(observation.pose.yaw) && observation.covariance.allFinite() &&
         observation.correlated.allFinite();
}

}  // namespace

std::string check(const WindowFilterConfig& config) {
  std::ostringstream out;
  if (config.window_size < 2 || config.window_size > 1000) {
    out << "window_size is " << config.window_size << ", must lie in [2, 1000]";
  } else if (!(config.alpha > 0.0 && config.alpha <= 100.0)) {
    out << "alpha is " << config.alpha << " m, must lie in (0, 100]";
  } else if (config.calibration_threshold < 0 || config.calibration_threshold > 1000) {
    out << "calibration_threshold is " << config.calibration_threshold << ", must lie in [0, 1000]";
  } else if (config.frame_loss_threshold < 1 || config.frame_loss_threshold > 100'000) {
    out << "frame_loss_threshold is " << config.frame_loss_threshold << ", must lie in [1, 100000]";
  }
  return out.str();
}

std::vector<double> window_noise_gains(int window_size) {
  const auto w = static_cast<std::size_t>(window_size);
  // h_j: what is left in p of a detection j frames ago; h_j = h_{j-1} - h_{j-W+1} / W, h_0 = 1 / W.
  std::vector<double> response(kWindowsToLimit * w);
  response[0] = 1.0 / window_size;
  for (std::size_t j = 1; j < response.size(); ++j) {
    response[j] = response[j - 1] - (j + 1 >= w ? response[j + 1 - w] / window_size : 0.0);
  }
  std::vector<double> gains(kWindowsToSettle * w + 1, 0.0);
  double later = 0.0;
  for (std::size_t n = 1; n < gains.size(); ++n) {
    later += response[n - 1] * response[n - 1];
    gains[n] = later;
  }
  // The W detections of the calibration: p and the buffer start as they are.
  std::vector<double> p(w + gains.size() - 1);
  for (std::size_t first = 0; first < w; ++first) {
    std::fill(p.begin(), p.end(), 0.0);
    p[first] = 1.0;
    for (std::size_t n = 0; n < gains.size(); ++n) {
      const std::size_t k = w - 1 + n;
      if (n > 0) p[k] = p[k - 1] - p[k + 1 - w] / window_size;
      gains[n] += p[k] * p[k];
    }
  }
  double limit = 0.0;
  for (const double h : response) limit += h * h;
  gains.back() = limit;
  return gains;
}

WindowFilter::WindowFilter(const WindowFilterConfig& config) : config_(config) {
  if (const std::string wrong = check(config); !wrong.empty()) throw std::invalid_argument(wrong);
  noise_gains_ = window_noise_gains(config.window_size);
  reset();
}

void WindowFilter::reset() {
  ever_tracked_ = false;
  frame_times_.clear();
  last_ = {};
  begin_again();
}

void WindowFilter::begin_again() {
  phase_ = Phase::counting;
  detections_ = 0;
  losses_left_ = config_.frame_loss_threshold;
  buffer_.clear();
  accepted_.clear();
}

FilterStep WindowFilter::update(Time captured, const std::optional<Observation>& observation) {
  if (!frame_times_.empty() && captured <= frame_times_.back()) return last_;
  ++frame_;
  frame_times_.push_back(captured);
  if (frame_times_.size() > static_cast<std::size_t>(config_.window_size) + 1) frame_times_.pop_front();

  const std::optional<Observation> seen = observation && usable(*observation) ? observation : std::nullopt;
  bool accepted = seen.has_value();
  if (phase_ == Phase::running) {
    accepted = track(seen);
  } else if (seen) {
    collect(seen->pose.position());
  }
  if (accepted) {
    losses_left_ = config_.frame_loss_threshold;
    if (phase_ != Phase::counting) remember(*seen);
  } else {
    count_loss();
  }
  last_ = {.state = state(accepted), .estimate = std::nullopt, .accepted = accepted};
  if (phase_ == Phase::running) last_.estimate = predict(captured);
  return last_;
}

/// A detection before there is a prediction: counted, then gathered until the window is full.
void WindowFilter::collect(const Eigen::Vector2d& detected) {
  if (phase_ == Phase::counting && detections_ < config_.calibration_threshold) {
    ++detections_;
    return;
  }
  phase_ = Phase::calibrating;
  buffer_.push_back(detected);
  if (buffer_.size() < static_cast<std::size_t>(config_.window_size)) return;
  offset_ = (buffer_.back() - buffer_.front()) / config_.window_size;  // Eq. 1, telescoped
  predicted_ = buffer_.back();
  phase_ = Phase::running;
  ever_tracked_ = true;
  accepted_since_calibration_ = 0;
}

/// One frame after calibration; true where the observation passed the gate.
bool WindowFilter::track(const std::optional<Observation>& observation) {
  const bool accepted = observation && (observation->pose.position() - predicted_).norm() <= config_.alpha;
  buffer_.pop_front();
  if (accepted) {
    offset_ = (observation->pose.position() - buffer_.front()) / config_.window_size;  // Eq. 2, telescoped
    ++accepted_since_calibration_;
  }
  predicted_ += offset_;  // Eq. 3
  buffer_.push_back(predicted_);
  return accepted;
}

void WindowFilter::count_loss() {
  if (phase_ == Phase::counting && detections_ == 0) return;  // nothing to lose
  if (--losses_left_ == 0) begin_again();
}

TrackState WindowFilter::state(bool accepted) const {
  switch (phase_) {
    case Phase::counting:
      return ever_tracked_ ? TrackState::lost : TrackState::searching;
    case Phase::calibrating:
      return TrackState::calibrating;
    case Phase::running:
      break;
  }
  return accepted ? TrackState::tracking : TrackState::predicting;
}

void WindowFilter::remember(const Observation& observation) {
  double yaw = observation.pose.yaw;
  if (!accepted_.empty()) {
    // The nearest of the headings that look the same; for the rate alone, the pose shows what was observed.
    const double turn = 2.0 * std::numbers::pi / std::max(1, observation.heading_turns);
    yaw = accepted_.back().yaw + std::remainder(yaw - accepted_.back().yaw, turn);
  }
  Accepted entry{.frame = frame_,
                 .captured = frame_times_.back(),
                 .covariance = observation.covariance,
                 .yaw = yaw,
                 .error = {}};
  if (phase_ == Phase::running && accepted_since_calibration_ > 0)
    entry.error = observation.pose.position() - predicted_;
  accepted_.push_back(entry);
  while (accepted_.front().frame + static_cast<std::uint64_t>(config_.window_size) <= frame_)
    accepted_.pop_front();
  yaw_ = observation.pose.yaw;
  correlated_ = observation.correlated;
  camera_ = camera_bit(observation.camera);
  last_accepted_ = frame_times_.back();
  if (phase_ != Phase::running) return;
  judge_noise();
  judge_yaw();
}

void WindowFilter::judge_noise() {
  Covariance3 noise = Covariance3::Zero();
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();
  int errors = 0;
  for (const Accepted& entry : accepted_) {
    noise += entry.covariance;
    if (!entry.error) continue;
    moment += *entry.error * entry.error->transpose();
    ++errors;
  }
  noise /= static_cast<double>(accepted_.size());
  const Covariance3& newest = accepted_.back().covariance;
  const double gain = noise_gains_[std::min(accepted_since_calibration_, noise_gains_.size() - 1)];
  const double w = config_.window_size;
  const double weight = accepted_since_calibration_ == 0 ? 1.0 : 1.0 / w;  // of the newest detection in p
  const Eigen::Matrix2d mean = noise.topLeftCorner<2, 2>();
  const Eigen::Matrix2d left =
      weight * weight * newest.topLeftCorner<2, 2>() + (gain - weight * weight) * mean;

  Eigen::Matrix2d bias = Eigen::Matrix2d::Zero();
  // Of white noise alone, detection - p has the variance 1 + gain - 2 weight.
  if (errors > 0) bias = without_negative_variance(moment / errors - (1.0 + gain - 2.0 * weight) * mean);
  covariance_ = newest;  // of yaw
  covariance_.topLeftCorner<2, 2>() = left + bias;
  covariance_.topRightCorner<2, 1>() *= weight;
  covariance_.bottomLeftCorner<1, 2>() *= weight;
  // The offset is a difference of two independent positions, one of them smoothed, over W.
  offset_covariance_ = (1.0 + gain) / (w * w) * mean;
}

/// The slope of the line through the window's yaws, by least squares.
void WindowFilter::judge_yaw() {
  double mean_time = 0.0;
  double mean_yaw = 0.0;
  const Time origin = accepted_.front().captured;
  const auto n = static_cast<double>(accepted_.size());
  for (const Accepted& entry : accepted_) {
    mean_time += to_seconds(entry.captured - origin) / n;
    mean_yaw += entry.yaw / n;
  }
  double along = 0.0;
  double spread = 0.0;
  for (const Accepted& entry : accepted_) {
    const double time = to_seconds(entry.captured - origin) - mean_time;
    along += time * (entry.yaw - mean_yaw);
    spread += time * time;
  }
  yaw_rate_ = spread > 0.0 ? along / spread : 0.0;
}

double WindowFilter::frame_interval() const {
  return to_seconds(frame_times_.back() - frame_times_.front()) /
         static_cast<double>(frame_times_.size() - 1);
}

Covariance3 WindowFilter::covariance_at(Time at) const {
  const double since = to_seconds(at - last_accepted_);
  const double frames = since / frame_interval();
  const double walk = since * since * since / (3.0 * kVelocityMemory);
  const double speed_squared = offset_.squaredNorm() / (frame_interval() * frame_interval());
  Covariance3 out = covariance_;
  out.topLeftCorner<2, 2>() +=
      frames * frames * offset_covariance_ +
      walk * (speed_squared + kStartingSpeed * kStartingSpeed) * Eigen::Matrix2d::Identity();
  out(2, 2) += walk * (yaw_rate_ * yaw_rate_ + kStartingYawRate * kStartingYawRate);
  return out;
}

std::optional<Estimate> WindowFilter::predict(Time at) const {
  if (phase_ != Phase::running || at < frame_times_.back()) return std::nullopt;
  const Eigen::Vector2d velocity = offset_ / frame_interval();
  const Eigen::Vector2d position = predicted_ + velocity * to_seconds(at - frame_times_.back());
  Estimate out;
  out.at = at;
  out.pose = {position.x(), position.y(), wrap_angle(yaw_ + yaw_rate_ * to_seconds(at - last_accepted_))};
  out.velocity = {velocity.x(), velocity.y(), yaw_rate_};
  out.covariance = covariance_at(at) + correlated_;
  out.cameras = camera_;
  return out;
}

}  // namespace skylight
