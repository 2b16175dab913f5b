// What comes later, told to what went before: a two-filter smoother over interacting models.
//
// For each model i at k, beta_i(x) is the likelihood of all that was measured after k if the state is x and i
// rules, held as the exponent of a quadratic (information form), which may know nothing of some directions:
//
//   beta_i(x) = exp(log + info . (x - o) - (x - o)^T precision (x - o) / 2),   o a common origin
//
//   measured at k+1   precision += H^T R^-1 H, info += H^T R^-1 z
//   back through j    precision- = F^T (precision^-1 + Q)^-1 F, and so on (D. C. Fraser, J. E. Potter, "The
//                     optimum linear smoother as a combination of two optimum linear filters", IEEE Trans.
//                     Automatic Control 14(4), 1969; F from body_motion.hpp, at the filtered mean)
//   mix               beta_i = sum_j p_ij beta-_j (R. E. Helmick, W. D. Blair, S. A. Hoffman, "Fixed-interval
//                     smoothing for Markovian switching systems", IEEE Trans. Information Theory 41(6),
//                     1995), kept as one quadratic: the mean of the quadratics, weighted by
//                     p_ij * integral of (filtered_i beta-_j), with the sum's integral
//   smoothed          sum_i mu_i filtered_i beta_i
//
// Rauch-Tung-Striebel over pairs of models (Kim 1994; Nadarajah et al. 2012) was tried first. It combines the
// past of model i with a smoothed state that already contains the past of all, and counts it twice: the
// longer the lag the worse; at 3 s it was worse than the filter.
#pragma once

#include "tracker/filter/imm.hpp"

namespace skylight::motion {

struct Information {
  Matrix6 precision = Matrix6::Zero();  ///< symmetric, positive semidefinite
  Vector6 info = Vector6::Zero();
  double log = 0.0;
};

/// beta_i for every model.
struct Future {
  Vector6 origin = Vector6::Zero();
  std::array<Information, kModels> part;
};

/// Nothing measured later.
Future no_future(const Mixture& at);

/// Adds what was measured at the same instant, `near` being the filtered mean (for the turn of a yaw).
void add(Future& future, const LinearMeasurement& measured, const Vector6& near);

/// From k+1 (what was measured there added) back to k by dt > 0, `filtered` being the mixture at k.
Future back(const ModelBank& bank, const Mixture& filtered, double dt, const Future& next);

/// The future as told of a robot that is called turned by -angle: the inverse of turning the state by angle.
void turn_back(Future& future, double angle);

/// Mean and covariance of the state, past and future used.
Gaussian6 combine(const Mixture& filtered, const Future& future);

}  // namespace skylight::motion
