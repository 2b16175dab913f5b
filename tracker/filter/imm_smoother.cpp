#include "tracker/filter/imm_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

namespace skylight::motion {
namespace {

/// Looking back, a pair of models that is this much less likely than the likeliest changes nothing.
constexpr double kNegligible = 1e-4;

/// N(mean, L L^T) times an information: what both come to. M = I + L^T precision L is never near singular.
struct Fusion {
  Fusion(const Matrix6& lower, const Matrix6& precision)
      : lower_(lower), llt_(Matrix6::Identity() + lower.transpose() * precision * lower) {}
  /// log of the integral; the residual is info - precision (mean - origin), `constant` the exponent at mean.
  double log_integral(const Vector6& residual, double constant) const {
    const Vector6 white = llt_.matrixL().solve(lower_.transpose() * residual);
    return constant + 0.5 * white.squaredNorm() - llt_.matrixLLT().diagonal().array().log().sum();
  }
  Matrix6 covariance() const { return lower_ * llt_.solve(lower_.transpose()); }

 private:
  const Matrix6& lower_;
  Eigen::LLT<Matrix6> llt_;
};

Matrix6 lower(const Matrix6& covariance) {
  return Eigen::LLT<Matrix6>(covariance).matrixL();
}

Vector6 residual(const Information& part, const Vector6& off) {
  return part.info - part.precision * off;
}

/// The exponent at origin + off.
double exponent(const Information& part, const Vector6& off) {
  return part.log + part.info.dot(off) - 0.5 * off.dot(part.precision * off);
}

void move_origin(Future& future, const Vector6& to) {
  const Vector6 off = to - future.origin;
  for (Information& part : future.part) {
    part.log = exponent(part, off);
    part.info = residual(part, off);
  }
  future.origin = to;
}

/// `part` as told before noise of covariance l l^T came in.
Information before_noise(const Matrix6& l, const Information& part) {
  const Eigen::LLT<Matrix6> llt(Matrix6::Identity() + l.transpose() * part.precision * l);
  const Matrix6 white = llt.matrixL().solve(l.transpose() * part.precision);
  const Vector6 white_info = llt.matrixL().solve(l.transpose() * part.info);
  Information out;
  out.precision = part.precision - white.transpose() * white;
  out.info = part.info - white.transpose() * white_info;
  out.log = part.log + 0.5 * white_info.squaredNorm() - llt.matrixLLT().diagonal().array().log().sum();
  return out;
}

/// Through one model: `part` about the predicted mean, the result about the mean it was predicted from.
Information through(const ModelStep& model, const Vector6& from, const Information& part) {
  const Matrix6 f = model.jacobian(from);
  Information out = before_noise(lower(model.noise(from)), part);
  out.precision = (f.transpose() * out.precision * f).eval();
  out.precision = 0.5 * (out.precision + out.precision.transpose()).eval();
  out.info = (f.transpose() * out.info).eval();
  return out;
}

std::array<double, kModels> shares(const std::array<double, kModels>& logs, double& log_sum) {
  const double most = *std::max_element(logs.begin(), logs.end());
  std::array<double, kModels> out{};
  double sum = 0.0;
  for (std::size_t i = 0; i < kModels; ++i) sum += out[i] = std::exp(logs[i] - most);
  for (double& w : out) w /= sum;
  log_sum = most + std::log(sum);
  return out;
}

}  // namespace

Future no_future(const Mixture& at) {
  Future out;
  out.origin = collapse(at).mean;
  return out;
}

void add(Future& future, const LinearMeasurement& measured, const Vector6& near) {
  move_origin(future, near);
  Eigen::Vector3d off = measured.value - near.segment<3>(measured.first);
  if (measured.yaw_period > 0.0) off[2] = std::remainder(off[2], measured.yaw_period);
  const Eigen::Matrix3d weight =
      Eigen::LLT<Eigen::Matrix3d>(measured.noise).solve(Eigen::Matrix3d::Identity());
  for (Information& part : future.part) {
    part.precision.block<3, 3>(measured.first, measured.first) += weight;
    part.info.segment<3>(measured.first) += weight * off;
  }
}

Future BankStep::back(const Mixture& filtered, const Future& next) const {
  Future out;
  out.origin = collapse(filtered).mean;
  std::array<Information, kModels> before;
  for (std::size_t j = 0; j < kModels; ++j) {
    const Vector6 off = model_[j].move(out.origin) - next.origin;
    const Information about{.precision = next.part[j].precision,
                            .info = residual(next.part[j], off),
                            .log = exponent(next.part[j], off)};
    before[j] = through(model_[j], out.origin, about);
  }
  for (std::size_t i = 0; i < kModels; ++i) {
    const Matrix6 l = lower(filtered.part[i].cov);
    const Vector6 off = filtered.part[i].mean - out.origin;
    std::array<double, kModels> logs{};
    for (std::size_t j = 0; j < kModels; ++j) {
      logs[j] =
          std::log(std::max(switch_[i][j], 1e-12)) +
          Fusion(l, before[j].precision).log_integral(residual(before[j], off), exponent(before[j], off));
    }
    double log_sum = 0.0;
    const std::array<double, kModels> share = shares(logs, log_sum);
    Information& merged = out.part[i];
    for (std::size_t j = 0; j < kModels; ++j) {
      if (share[j] < kNegligible) continue;
      merged.precision += share[j] * before[j].precision;
      merged.info += share[j] * before[j].info;
    }
    merged.log = 0.0;
    merged.log =
        log_sum - Fusion(l, merged.precision).log_integral(residual(merged, off), exponent(merged, off));
  }
  return out;
}

Future back(const ModelBank& bank, const Mixture& filtered, double dt, const Future& next) {
  const auto steps = static_cast<std::size_t>(step_count(dt));
  const BankStep step(bank, dt / static_cast<double>(steps));
  if (steps == 1) return step.back(filtered, next);
  std::vector<Mixture> way(steps);  // there once more, then back
  way[0] = filtered;
  for (std::size_t i = 1; i < steps; ++i) way[i] = step.predict(way[i - 1]);
  Future out = next;
  for (std::size_t i = steps; i-- > 0;) out = step.back(way[i], out);
  return out;
}

void turn_back(Future& future, double angle) {
  const Matrix6 t = turning(angle);
  for (Information& part : future.part) {
    part.precision = (t.transpose() * part.precision * t).eval();
    part.info = (t.transpose() * part.info).eval();
  }
  future.origin = t.transpose() * future.origin;
  future.origin[kYaw] -= angle;
}

Gaussian6 combine(const Mixture& filtered, const Future& future) {
  Mixture out;
  std::array<double, kModels> logs{};
  for (std::size_t i = 0; i < kModels; ++i) {
    const Gaussian6& past = filtered.part[i];
    const Matrix6 l = lower(past.cov);
    const Vector6 off = past.mean - future.origin;
    const Fusion fusion(l, future.part[i].precision);
    const Vector6 r = residual(future.part[i], off);
    logs[i] = std::log(filtered.weight[i]) + fusion.log_integral(r, exponent(future.part[i], off));
    out.part[i].cov = fusion.covariance();
    out.part[i].mean = past.mean + out.part[i].cov * r;
  }
  double unused = 0.0;
  out.weight = shares(logs, unused);
  return collapse(out);
}

}  // namespace skylight::motion
