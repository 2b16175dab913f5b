// Several ways of moving at once: the interacting multiple models filter (H. A. P. Blom, Y. Bar-Shalom, "The
// interacting multiple model algorithm for systems with Markovian switching coefficients", IEEE Trans.
// Automatic Control 33(8), 1988) over the models of body_motion.hpp, and its smoother.
//
//   mix      the probability that model j rules next, c_j = sum_i p_ij mu_i; each model starts from the
//            mixture that would lead to it, weights mu_i|j = p_ij mu_i / c_j (their Eqs. 3.5 to 3.7)
//   predict  each by itself, extended Kalman
//   correct  each by itself; mu_j grows with the density that it had given to what was measured
//
// The switching is a Markov chain in continuous time, so that the rate of the frames changes nothing in
// principle: p_ij(t) = share_ij (1 - exp(-rate_i t)) for i != j.
//
// smooth_back is the step from k+1 to k of a Rauch-Tung-Striebel smoother per model, over the pairs that the
// mixing joined (N. Nadarajah, R. Tharmarasa, M. McDonald, T. Kirubarajan, "IMM forward filtering and
// backward smoothing for maneuvering target tracking", IEEE Trans. AES 48(3), 2012, with one Gaussian per
// model at k+1): from the mixed start x0_j of model j,
//   G_j = P0_j F_j^T (P-_j)^-1,   x^s_j = x0_j + G_j (x^s_j(k+1) - x-_j),   P^s_j alike,
// and P(i at k | all) = sum_j P(j at k+1 | all) mu_i|j.
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

/// The models over one fixed dt: exponentials once, used for every robot and step of that length.
class BankStep {
 public:
  BankStep(const ModelBank& bank, double dt);
  Mixture predict(const Mixture& from) const;
  /// The smoothed mixture at k from the filtered one at k and the smoothed one at k+1.
  Mixture smooth_back(const Mixture& filtered, const Mixture& smoothed_next) const;

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
Mixture smooth_back(const ModelBank& bank, const Mixture& filtered, double dt, const Mixture& smoothed_next);

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

/// Mean and covariance of the mixture.
Gaussian6 collapse(const Mixture& mixture);

}  // namespace skylight::motion
