// The motion of a body on a floor, against numerical derivatives, closed forms and sampling.
#include "tracker/filter/body_motion.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/tracker/filter/route_truth.hpp"
#include "tracker/filter/motion_config.hpp"

namespace skylight::motion {
namespace {

using test::Random;

MotionModel wiener() {
  return {.forward = {.density = 0.5}, .sideways = {.density = 0.2}, .turning = {.density = 1.5}};
}

MotionModel pulled() {
  MotionModel model = wiener();
  model.sideways.pull = 7.0;
  model.forward.pull = 0.5;
  return model;
}

Vector6 any_state(Random& random) {
  Vector6 x;
  x << random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), random.uniform(-4.0, 4.0),
      random.uniform(-2.0, 2.0), random.uniform(-1.0, 1.0), random.uniform(-6.0, 6.0);
  return x;
}

TEST(BodyMotion, TheArcAndItsDerivativesPassSmoothlyThroughZero) {
  // Long double closed forms, where they do not cancel; the series on the other side of the seam.
  for (const double theta : {-3.0, -0.5, -0.0201, -0.0199, -0.001, 0.0199, 0.0201, 0.3, 6.0}) {
    const Arc k = arc(theta);
    const long double t = theta;
    EXPECT_NEAR(k.a, static_cast<double>(std::sin(t) / t), 1e-15);
    EXPECT_NEAR(k.b, static_cast<double>(2 * std::sin(t / 2) * std::sin(t / 2) / t), 1e-15);
    const double h = 1e-4;
    EXPECT_NEAR(k.da, (arc(theta + h).a - arc(theta - h).a) / (2 * h), 1e-8) << theta;
    EXPECT_NEAR(k.db, (arc(theta + h).b - arc(theta - h).b) / (2 * h), 1e-8) << theta;
  }
  const Arc still = arc(0.0);
  EXPECT_EQ(still.a, 1.0);
  EXPECT_EQ(still.b, 0.0);
  EXPECT_EQ(still.da, 0.0);
  EXPECT_EQ(still.db, 0.5);
}

TEST(BodyMotion, TheJacobianIsTheDerivativeOfTheStep) {
  Random random(11);
  for (const MotionModel& model : {wiener(), pulled()}) {
    for (int i = 0; i < 200; ++i) {
      const ModelStep step(model, random.uniform(0.001, 0.11));
      Vector6 x = any_state(random);
      if (i % 4 == 0) x[kW] *= 1e-6;
      const Matrix6 f = step.jacobian(x);
      for (int c = 0; c < 6; ++c) {
        const double h = 1e-5;
        Vector6 up = x;
        Vector6 down = x;
        up[c] += h;
        down[c] -= h;
        const Vector6 numeric = (step.move(up) - step.move(down)) / (2 * h);
        EXPECT_LT((f.col(c) - numeric).cwiseAbs().maxCoeff(), 2e-9) << "column " << c << ", case " << i;
      }
    }
  }
}

TEST(BodyMotion, GoingOnWithTheVelocityReversedLeadsBack) {
  Random random(12);
  for (int i = 0; i < 100; ++i) {
    const ModelStep step(wiener(), random.uniform(0.01, 0.5));
    const Vector6 start = any_state(random);
    Vector6 there = step.move(start);
    there.tail<3>() *= -1.0;
    Vector6 back = step.move(there);
    back.tail<3>() *= -1.0;
    EXPECT_LT((back - start).cwiseAbs().maxCoeff(), 1e-13);
  }
}

TEST(BodyMotion, TwoHalfStepsAreOneAndSpeedIsKept) {
  Random random(13);
  for (int i = 0; i < 100; ++i) {
    const double dt = random.uniform(0.01, 0.5);
    const ModelStep whole(wiener(), dt);
    const ModelStep half(wiener(), dt / 2);
    const Vector6 start = any_state(random);
    const Vector6 once = whole.move(start);
    EXPECT_LT((half.move(half.move(start)) - once).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_EQ(once.tail<3>(), start.tail<3>());
    // On a circle the chord is 2 r sin(theta / 2), r = speed / rate.
    const double speed = std::hypot(start[kU], start[kS]);
    const double chord = std::abs(2.0 * speed / start[kW] * std::sin(start[kW] * dt / 2));
    EXPECT_NEAR((once.head<2>() - start.head<2>()).norm(), chord, 1e-12);
  }
}

TEST(BodyMotion, APulledVelocityHasTheSpreadOfManySmallKicks) {
  // Both sides of the seam between series and closed form, against the sum over fine steps.
  for (const double pull : {0.0, 0.1, 0.29, 0.31, 5.0, 40.0}) {
    const double dt = 0.1;
    const VelocityStep step = velocity_step({.density = 2.0, .pull = pull}, dt);
    constexpr int kParts = 20000;
    double vv = 0.0, pv = 0.0, pp = 0.0;
    for (int i = 0; i < kParts; ++i) {
      const double left = dt * (i + 0.5) / kParts;  // s before the end
      const double v = std::exp(-pull * left);
      const double p = pull > 0.0 ? (1.0 - v) / pull : left;
      vv += 2.0 * v * v * dt / kParts;
      pv += 2.0 * v * p * dt / kParts;
      pp += 2.0 * p * p * dt / kParts;
    }
    EXPECT_NEAR(step.vv / vv, 1.0, 1e-4) << pull;
    EXPECT_NEAR(step.pv / pv, 1.0, 1e-4) << pull;
    EXPECT_NEAR(step.pp / pp, 1.0, 1e-4) << pull;
    EXPECT_NEAR(step.keep, std::exp(-pull * dt), 1e-12);
  }
}

TEST(BodyMotion, TheNoiseIsThatOfManySampledRuns) {
  const double dt = 0.1;
  const ModelStep step(wiener(), dt);
  Vector6 start;
  start << 1.0, -2.0, 0.7, 0.8, 0.1, 0.5;
  const Matrix6 noise = step.noise(start);
  Random random(14);
  constexpr int kRuns = 4000;
  constexpr int kParts = 25;
  const double h = dt / kParts;
  Matrix6 sampled = Matrix6::Zero();
  for (int run = 0; run < kRuns; ++run) {
    Vector6 x = start;
    for (int i = 0; i < kParts; ++i) {
      const double mid = x[kYaw] + 0.5 * h * x[kW];
      x[kX] += h * (x[kU] * std::cos(mid) - x[kS] * std::sin(mid));
      x[kY] += h * (x[kU] * std::sin(mid) + x[kS] * std::cos(mid));
      x[kYaw] += h * x[kW];
      x[kU] += std::sqrt(0.5 * h) * random.normal();
      x[kS] += std::sqrt(0.2 * h) * random.normal();
      x[kW] += std::sqrt(1.5 * h) * random.normal();
    }
    const Vector6 off = x - step.move(start);
    sampled += off * off.transpose() / kRuns;
  }
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) {
      const double scale = std::sqrt(noise(r, r) * noise(c, c));
      EXPECT_NEAR(sampled(r, c) / scale, noise(r, c) / scale, 0.09) << r << ", " << c;
    }
  }
}

TEST(BodyMotion, NoStepOfAnyModelLosesPositiveness) {
  Random random(15);
  const ModelBank bank = model_bank({});
  for (const MotionModel& model : bank.model) {
    for (const double dt : {1e-9, 1e-4, 0.033, 0.11, 3.0}) {
      const Matrix6 noise = ModelStep(model, dt).noise(any_state(random));
      const Vector6 scale = noise.diagonal().cwiseSqrt().cwiseInverse();
      const Matrix6 correlation = scale.asDiagonal() * noise * scale.asDiagonal();
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(correlation).eigenvalues().minCoeff(), -1e-9) << dt;
      EXPECT_EQ(noise, noise.transpose());
    }
  }
}

}  // namespace
}  // namespace skylight::motion
