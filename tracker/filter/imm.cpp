#include "tracker/filter/imm.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace skylight::motion {
namespace {

using Matrix63 = Eigen::Matrix<double, 6, 3>;

/// No model is ever ruled out: it must be able to come back within a frame or two.
constexpr double kLeastWeight = 1e-6;

void normalise(std::array<double, kModels>& weight) {
  double sum = 0.0;
  for (double& w : weight) {
    w = std::max(w, kLeastWeight);
    sum += w;
  }
  for (double& w : weight) w /= sum;
}

Matrix6 symmetric(const Matrix6& m) {
  return 0.5 * (m + m.transpose());
}

template <std::size_t... kIndex>
std::array<ModelStep, kModels> model_steps(const ModelBank& bank, double dt,
                                           std::index_sequence<kIndex...> /*indices*/) {
  return {ModelStep(bank.model[kIndex], dt)...};
}

/// The Gaussian with the mean and covariance of a weighted sum of Gaussians.
template <typename WeightOf>
Gaussian6 moments(const std::array<Gaussian6, kModels>& part, const WeightOf& weight_of) {
  Gaussian6 out;
  out.mean.setZero();
  out.cov.setZero();
  for (std::size_t i = 0; i < kModels; ++i) out.mean += weight_of(i) * part[i].mean;
  for (std::size_t i = 0; i < kModels; ++i) {
    const double w = weight_of(i);
    const Vector6 off = part[i].mean - out.mean;
    out.cov += w * part[i].cov;
    out.cov.noalias() += (w * off) * off.transpose();
  }
  return out;
}

Eigen::Vector3d difference(const Gaussian6& state, const LinearMeasurement& measured) {
  Eigen::Vector3d d = measured.value - state.mean.segment<3>(measured.first);
  if (measured.yaw_period > 0.0) d[2] = std::remainder(d[2], measured.yaw_period);
  return d;
}

/// log N(d; 0, S) and d^T S^-1 d.
struct Density {
  double log = 0.0;
  double distance2 = 0.0;
};
Density density(const Eigen::LLT<Eigen::Matrix3d>& s, const Eigen::Vector3d& d) {
  const Eigen::Vector3d white = s.matrixL().solve(d);
  const auto& l = s.matrixLLT();
  const double distance2 = white.squaredNorm();
  return {.log = -0.5 * distance2 - std::log(l(0, 0) * l(1, 1) * l(2, 2)) -
                 1.5 * std::log(2.0 * std::numbers::pi),
          .distance2 = distance2};
}

}  // namespace

BankStep::BankStep(const ModelBank& bank, double dt)
    : model_(model_steps(bank, dt, std::make_index_sequence<kModels>{})) {
  for (std::size_t i = 0; i < kModels; ++i) {
    const double leaves = 1.0 - std::exp(-bank.leave_rate[i] * dt);
    for (std::size_t j = 0; j < kModels; ++j)
      switch_[i][j] = i == j ? 1.0 - leaves : leaves * bank.share[i][j];
  }
}

BankStep::Mixed BankStep::mix(const Mixture& from) const {
  Mixed out;
  for (std::size_t j = 0; j < kModels; ++j) {
    double sum = 0.0;
    for (std::size_t i = 0; i < kModels; ++i) sum += switch_[i][j] * from.weight[i];
    out.start.weight[j] = sum;
    for (std::size_t i = 0; i < kModels; ++i) out.from[i][j] = switch_[i][j] * from.weight[i] / sum;
    out.start.part[j] = moments(from.part, [&](std::size_t i) { return out.from[i][j]; });
  }
  return out;
}

Mixture BankStep::predict(const Mixture& from) const {
  Mixed mixed = mix(from);
  for (std::size_t j = 0; j < kModels; ++j) mixed.start.part[j] = model_[j].predict(mixed.start.part[j]);
  return mixed.start;
}

int step_count(double dt) {
  return static_cast<int>(std::min<double>(std::ceil(dt / kLongestStep), kMostSteps));
}

Mixture predict(const ModelBank& bank, const Mixture& from, double dt) {
  if (!(dt > 0.0)) return from;
  const int steps = step_count(dt);
  const BankStep step(bank, dt / steps);
  Mixture out = step.predict(from);
  for (int i = 1; i < steps; ++i) out = step.predict(out);
  return out;
}

Innovation innovation(const Mixture& predicted, const LinearMeasurement& measured) {
  Innovation out{.distance2 = 1e300, .log_density = -1e300};
  std::array<double, kModels> logs{};
  double most = -1e300;
  for (std::size_t j = 0; j < kModels; ++j) {
    const Gaussian6& part = predicted.part[j];
    const Eigen::LLT<Eigen::Matrix3d> s(part.cov.block<3, 3>(measured.first, measured.first) +
                                        measured.noise);
    logs[j] = -1e300;
    if (s.info() != Eigen::Success) continue;
    const Density d = density(s, difference(part, measured));
    out.distance2 = std::min(out.distance2, d.distance2);
    logs[j] = d.log + std::log(predicted.weight[j]);
    most = std::max(most, logs[j]);
  }
  double sum = 0.0;
  for (const double l : logs) sum += std::exp(l - most);
  out.log_density = most + std::log(sum);
  return out;
}

bool correct(Mixture& mixture, const LinearMeasurement& measured) {
  Mixture out = mixture;
  std::array<double, kModels> logs{};
  double most = -1e300;
  for (std::size_t j = 0; j < kModels; ++j) {
    const Gaussian6& prior = mixture.part[j];
    const Eigen::LLT<Eigen::Matrix3d> s(prior.cov.block<3, 3>(measured.first, measured.first) +
                                        measured.noise);
    if (s.info() != Eigen::Success) return false;
    const Eigen::Vector3d d = difference(prior, measured);
    const Matrix63 ph = prior.cov.block<6, 3>(0, measured.first);
    const Matrix63 gain = s.solve(ph.transpose()).transpose();
    out.part[j].mean = prior.mean + gain * d;
    Matrix6 keep = Matrix6::Identity();
    keep.block<6, 3>(0, measured.first) -= gain;
    const Matrix6 half = keep * prior.cov;
    out.part[j].cov = symmetric(half * keep.transpose() + gain * measured.noise * gain.transpose());
    logs[j] = density(s, d).log;
    most = std::max(most, logs[j]);
  }
  for (std::size_t j = 0; j < kModels; ++j) out.weight[j] = mixture.weight[j] * std::exp(logs[j] - most);
  double sum = 0.0;
  for (const double w : out.weight) sum += w;
  if (!(sum > 0.0) || !std::isfinite(sum)) return false;
  for (double& w : out.weight) w /= sum;
  normalise(out.weight);
  mixture = out;
  return true;
}

Matrix6 turning(double angle) {
  Matrix6 t = Matrix6::Identity();
  t(kU, kU) = t(kS, kS) = std::cos(angle);
  t(kU, kS) = std::sin(angle);
  t(kS, kU) = -std::sin(angle);
  return t;
}

void turn(Mixture& mixture, double angle) {
  const Matrix6 t = turning(angle);
  for (Gaussian6& part : mixture.part) {
    part.mean = t * part.mean;
    part.mean[kYaw] += angle;
    part.cov = (t * part.cov * t.transpose()).eval();
  }
}

Gaussian6 collapse(const Mixture& mixture) {
  return moments(mixture.part, [&](std::size_t i) { return mixture.weight[i]; });
}

}  // namespace skylight::motion
