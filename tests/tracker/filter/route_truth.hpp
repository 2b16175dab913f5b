// Routes of a robot with two driven wheels, and what a detector sees of it: for judging filters. Its own code
// throughout: no step, noise or angle of the filters is used, so that none of their errors can cancel out.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "tracker/types.hpp"

namespace skylight::test {

/// Repeatable on every machine: the engine is given by the standard, the shaping is ours.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed * 0x9E3779B97F4A7C15ull + 1) {}
  double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; }  // in (0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {  // Box and Muller 1958
    return std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

struct TruthState {
  Pose2 pose;
  double u = 0.0;  ///< m/s forward
  double s = 0.0;  ///< m/s to the left
  double w = 0.0;  ///< rad/s
};

inline constexpr double kTruthRate = 300.0;  // Hz; a multiple of the frame rates
inline constexpr double kMaxAccel = 2.5;     // m/s^2
inline constexpr double kMaxYawAccel = 3.2;  // rad/s^2

enum class RouteKind : std::uint8_t { line, circle_2m, circle_1m25, chaotic };

/// A route in steps of 1 / kTruthRate s. Wheels are not perfect: speed and turn waver by 2 %, and the robot
/// slips to the side by a hundredth of its speed.
class Route {
 public:
  Route(RouteKind kind, double seconds, std::uint64_t seed) : random_(seed) {
    now_.pose = {random_.uniform(-1.0, 1.0), random_.uniform(-1.0, 1.0), random_.uniform(-3.1, 3.1)};
    const auto steps = static_cast<std::size_t>(seconds * kTruthRate);
    double next_change = 0.0;
    for (std::size_t i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / kTruthRate;
      if (t >= next_change) next_change = t + command(kind);
      states_.push_back(now_);
      advance();
    }
  }
  const TruthState& at(double t) const {
    const auto i = static_cast<std::size_t>(std::llround(t * kTruthRate));
    return states_.at(std::min(i, states_.size() - 1));
  }
  double seconds() const { return static_cast<double>(states_.size() - 1) / kTruthRate; }

 private:
  /// Sets what is asked of the wheels; for how long.
  double command(RouteKind kind) {
    constexpr double kCruise = 0.22;
    if (kind != RouteKind::chaotic) {
      asked_u_ = started_ ? kCruise : 0.0;
      const double radius = kind == RouteKind::circle_2m ? 2.0 : 1.25;
      asked_w_ = started_ && kind != RouteKind::line ? kCruise / radius : 0.0;
      const double wait = started_ ? 1e9 : 1.0;
      started_ = true;
      return wait;
    }
    asked_u_ = random_.uniform() < 0.15 ? 0.0 : random_.uniform(0.05, 0.26);
    asked_w_ = random_.uniform() < 0.25 ? 0.0 : random_.uniform(-1.0, 1.0);
    if (asked_u_ == 0.0 && random_.uniform() < 0.7) asked_w_ = 0.0;
    return random_.uniform(1.0, 4.0);  // 24 changes a minute
  }
  static double toward(double now, double asked, double most) {
    return now + std::clamp(asked - now, -most, most);
  }
  void advance() {
    constexpr double kStep = 1.0 / kTruthRate;
    constexpr double kWaver = 0.02;
    constexpr double kWaverTime = 0.4;
    constexpr double kSlip = 0.01;
    u_ = toward(u_, asked_u_, kMaxAccel * kStep);
    w_ = toward(w_, asked_w_, kMaxYawAccel * kStep);
    const double keep = std::exp(-kStep / kWaverTime);
    const double kick = kWaver * std::sqrt(1.0 - keep * keep);
    waver_u_ = keep * waver_u_ + kick * random_.normal();
    waver_w_ = keep * waver_w_ + kick * random_.normal();
    slip_ = keep * slip_ + std::sqrt(1.0 - keep * keep) * random_.normal();
    now_.u = u_ * (1.0 + waver_u_);
    now_.s = kSlip * slip_ * u_;
    now_.w = w_ * (1.0 + waver_w_) + 0.1 * u_ * waver_w_;
    // The middle of the step stands for it: third order in a step of 3 ms.
    const double mid = now_.pose.yaw + 0.5 * now_.w * kStep;
    now_.pose.x += kStep * (now_.u * std::cos(mid) - now_.s * std::sin(mid));
    now_.pose.y += kStep * (now_.u * std::sin(mid) + now_.s * std::cos(mid));
    now_.pose.yaw += now_.w * kStep;
    now_.pose.yaw = std::atan2(std::sin(now_.pose.yaw), std::cos(now_.pose.yaw));
  }

