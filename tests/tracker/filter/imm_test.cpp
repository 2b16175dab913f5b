// The mixture of models and its smoother: against one exact linear problem solved in one piece, and by laws.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "tests/tracker/filter/route_truth.hpp"
#include "tracker/filter/imm_smoother.hpp"
#include "tracker/filter/motion_config.hpp"

namespace skylight::motion {
namespace {

using test::Random;

Mixture same_in_all(const Gaussian6& g) {
  Mixture out;
  out.part.fill(g);
  out.weight.fill(1.0 / kModels);
  return out;
}

/// Five times the same model: then switching means nothing, and the mixture is one Kalman filter.
ModelBank alike(const MotionModel& model) {
  ModelBank bank = model_bank({});
  bank.model.fill(model);
  return bank;
}

LinearMeasurement pose(double x, double y, double yaw, double variance) {
  return {.first = kX, .value = {x, y, yaw}, .noise = Eigen::Matrix3d::Identity() * variance};
}

/// A robot on the x axis that never turns: what remains is linear in (x, u).
struct Straight {
  static constexpr double kDt = 0.1, kDensity = 0.04, kNoise = 0.0025;
  static constexpr int kSteps = 30;
  ModelBank bank = alike(
      {.forward = {.density = kDensity}, .sideways = {.density = 1e-14}, .turning = {.density = 1e-14}});
  Gaussian6 prior;
  std::vector<double> seen;

