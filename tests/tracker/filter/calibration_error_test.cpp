// A calibration's error in the filters: published, never averaged away; two cameras that disagree.
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/tracker/filter/motion_feed.hpp"
#include "tracker/filter/imm_smoother.hpp"
#include "tracker/filter/window.hpp"

namespace skylight {
namespace {

using test::detect;
using test::Detector;
using test::instant;
using test::Random;
using test::Route;
using test::RouteKind;

constexpr Detector kTenthOfAMillimetre{.sigma_m = 1e-4, .sigma_rad = 4e-4};

/// Of one camera: 2 mm and 0.1 degrees per axis, x and yaw together.
Covariance3 calibration(double scale = 1.0) {
  Covariance3 out = Eigen::Vector3d(4e-6, 4e-6, 3e-6).asDiagonal();
  out(0, 2) = out(2, 0) = 1.5e-6;
  return scale * scale * out;
}

/// A camera with the error that its calibration left.
struct Camera {
  std::size_t index = 0;
  Covariance3 correlated = Covariance3::Zero();
  Eigen::Vector3d error = Eigen::Vector3d::Zero();

  void draw(Random& random) {
    const Eigen::Vector3d normal(random.normal(), random.normal(), random.normal());
    error = Eigen::LLT<Covariance3>(correlated).matrixL() * normal;
  }
  std::optional<Observation> see(const Pose2& truth, double t, Random& random) const {
    auto out = detect(kTenthOfAMillimetre, truth, t, random);
    if (!out) return out;
    out->pose.x += error.x();
    out->pose.y += error.y();
    out->pose.yaw = wrap_angle(out->pose.yaw + error.z());
    out->camera = index;
    out->correlated = correlated;
    return out;
  }
};

double least_eigenvalue(const Covariance3& m) {
  return Eigen::SelfAdjointEigenSolver<Covariance3>(m, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

/// The same frames with and without what the calibration leaves unknown.
template <class F>
void expect_only_added(F& without, F& with, const Covariance3& added) {
  const Route route(RouteKind::chaotic, 6.0, 4301);
  Random random(4302);
  for (int i = 0; i < 180; ++i) {
    const double t = i / 30.0;
    auto seen = i % 50 > 45 ? std::nullopt : detect(kTenthOfAMillimetre, route.at(t).pose, t, random);
    const FilterStep plain = without.update(instant(t), seen);
    if (seen) seen->correlated = added;
    const FilterStep step = with.update(instant(t), seen);
    ASSERT_EQ(step.state, plain.state);
    ASSERT_EQ(step.accepted, plain.accepted);
    const auto expect_same = [&](const std::optional<Estimate>& a, const std::optional<Estimate>& b) {
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) return;
      EXPECT_EQ(a->pose, b->pose);
      EXPECT_EQ(a->velocity, b->velocity);
      EXPECT_EQ(a->covariance, Covariance3(b->covariance + added));
    };
    expect_same(step.estimate, plain.estimate);
    expect_same(with.predict(instant(t + 0.5)), without.predict(instant(t + 0.5)));
    if constexpr (std::is_same_v<F, MotionFilter>)  // the other has no smoother
      expect_same(with.smoothed(instant(t - 0.51)), without.smoothed(instant(t - 0.51)));
  }
}

TEST(CalibrationError, IsAddedToWhatTheMotionFilterPublishesAndChangesNothingElse) {
  MotionFilter without;
  MotionFilter with;
  expect_only_added(without, with, calibration());
}

TEST(CalibrationError, IsAddedToWhatTheWindowFilterPublishesAndChangesNothingElse) {
  WindowFilter without;
  WindowFilter with;
  expect_only_added(without, with, calibration());
}

TEST(CalibrationError, OfACameraKnownExactlyLeavesEveryBitAsItWas) {
  MotionFilter without;
  MotionFilter with;
  expect_only_added(without, with, Covariance3::Zero());
}

TEST(CalibrationError, IsNotAveragedAwayHoweverManyFrames) {
  MotionFilter motion(test::white());
  WindowFilter window;
  Random random(4303);
  for (int i = 0; i < 900; ++i) {
    auto seen = detect(kTenthOfAMillimetre, {1.0, 0.5, 0.2}, i / 30.0, random);
    seen->correlated = calibration();
    const FilterStep a = motion.update(instant(i / 30.0), seen);
    const FilterStep b = window.update(instant(i / 30.0), seen);
    for (const auto& estimate : {a.estimate, b.estimate}) {
      if (!estimate) continue;
      ASSERT_GE(least_eigenvalue(estimate->covariance - calibration()), 0.0) << i;
    }
  }
  const auto smoothed = motion.smoothed(instant(29.5));
  ASSERT_TRUE(smoothed);
  EXPECT_GE(least_eigenvalue(smoothed->covariance - calibration()), 0.0);
  // ... while the noise is: what is left above it is far below one frame's.
  EXPECT_LT(smoothed->covariance(0, 0) - calibration()(0, 0), 0.3e-8);
}

TEST(CalibrationError, ThatIsNoCovarianceCountsAsNoObservation) {
  MotionFilter motion;
  WindowFilter window({.calibration_threshold = 0});
  Observation seen = test::at_pose(0.0, {0.0, 0.0, 0.0});
  seen.correlated(1, 1) = std::nan("");
  EXPECT_FALSE(motion.update(seen.captured, seen).accepted);
  EXPECT_FALSE(window.update(seen.captured, seen).accepted);
  seen = test::at_pose(0.1, {0.0, 0.0, 0.0});
  seen.correlated(1, 1) = -1.0;
  EXPECT_FALSE(motion.update(seen.captured, seen).accepted);
}

TEST(CalibrationError, TwoCamerasThreeMillimetresApartAreBothBelievedAndDoNotShakeThePose) {
  const Camera left{.index = 0, .correlated = calibration(), .error = {1.5e-3, 0.0, 0.0}};
  const Camera right{.index = 1, .correlated = calibration(), .error = {-1.5e-3, 0.0, 0.0}};
  const Route route(RouteKind::chaotic, 20.0, 4304);
  // In turn, 30 Hz each; largest change of the error from one frame to the next.
  const auto shaking = [&](bool with_right) {
    MotionFilter filter(test::white());
    Random random(4305);
    std::optional<Eigen::Vector2d> last;
    double worst = 0.0;
    for (int i = 0; i < 1200; ++i) {
      const double t = i / 60.0;
      const Pose2 truth = route.at(t).pose;
      auto seen = (i % 2 == 0 ? left : right).see(truth, t, random);
      if (i % 2 == 1 && !with_right) seen.reset();
      const FilterStep step = filter.update(instant(t), seen);
      EXPECT_EQ(step.accepted, seen.has_value()) << t;
      if (!step.estimate) continue;
      const Eigen::Vector2d error = step.estimate->pose.position() - truth.position();
      EXPECT_LT(error.norm(), 3e-3) << t;
      if (last) worst = std::max(worst, (error - *last).norm());
      last = error;
    }
    return worst;
  };
  EXPECT_LT(shaking(true), shaking(false) + 3e-4);
}

TEST(CalibrationError, AtAHandOverThePoseStepsByWhatIsBetweenTheCamerasAndTheVelocityDoesNot) {
  const Camera left{.index = 0, .correlated = calibration(), .error = {2e-3, 1e-3, 0.0}};
  const Camera right{.index = 1, .correlated = calibration(), .error = {-1e-3, 1e-3, 0.0}};
  MotionFilter filter(test::white());
  Random random(4306);
  double largest_step = 0.0;
  std::optional<Eigen::Vector2d> last;
  for (int i = 0; i < 300; ++i) {
    const double t = i / 60.0;
    const bool from_left = t < 2.0 || (t < 3.0 && i % 2 == 0);
    const Pose2 truth{0.3 * t, 0.5, 0.0};
    const FilterStep step = filter.update(instant(t), (from_left ? left : right).see(truth, t, random));
    ASSERT_TRUE(step.accepted) << t;
    if (t < 0.5) continue;
    const Eigen::Vector2d error = step.estimate->pose.position() - truth.position();
    if (last) largest_step = std::max(largest_step, (error - *last).norm());
    last = error;
    EXPECT_NEAR(step.estimate->velocity.x, 0.3, 0.01) << t;
    EXPECT_NEAR(step.estimate->velocity.y, 0.0, 0.01) << t;
    if (t > 2.99 && t < 3.5) continue;
    // The camera that it began with; then the one that is left.
    EXPECT_NEAR(error.x(), t < 3.0 ? 2e-3 : -1e-3, 0.5e-3) << t;
  }
  EXPECT_GT(largest_step, 1e-3);
  EXPECT_LT(largest_step, 3.5e-3);
}

TEST(CalibrationError, TheCameraThatKnowsThePlaceClearlyBetterTakesOverAtOnce) {
  Camera coarse{.index = 0, .correlated = calibration(3.0), .error = {6e-3, -6e-3, 0.0}};
  Camera fine{.index = 1, .correlated = calibration(0.2), .error = {2e-4, 0.0, 0.0}};
  MotionFilter filter(test::white());
  Random random(4307);
  for (int i = 0; i < 120; ++i) {
    const double t = i / 60.0;
    const Pose2 truth{1.0, 0.5, 0.0};
    const bool both = i > 60;
    const FilterStep step =
        filter.update(instant(t), (both && i % 2 == 1 ? fine : coarse).see(truth, t, random));
    ASSERT_TRUE(step.accepted) << t;
    if (i > 61) {
      EXPECT_LT((step.estimate->pose.position() - truth.position()).norm(), 1e-3) << t;
      EXPECT_LT(step.estimate->covariance(0, 0), 1e-6) << t;
    }
  }
}

/// Pairs of cameras, each with an error drawn from what it claims: alone, together, handed over.
TEST(CalibrationError, ClaimsOfTwoCamerasAreHonestOverManyCalibrations) {
  test::Score together, after, smoothed_there;
  Random random(4308);
  constexpr int kPairs = 200;
  for (int pair = 0; pair < kPairs; ++pair) {
    Camera left{.index = 0, .correlated = calibration()};
    Camera right{.index = 1, .correlated = calibration(0.9)};
    left.draw(random);
    right.draw(random);
    const Pose2 start{random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), random.uniform(-3.0, 3.0)};
    const auto truth = [&](double t) {
      return Pose2{start.x + 0.2 * t * std::cos(start.yaw), start.y + 0.2 * t * std::sin(start.yaw),
                   start.yaw};
    };
    MotionFilter filter(test::white());
    FilterStep step;
    for (int i = 0; i <= 40; ++i) {
      const double t = i / 20.0;
      const bool from_left = t < 0.7 || (t < 1.2 && i % 2 == 0);
      step = filter.update(instant(t), (from_left ? left : right).see(truth(t), t, random));
      if (i == 22) together.add(step.estimate.value(), truth(t));
    }
    after.add(step.estimate.value(), truth(2.0));
    smoothed_there.add(filter.smoothed(instant(1.3)).value(), truth(1.3));
  }
  // The mean of 200 is known to 0.17; what is widened when one camera hands over to the other is cautious.
  for (const test::Score& score : {together, after, smoothed_there}) {
    EXPECT_GT(score.nees, 2.1);
    EXPECT_LT(score.nees, 3.6);
    EXPECT_GE(score.inside, 0.90);
    EXPECT_LE(score.inside, 0.98);
  }
}

}  // namespace

namespace motion {
namespace {

TEST(Smoother, PlaceThatBecameLessCertainBeforeAMeasurementIsAMeasurementSoMuchNoisier) {
  Gaussian6 prior;
  prior.mean << 0.3, -0.2, 0.1, 0.2, 0.0, 0.05;
  Random random(4309);
  Matrix6 root;
  for (double& each : root.reshaped()) each = 0.02 * random.normal();
  prior.cov = root * root.transpose();
  Mixture past;
  past.part.fill(prior);
  past.weight.fill(1.0 / kModels);
  const Eigen::Vector3d line(3e-3, -1e-3, 2e-3);
  const Eigen::Matrix3d by = line * line.transpose();  // certain in two directions
  const LinearMeasurement exact{
      .first = kX, .value = {0.31, -0.22, 0.12}, .noise = Eigen::Vector3d(1e-6, 2e-6, 1e-6).asDiagonal()};
  LinearMeasurement noisy = exact;
  noisy.noise += by;

  Future stepped = no_future(past);
  add(stepped, exact, prior.mean);
  widen_back(stepped, by);
  Future direct = no_future(past);
  add(direct, noisy, prior.mean);
  const Gaussian6 a = combine(past, stepped);
  const Gaussian6 b = combine(past, direct);
  EXPECT_LT((a.mean - b.mean).norm(), 1e-9);
  EXPECT_LT((a.cov - b.cov).norm(), 1e-12);
  // And forward: widened, then corrected, the place is as if the measurement had been so much noisier.
  Mixture widened = past;
  widen(widened, by);
  ASSERT_TRUE(correct(widened, exact));
  Mixture once = past;
  const Innovation before = innovation(once, noisy);
  once = past;
  widen(once, by);
  EXPECT_NEAR(innovation(once, exact).distance2, before.distance2, 1e-9 * before.distance2);
}

}  // namespace
}  // namespace motion
}  // namespace skylight
