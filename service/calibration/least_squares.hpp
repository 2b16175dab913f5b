// Levenberg and Marquardt's least squares over any state that can be moved by a small step.
//
// Nielsen, "Damping parameter in Marquardt's method" (1999), sections 2 and 3: the step solves
// (H + mu diag H) step = -g; mu falls where the quadratic model foretold the gain, and grows where it did
// not.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace skylight::calibration {

/// Cost 1/2 sum r^T W r, its gradient and Gauss and Newton's Hessian, in the state's tangent space.
struct Normal {
  double cost = 0.0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;

  explicit Normal(Eigen::Index size)
      : gradient(Eigen::VectorXd::Zero(size)), hessian(Eigen::MatrixXd::Zero(size, size)) {}

  /// A parameter that is not moved.
  void hold(Eigen::Index parameter) {
    gradient[parameter] = 0.0;
    hessian.row(parameter).setZero();
    hessian.col(parameter).setZero();
    hessian(parameter, parameter) = 1.0;
  }
};

struct LeastSquaresOptions {
  int most_steps = 100;
  double smallest_gain = 1e-12;  ///< share of the cost; less is the end
};

/// Improves `state`. `normal(state)` is std::optional<Normal>, none where the model does not hold there (such
/// a step is not taken); `moved(state, step)` is the state so much further. False where the model does not
/// hold at the start.
template <class State, class NormalAt, class Moved>
bool minimise(State& state, const NormalAt& normal, const Moved& moved,
              const LeastSquaresOptions& options = {}) {
  std::optional<Normal> at = normal(state);
  if (!at || !std::isfinite(at->cost)) return false;
  double mu = 1e-4;
  double growth = 2.0;
  for (int i = 0; i < options.most_steps; ++i) {
    Eigen::MatrixXd damped = at->hessian;
    damped.diagonal() *= 1.0 + mu;
    const Eigen::VectorXd step = damped.ldlt().solve(-at->gradient);
    if (!step.allFinite()) return true;
    const State there = moved(state, step);
    std::optional<Normal> next = normal(there);
    const double foretold = -(at->gradient.dot(step) + 0.5 * step.dot(at->hessian * step));
    const double gain = next && std::isfinite(next->cost) ? at->cost - next->cost : -1.0;
    if (gain > 0.0) {
      const double agreement = foretold > 0.0 ? gain / foretold : 1.0;
      const bool done = gain <= options.smallest_gain * at->cost;
      state = there;
      at = std::move(next);
      mu *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * agreement - 1.0, 3.0));
      growth = 2.0;
      if (done) return true;
    } else {
      if (foretold <= options.smallest_gain * at->cost || mu > 1e12) return true;
      mu *= growth;
      growth *= 2.0;
    }
  }
  return true;
}

/// The inverse of a Hessian: the covariance of its parameters where W is the inverse of the residuals'. None
/// where some direction of the parameters is not determined. Parameters count by their own scale.
inline std::optional<Eigen::MatrixXd> inverse_of(const Eigen::MatrixXd& hessian) {
  if (!hessian.allFinite() || !(hessian.diagonal().minCoeff() > 0.0)) return std::nullopt;
  const Eigen::VectorXd scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * hessian * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scaled);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-14)) return std::nullopt;
  Eigen::MatrixXd inverse = ldlt.solve(Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols()));
  inverse = scale.asDiagonal() * (0.5 * (inverse + inverse.transpose())).eval() * scale.asDiagonal();
  if (!inverse.allFinite()) return std::nullopt;
  return inverse;
}

}  // namespace skylight::calibration