  Straight() {
    prior.mean << 0.5, 0.0, 0.0, 0.2, 0.0, 0.0;
    Vector6 variance;
    variance << 0.01, 1e-10, 1e-10, 0.09, 1e-10, 1e-10;
    prior.cov = variance.asDiagonal();
    Random random(21);
    for (int k = 0; k <= kSteps; ++k) seen.push_back(0.5 + 0.02 * k + 0.05 * random.normal());
  }
  /// Filtered mixtures after each measurement, the first one at the prior.
  std::vector<Mixture> filtered() const {
    std::vector<Mixture> out;
    Mixture m = same_in_all(prior);
    for (int k = 0; k <= kSteps; ++k) {
      if (k > 0) m = predict(bank, m, kDt);
      correct(m, pose(seen[static_cast<std::size_t>(k)], 0.0, 0.0, kNoise));
      out.push_back(m);
    }
    return out;
  }
  /// Mean and variance of x_k, u_k from all measurements up to `last`, as one system of normal equations.
  std::pair<Eigen::Vector2d, Eigen::Matrix2d> in_one_piece(int k, int last) const {
    const int n = 2 * (last + 1);
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
    a(0, 0) = 1.0 / 0.01;
    a(1, 1) = 1.0 / 0.09;
    b[0] = 0.5 / 0.01;
    b[1] = 0.2 / 0.09;
    Eigen::Matrix2d f;
    f << 1.0, kDt, 0.0, 1.0;
    Eigen::Matrix2d q;
    q << kDt * kDt * kDt / 3, kDt * kDt / 2, kDt * kDt / 2, kDt;
    const Eigen::Matrix2d w = (kDensity * q).inverse();
    for (int i = 0; i <= last; ++i) {
      a(2 * i, 2 * i) += 1.0 / kNoise;
      b[2 * i] += seen[static_cast<std::size_t>(i)] / kNoise;
      if (i == last) break;
      a.block<2, 2>(2 * i, 2 * i) += f.transpose() * w * f;
      a.block<2, 2>(2 * i, 2 * i + 2) -= f.transpose() * w;
      a.block<2, 2>(2 * i + 2, 2 * i) -= w * f;
      a.block<2, 2>(2 * i + 2, 2 * i + 2) += w;
    }
    const Eigen::MatrixXd inverse = a.inverse();
    return {(inverse * b).segment<2>(2 * k), inverse.block<2, 2>(2 * k, 2 * k)};
  }
};

TEST(Mixture, OfLikeModelsIsTheExactFilterOfALinearProblem) {
  const Straight problem;
  const auto filtered = problem.filtered();
  for (const int k : {1, 7, Straight::kSteps}) {
    const auto [mean, cov] = problem.in_one_piece(k, k);
    const Gaussian6 g = collapse(filtered[static_cast<std::size_t>(k)]);
    EXPECT_NEAR(g.mean[kX], mean[0], 1e-7);
    EXPECT_NEAR(g.mean[kU], mean[1], 1e-7);
    EXPECT_NEAR(g.cov(kX, kX), cov(0, 0), 1e-8);
    EXPECT_NEAR(g.cov(kX, kU), cov(0, 1), 1e-7);
    EXPECT_NEAR(g.cov(kU, kU), cov(1, 1), 1e-7);
  }
}

TEST(Smoother, OfLikeModelsIsTheExactSmootherOfALinearProblem) {
  const Straight problem;
  const auto filtered = problem.filtered();
  Future future = no_future(filtered.back());
  for (int k = Straight::kSteps; k > 0; --k) {
    const auto i = static_cast<std::size_t>(k);
    add(future, pose(problem.seen[i], 0.0, 0.0, Straight::kNoise), collapse(filtered[i]).mean);
    future = back(problem.bank, filtered[i - 1], Straight::kDt, future);
    const Gaussian6 g = combine(filtered[i - 1], future);
    const auto [mean, cov] = problem.in_one_piece(k - 1, Straight::kSteps);
    EXPECT_NEAR(g.mean[kX], mean[0], 1e-6) << k;
    EXPECT_NEAR(g.mean[kU], mean[1], 1e-6) << k;
    EXPECT_NEAR(g.cov(kX, kX), cov(0, 0), 1e-7) << k;
    EXPECT_NEAR(g.cov(kU, kU), cov(1, 1), 1e-6) << k;
  }
}

TEST(Smoother, WithNothingMeasuredLaterLeavesTheFilteredStateAsItIs) {
  const Straight problem;
  const Mixture filtered = problem.filtered().back();
  const ModelBank bank = model_bank({});
  const Mixture later = predict(bank, filtered, 0.4);
  const Gaussian6 then = combine(filtered, back(bank, filtered, 0.4, no_future(later)));
  const Gaussian6 now = collapse(filtered);
  EXPECT_LT((then.mean - now.mean).norm(), 1e-9);
  EXPECT_LT((then.cov - now.cov).norm(), 1e-9);
}

TEST(Mixture, ProbabilitiesSumToOneAndTheModelThatForesawGains) {
  const ModelBank bank = model_bank({});
  Gaussian6 start;
  start.mean << 0.0, 0.0, 0.0, 0.2, 0.0, 0.0;
  start.cov = Matrix6::Identity() * 1e-6;
  Mixture m = predict(bank, same_in_all(start), 0.033);
  Mixture steady = m;
  Mixture stopped = m;
  for (int k = 1; k <= 10; ++k) {
    if (k > 1) steady = predict(bank, steady, 0.033);
    if (k > 1) stopped = predict(bank, stopped, 0.033);
    correct(steady, pose(0.2 * 0.033 * k, 0.0, 0.0, 1e-6));
    correct(stopped, pose(0.0, 0.0, 0.0, 1e-6));
    for (const Mixture* each : {&steady, &stopped})
      EXPECT_NEAR(std::accumulate(each->weight.begin(), each->weight.end(), 0.0), 1.0, 1e-12);
  }
  EXPECT_GT(steady.weight[kSteady] + steady.weight[kAdjusting], 0.8);
  EXPECT_GT(stopped.weight[kStanding], 0.9);
}

TEST(Mixture, TheDensityOfAMeasurementIsTheWeightedSumOfTheModels) {
  Random random(22);
  Mixture m = same_in_all({});
  double sum = 0.0;
  const LinearMeasurement seen = pose(0.3, -0.2, 0.1, 0.05);
  double nearest = 1e9;
  for (std::size_t i = 0; i < kModels; ++i) {
    Gaussian6& g = m.part[i];
    for (int c = 0; c < 6; ++c) g.mean[c] = random.normal();
    g.cov = Matrix6::Identity() * random.uniform(0.1, 1.0);
    m.weight[i] = 0.1 + 0.05 * static_cast<double>(i);
    const Eigen::Matrix3d s = g.cov.topLeftCorner<3, 3>() + seen.noise;
    const Eigen::Vector3d d = seen.value - g.mean.head<3>();
    const double distance2 = d.dot(s.inverse() * d);
    nearest = std::min(nearest, distance2);
    sum += m.weight[i] * std::exp(-0.5 * distance2) /
           std::sqrt(std::pow(2.0 * std::numbers::pi, 3.0) * s.determinant());
  }
  EXPECT_NEAR(innovation(m, seen).log_density, std::log(sum), 1e-12);
  EXPECT_NEAR(innovation(m, seen).distance2, nearest, 1e-12);
}

TEST(Mixture, SwitchingInTwoHalfTimesIsSwitchingInOne) {
  // Of the probabilities alone, which the times of the frames must not change: to second order in the time.
  const ModelBank bank = model_bank({});
  Gaussian6 start;
  const Mixture m = same_in_all(start);
  const Mixture once = predict(bank, m, 0.02);
  const Mixture twice = predict(bank, predict(bank, m, 0.01), 0.01);
  for (std::size_t i = 0; i < kModels; ++i) EXPECT_NEAR(once.weight[i], twice.weight[i], 2e-3);
}

TEST(Mixture, TurningTheRobotLeavesItsVelocityOnTheFloor) {
  Gaussian6 g;
  g.mean << 1.0, 2.0, 0.3, 0.5, -0.2, 0.7;
  g.cov = Matrix6::Identity() * 0.01;
  g.cov(kU, kU) = 0.04;
  Mixture m = same_in_all(g);
  turn(m, 1.1);
  const Gaussian6 turned = collapse(m);
  const auto on_floor = [](const Vector6& x) {
    return Eigen::Vector2d(x[kU] * std::cos(x[kYaw]) - x[kS] * std::sin(x[kYaw]),
                           x[kU] * std::sin(x[kYaw]) + x[kS] * std::cos(x[kYaw]));
  };
  EXPECT_LT((on_floor(turned.mean) - on_floor(g.mean)).norm(), 1e-14);
  turn(m, -1.1);
  EXPECT_LT((collapse(m).cov - g.cov).norm(), 1e-14);
}

}  // namespace
}  // namespace skylight::motion