  Random random_;
  TruthState now_;
  std::vector<TruthState> states_;
  double asked_u_ = 0.0, asked_w_ = 0.0, u_ = 0.0, w_ = 0.0, waver_u_ = 0.0, waver_w_ = 0.0, slip_ = 0.0;
  bool started_ = false;
};

/// A detector: white noise, frames without a detection, detections from anywhere in the room.
struct Detector {
  double sigma_m = 1e-3;  ///< per axis
  double sigma_rad = 3e-3;
  double misses = 0.0;    ///< share of frames
  double outliers = 0.0;  ///< share of detections
  double claimed = 1.0;   ///< claimed sigma over true sigma
};
inline constexpr double kDegree = std::numbers::pi / 180.0;
inline constexpr Detector kFine{.sigma_m = 5e-5, .sigma_rad = 0.01 * kDegree};
inline constexpr Detector kMiddle{.sigma_m = 1e-3, .sigma_rad = 0.2 * kDegree};
/// A mean distance of 0.1 m: sigma = 0.1 / sqrt(pi / 2) per axis.
inline constexpr Detector kCoarse{.sigma_m = 0.0797885, .sigma_rad = 10.0 * kDegree, .misses = 0.2};
inline constexpr Detector kPaper{
    .sigma_m = 0.0797885, .sigma_rad = 10.0 * kDegree, .misses = 0.2, .outliers = 0.05};

inline const Time kStart{std::chrono::seconds(1'700'000'000)};
inline Time instant(double t) {
  return kStart + from_seconds(t);
}

inline std::optional<Observation> detect(const Detector& detector, const Pose2& truth, double t,
                                         Random& random) {
  const double dice = random.uniform();
  const double kind = random.uniform();
  Observation out;
  out.captured = instant(t);
  out.pose = {truth.x + detector.sigma_m * random.normal(), truth.y + detector.sigma_m * random.normal(),
              truth.yaw + detector.sigma_rad * random.normal()};
  const Pose2 anywhere{random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0),
                       random.uniform(-std::numbers::pi, std::numbers::pi)};
  if (kind < detector.outliers) out.pose = anywhere;
  const double m = detector.sigma_m * detector.claimed;
  const double rad = detector.sigma_rad * detector.claimed;
  out.covariance = Eigen::Vector3d(m * m, m * m, rad * rad).asDiagonal();
  if (dice < detector.misses) return std::nullopt;
  return out;
}

inline double place_error(const Pose2& a, const Pose2& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}
inline double heading_error(const Pose2& a, const Pose2& b) {
  return std::abs(std::remainder(a.yaw - b.yaw, 2.0 * std::numbers::pi));
}
/// e^T P^-1 e of (x, y, yaw).
inline double nees(const Estimate& e, const Pose2& truth) {
  const Eigen::Vector3d d(e.pose.x - truth.x, e.pose.y - truth.y,
                          std::remainder(e.pose.yaw - truth.yaw, 2.0 * std::numbers::pi));
  return d.dot(e.covariance.inverse() * d);
}
/// The same of (x, y): below 5.991 inside the 95 % ellipse.
inline double nees_place(const Estimate& e, const Pose2& truth) {
  const Eigen::Vector2d d(e.pose.x - truth.x, e.pose.y - truth.y);
  return d.dot(e.covariance.topLeftCorner<2, 2>().inverse() * d);
}

}  // namespace skylight::test
