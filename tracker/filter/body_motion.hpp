// How a robot on a floor moves between two instants: state, transition, its Jacobian and process noise.
//
// State (x, y, yaw, u, s, w): place in `map` (m, rad), and the velocity in the robot's own frame: forward u,
// to the left s (m/s), yaw rate w (rad/s). With u, s, w constant over a time t the path is an arc, and the
// step is exact, not an Euler step: the exponential map of SE(2), with theta = w t
//
//   (x, y) += R(yaw) t [ a(theta)  -b(theta) ] (u, s)     a = sin(theta) / theta
//                      [ b(theta)   a(theta) ]            b = (1 - cos(theta)) / theta
//   yaw    += theta
//
// (X. R. Li, V. P. Jilkov, "Survey of maneuvering target tracking, part I: dynamic models", IEEE Trans. AES
// 39(4), 2003, section V, the coordinated turn; J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for
// state estimation in robotics", arXiv 1812.01537, Eqs. 156 to 158.) Near theta = 0 the series stand for a
// and b.
//
// Each component of the velocity is a random process of its own: a Wiener process (steady, but for white
// accelerations of density q) or an Ornstein-Uhlenbeck process (pulled to 0 with time constant tau), both
// integrated exactly to the place (the same survey, section IV.B, Singer's covariance one order lower); over
// a step a velocity that is pulled counts with its mean.
#pragma once

#include <Eigen/Core>

namespace skylight::motion {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Places in the state.
enum Index : int { kX = 0, kY = 1, kYaw = 2, kU = 3, kS = 4, kW = 5 };

struct Gaussian6 {
  Vector6 mean = Vector6::Zero();
  Matrix6 cov = Matrix6::Identity();
};

/// How one component of the velocity changes.
struct VelocityNoise {
  /// Spectral density of the acceleration, (m/s^2)^2 s or (rad/s^2)^2 s, > 0.
  double density = 1.0;
  /// 1 / tau of the pull to 0, 1/s; 0: no pull (Wiener process).
  double pull = 0.0;
};

/// One way of moving.
struct MotionModel {
  VelocityNoise forward, sideways, turning;
  /// Stands: velocities are 0 but for these spreads, whatever they were; the noises above are not used.
  bool stands = false;
  double stand_speed = 0.001;    ///< m/s, one sigma
  double stand_yaw_rate = 0.01;  ///< rad/s, one sigma
  /// A random walk of the place itself (of the detector's slow error): m^2/s and rad^2/s.
  double place_walk = 0.0;
  double yaw_walk = 0.0;
};

/// a(theta), b(theta) as above, and their derivatives.
struct Arc {
  double a = 1.0;
  double b = 0.0;
  double da = 0.0;
  double db = 0.0;
};
Arc arc(double theta);

/// A velocity process over `dt`: what is kept of the velocity at the end and on average, and the covariance
/// that the noise adds to (velocity, its integral).
struct VelocityStep {
  double keep = 1.0;
  double mean_keep = 1.0;
  double vv = 0.0;
  double pv = 0.0;
  double pp = 0.0;
};
VelocityStep velocity_step(const VelocityNoise& noise, double dt);

/// A model over a fixed dt (s, >= 0): made once, used for any state.
class ModelStep {
 public:
  ModelStep(const MotionModel& model, double dt);

  Vector6 move(const Vector6& state) const;
  /// d move / d state.
  Matrix6 jacobian(const Vector6& state) const;
  /// Covariance that the step adds: positive definite for dt > 0.
  Matrix6 noise(const Vector6& state) const;

  Gaussian6 predict(const Gaussian6& from) const;
  /// The same, with the Jacobian that was used.
  Gaussian6 predict(const Gaussian6& from, Matrix6& jacobian_out) const;

 private:
  double dt_;
  double place_walk_;
  double yaw_walk_;
  VelocityStep forward_, sideways_, turning_;
};

}  // namespace skylight::motion
