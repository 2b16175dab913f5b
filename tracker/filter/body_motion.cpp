#include "tracker/filter/body_motion.hpp"

#include <cmath>

namespace skylight::motion {

Arc arc(double theta) {
  // Below this the series' first neglected terms are under 1e-16; above, cancellation costs under 1e-13.
  constexpr double kSmall = 0.02;
  const double t2 = theta * theta;
  if (std::abs(theta) < kSmall) {
    return {.a = 1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0)),
            .b = theta / 2.0 * (1.0 - t2 / 12.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0))),
            .da = -theta / 3.0 * (1.0 - t2 / 10.0 * (1.0 - t2 / 28.0)),
            .db = 0.5 - t2 / 8.0 * (1.0 - t2 / 18.0 * (1.0 - t2 / 40.0))};
  }
  const double sine = std::sin(theta);
  const double half = std::sin(theta / 2.0);
  const double one_minus_cos = 2.0 * half * half;
  return {.a = sine / theta,
          .b = one_minus_cos / theta,
          .da = (theta * (1.0 - one_minus_cos) - sine) / t2,
          .db = (theta * sine - one_minus_cos) / t2};
}

VelocityStep velocity_step(const VelocityNoise& noise, double dt) {
  const double q = noise.density;
  const double x = noise.pull * dt;
  if (x < 0.03) {  // the pull as a series: exactly the Wiener process at 0
    return {.keep = std::exp(-x),
            .mean_keep = 1.0 - x / 2.0 + x * x / 6.0 - x * x * x / 24.0,
            .vv = q * dt * (1.0 - x + 2.0 / 3.0 * x * x),
            .pv = q * dt * dt / 2.0 * (1.0 - x + 7.0 / 12.0 * x * x),
            .pp = q * dt * dt * dt / 3.0 * (1.0 - 3.0 / 4.0 * x + 7.0 / 20.0 * x * x)};
  }
  const double e = std::exp(-x);
  const double variance = q / (2.0 * noise.pull);  // in the long run
  const double tau = 1.0 / noise.pull;
  return {.keep = e,
          .mean_keep = (1.0 - e) / x,
          .vv = variance * (1.0 - e * e),
          .pv = variance * tau * (1.0 - e) * (1.0 - e),
          .pp = variance * tau * tau * (2.0 * x - 3.0 + 4.0 * e - e * e)};
}

namespace {

VelocityStep standing_step(double sigma, double dt) {
  return {.keep = 0.0,
          .mean_keep = 0.0,
          .vv = sigma * sigma,
          .pv = 0.5 * sigma * sigma * dt,
          .pp = sigma * sigma * dt * dt};
}

}  // namespace

ModelStep::ModelStep(const MotionModel& model, double dt)
    : dt_(dt), place_walk_(model.place_walk * dt), yaw_walk_(model.yaw_walk * dt) {
  if (model.stands) {
    forward_ = sideways_ = standing_step(model.stand_speed, dt);
    turning_ = standing_step(model.stand_yaw_rate, dt);
  } else {
    forward_ = velocity_step(model.forward, dt);
    sideways_ = velocity_step(model.sideways, dt);
    turning_ = velocity_step(model.turning, dt);
  }
}

Vector6 ModelStep::move(const Vector6& state) const {
  const double theta = state[kW] * turning_.mean_keep * dt_;
  const Arc k = arc(theta);
  const double along = state[kU] * forward_.mean_keep * dt_;
  const double left = state[kS] * sideways_.mean_keep * dt_;
  const double c = std::cos(state[kYaw]);
  const double s = std::sin(state[kYaw]);
  const double bx = k.a * along - k.b * left;  // in the frame at the start
  const double by = k.b * along + k.a * left;
  Vector6 out;
  out << state[kX] + c * bx - s * by, state[kY] + s * bx + c * by, state[kYaw] + theta,
      state[kU] * forward_.keep, state[kS] * sideways_.keep, state[kW] * turning_.keep;
  return out;
}

