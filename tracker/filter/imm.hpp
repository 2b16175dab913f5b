// Several ways of moving at once: the interacting multiple models filter (H. A. P. Blom, Y. Bar-Shalom, "The
// interacting multiple model algorithm for systems with Markovian switching coefficients", IEEE Trans.
// Automatic Control 33(8), 1988) over the models of body_motion.hpp.
//
//   mix      the probability that model j rules next, c_j = sum_i p_ij mu_i; each model starts from the
//            mixture that would lead to it, weights mu_i|j = p_ij mu_i / c_j (their Eqs. 3.5 to 3.7)
//   predict  each by itself, extended Kalman
//   correct  each by itself; mu_j grows with the density that it had given to what was measured
//
// The switching is a Markov chain in continuous time, so that the rate of the frames changes nothing in
// principle: p_ij(t) = share_ij (1 - exp(-rate_i t)) for i != j.
//
// Yaws in here are continuous (they count turns), never wrapped: only a measured yaw is brought near.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "tracker/filter/body_motion.hpp"

namespace skylight::motion {

inline constexpr std::size_t kModels = 5;

/// A bank of models and how they follow each other.
struct ModelBank {
  std::array<MotionModel, kModels> model;
  /// 1/s, at which model i is left.
  std::array<double, kModels> leave_rate{};
  /// share[i][j] of what leaves i goes to j; rows sum to 1, share[i][i] = 0.
  std::array<std::array<double, kModels>, kModels> share{};
};

/// Longest step, s: longer times are taken in equal parts, because models may switch within.
inline constexpr double kLongestStep = 0.11;
/// ... but in no more parts than these, which then are longer.
inline constexpr int kMostSteps = 64;

/// The mixture: one Gaussian per model with its probability.
struct Mixture {
  std::array<Gaussian6, kModels> part;
  std::array<double, kModels> weight{};  ///< sums to 1
};

/// A measurement that is linear in the state: three components beginning at `first` (kX: a pose, kU: a body
/// velocity).
struct LinearMeasurement {
  int first = kX;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Identity();  ///< positive definite
  double yaw_period = 0.0;  ///< of component 2, rad: measured modulo this; 0: as it is
};

struct Future;

/// The models over one fixed dt: exponentials once, used for every robot and step of that length.
class BankStep {
 public:
  BankStep(const ModelBank& bank, double dt);
  Mixture predict(const Mixture& from) const;
  /// What comes later told to what went before: imm_smoother.hpp.
  Future back(const Mixture& filtered, const Future& next) const;

 private:
  struct Mixed {
    Mixture start;
    std::array<std::array<double, kModels>, kModels> from{};  ///< [i][j] = mu_i|j
  };
  Mixed mix(const Mixture& from) const;

  std::array<ModelStep, kModels> model_;
  std::array<std::array<double, kModels>, kModels> switch_{};  ///< p_ij
};

/// Carried on by dt >= 0, in steps of at most kLongestStep.
Mixture predict(const ModelBank& bank, const Mixture& from, double dt);
/// Into how many steps a time > 0 is parted.
int step_count(double dt);

/// Of a measurement, before it is used.
struct Innovation {
  /// Smallest squared Mahalanobis distance over the models: the model that is readiest for it judges.
  double distance2 = 0.0;
  /// log of the mixture's density at the measurement.
  double log_density = 0.0;
};
Innovation innovation(const Mixture& predicted, const LinearMeasurement& measured);

/// In place; the Joseph form, so that rounding leaves the covariances positive. False, and nothing done,
/// where an innovation covariance cannot be inverted.
bool correct(Mixture& mixture, const LinearMeasurement& measured);

/// d (turned state) / d state for a robot that is called turned by `angle`: its velocity in `map` stays.
Matrix6 turning(double angle);
/// In place; the yaw grows by `angle`.
void turn(Mixture& mixture, double angle);

/// Mean and covariance of the mixture.
Gaussian6 collapse(const Mixture& mixture);

}  // namespace skylight::motion