Matrix6 ModelStep::jacobian(const Vector6& state) const {
  const double per_w = turning_.mean_keep * dt_;
  const Arc k = arc(state[kW] * per_w);
  const double per_u = forward_.mean_keep * dt_;
  const double per_s = sideways_.mean_keep * dt_;
  const double along = state[kU] * per_u;
  const double left = state[kS] * per_s;
  const double c = std::cos(state[kYaw]);
  const double s = std::sin(state[kYaw]);
  const double bx = k.a * along - k.b * left;
  const double by = k.b * along + k.a * left;
  const double dbx = (k.da * along - k.db * left) * per_w;  // by w
  const double dby = (k.db * along + k.da * left) * per_w;
  Matrix6 f = Matrix6::Zero();
  f(kX, kX) = f(kY, kY) = f(kYaw, kYaw) = 1.0;
  f(kX, kYaw) = -s * bx - c * by;
  f(kY, kYaw) = c * bx - s * by;
  f(kX, kU) = (c * k.a - s * k.b) * per_u;
  f(kY, kU) = (s * k.a + c * k.b) * per_u;
  f(kX, kS) = (-c * k.b - s * k.a) * per_s;
  f(kY, kS) = (-s * k.b + c * k.a) * per_s;
  f(kX, kW) = c * dbx - s * dby;
  f(kY, kW) = s * dbx + c * dby;
  f(kYaw, kW) = per_w;
  f(kU, kU) = forward_.keep;
  f(kS, kS) = sideways_.keep;
  f(kW, kW) = turning_.keep;
  return f;
}

Matrix6 ModelStep::noise(const Vector6& state) const {
  // The heading of the chord stands for the heading along the step.
  const double mid = state[kYaw] + 0.5 * state[kW] * turning_.mean_keep * dt_;
  const double c = std::cos(mid);
  const double s = std::sin(mid);
  Matrix6 q = Matrix6::Zero();
  const double ff = forward_.pp;
  const double ll = sideways_.pp;
  q(kX, kX) = c * c * ff + s * s * ll + place_walk_;
  q(kY, kY) = s * s * ff + c * c * ll + place_walk_;
  q(kX, kY) = c * s * (ff - ll);
  q(kX, kU) = c * forward_.pv;
  q(kY, kU) = s * forward_.pv;
  q(kX, kS) = -s * sideways_.pv;
  q(kY, kS) = c * sideways_.pv;
  q(kU, kU) = forward_.vv;
  q(kS, kS) = sideways_.vv;
  // Noise of the yaw rate turns the path: a kick r before the end swings the place by v r^2 / 2 to the side.
  const double vx = -s * state[kU] - c * state[kS];
  const double vy = c * state[kU] - s * state[kS];
  const double swing2 = turning_.pp * dt_ * dt_ * 3.0 / 20.0;  // integral of r^4 / 4
  const double swing_yaw = turning_.pp * dt_ * 3.0 / 8.0;      // of r^3 / 2
  const double swing_rate = turning_.pv * dt_ / 3.0;           // of r^2 / 2
  q(kX, kX) += vx * vx * swing2;
  q(kY, kY) += vy * vy * swing2;
  q(kX, kY) += vx * vy * swing2;
  q(kX, kYaw) = vx * swing_yaw;
  q(kY, kYaw) = vy * swing_yaw;
  q(kX, kW) = vx * swing_rate;
  q(kY, kW) = vy * swing_rate;
  q(kYaw, kYaw) = turning_.pp + yaw_walk_;
  q(kYaw, kW) = turning_.pv;
  q(kW, kW) = turning_.vv;
  for (int row = 1; row < 6; ++row) {
    for (int col = 0; col < row; ++col) q(row, col) = q(col, row);
  }
  return q;
}

Gaussian6 ModelStep::predict(const Gaussian6& from) const {
  Matrix6 unused;
  return predict(from, unused);
}

Gaussian6 ModelStep::predict(const Gaussian6& from, Matrix6& jacobian_out) const {
  jacobian_out = jacobian(from.mean);
  Gaussian6 out;
  out.mean = move(from.mean);
  const Matrix6 half = jacobian_out * from.cov;
  out.cov.noalias() = half * jacobian_out.transpose();
  out.cov += noise(from.mean);
  out.cov = 0.5 * (out.cov + out.cov.transpose()).eval();
  return out;
}

}  // namespace skylight::motion
