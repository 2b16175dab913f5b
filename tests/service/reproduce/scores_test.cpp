#include "service/reproduce/scores.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/service/reproduce/made_runs.hpp"
#include "tracker/filter/motion.hpp"

namespace skylight::service::reproduce {
namespace {

using test::at;

constexpr double kSpeed = 0.2;  // m/s

Pose2 on_line(int i) {
  return {kSpeed * 0.1 * i, 1.0, 0.0};
}

/// A robot on a line at 10 Hz, seen `off` beside where it is, except in frames [from, to).
ObservedRun line_run(int frames, const Eigen::Vector2d& off = {0.0, 0.0}, int from = 0, int to = 0) {
  ObservedRun run = test::empty_run("line-1", 7);
  for (int i = 0; i < frames; ++i) {
    std::optional<Pose2> seen = Pose2{on_line(i).x + off.x(), on_line(i).y + off.y(), 0.0};
    if (i >= from && i < to) seen.reset();
    test::add(run, on_line(i), seen, std::nullopt);
  }
  return run;
}

/// Believes what it sees, and that everything stays where it is.
class Stays final : public Filter {
 public:
  FilterStep update(Time captured, const std::optional<Observation>& observation) override {
    if (observation)
      last_ = {.at = captured, .pose = observation->pose, .covariance = observation->covariance};
    return {
        .state = last_ ? TrackState::tracking : TrackState::searching, .estimate = last_, .accepted = true};
  }
  bool odometry(const BodyVelocity& said) override {
    heard_.push_back(said.at);
    return true;
  }
  std::optional<Estimate> predict(Time at) const override {
    auto out = last_;
    if (out) out->at = at;
    return out;
  }
  Duration smoothing_lag() const override { return {}; }
  std::optional<Estimate> smoothed(Time) const override { return std::nullopt; }
  std::vector<Estimate> smoothed_from(Time) const override { return {}; }
  void reset() override { last_.reset(); }
  std::unique_ptr<Filter> clone() const override { return std::make_unique<Stays>(*this); }

 private:
  std::optional<Estimate> last_;
  std::vector<Time> heard_;
};

ScoreOptions staying() {
  return {.filter = [] { return std::make_unique<Stays>(); }, .variant = "vertical"};
}

ScoreOptions moving() {
  return {.filter = [] { return std::make_unique<MotionFilter>(); }, .variant = "vertical"};
}

std::vector<const ObservedRun*> pointers(const Runs& runs) {
  std::vector<const ObservedRun*> out;
  for (const ObservedRun& run : runs) out.push_back(&run);
  return out;
}

TEST(Scores, AnOffsetOfThreeAndFourIsAnErrorOfFive) {
  const KindMetrics kinds = score(line_run(60, {0.003, 0.004}), staying());
  EXPECT_NEAR(kinds.measured.score().position_error_m.mean, 0.005, 1e-12);
  EXPECT_NEAR(kinds.filtered.score().position_error_m.max, 0.005, 1e-12);
  EXPECT_EQ(kinds.smoothed.score().position_error_m.count, 0U) << "this filter does not smooth";
}

TEST(Scores, WhoBelievesThatAllStandsStillIsHalfASecondsWayOff) {
  const RobotScore ahead = score(line_run(60), staying()).predicted.score();
  EXPECT_NEAR(ahead.position_error_m.mean, 0.5 * kSpeed, 1e-9);
  EXPECT_EQ(ahead.position_error_m.count, ahead.frames);
  ScoreOptions further = staying();
  further.ahead_s = 2.0;
  const RobotScore far = score(line_run(60), further).predicted.score();
  EXPECT_NEAR(far.position_error_m.mean, 2.0 * kSpeed, 1e-9);
  EXPECT_EQ(far.position_error_m.count, 60U - 20U) << "nothing is predicted for the first two seconds";
  EXPECT_LT(far.availability, 1.0);
}

TEST(Scores, EveryFrameIsSmoothedAndTheLastOnesToo) {
  const RobotScore smoothed = score(line_run(60, {0.001, 0.0}), moving()).smoothed.score();
  EXPECT_EQ(smoothed.position_error_m.count, smoothed.frames);
  EXPECT_NEAR(smoothed.position_error_m.mean, 0.001, 2e-4);
}

TEST(Scores, AGapIsJudgedInTheFrameInWhichTheRobotIsSeenAgain) {
  const ObservedRun run = line_run(80, {0.0, 0.0}, 30, 50);
  const auto gaps = reappearances(run, staying(), 1.5);
  ASSERT_EQ(gaps.size(), 1U);
  EXPECT_NEAR(gaps[0].hidden_s, 2.1, 1e-9) << "from the last observation to the next";
  EXPECT_NEAR(gaps[0].error_m, 2.1 * kSpeed, 1e-9);
  EXPECT_FALSE(gaps[0].lost);
  EXPECT_EQ(gaps[0].seed, 7U);
  EXPECT_LT(reappearances(run, moving(), 1.5).at(0).error_m, 0.02) << "a filter that knows of motion";
  EXPECT_THAT(reappearances(run, staying(), 2.2), testing::IsEmpty());
  const auto long_gap = reappearances(line_run(120, {0.0, 0.0}, 30, 100), moving(), 1.5);
  ASSERT_EQ(long_gap.size(), 1U);
  EXPECT_TRUE(long_gap[0].lost) << "longer than the filter carries on";
}

TEST(Scores, SmoothingIsJudgedWithoutEachRunsMeanError) {
  Runs runs{line_run(60), line_run(60)};
  for (int i = 0; i < 60; ++i) {  // noise of +-5 mm, the same in both runs; the second lies 1 m beside
    for (std::size_t r = 0; r < 2; ++r) {
      Pose2& pose = runs[r].frames[static_cast<std::size_t>(i)].seen[0]->pose;
      pose.x += (i * 7919 % 11 - 5) * 0.001;
      pose.y += (i * 104729 % 11 - 5) * 0.001 + static_cast<double>(r);
    }
  }
  const Smoothing one = smoothing(pointers({runs[0]}), moving());
  const Smoothing both = smoothing(pointers(runs), moving());
  EXPECT_LT(one.smoothed_m, one.filtered_m);
  EXPECT_NEAR(both.smoothed_m, one.smoothed_m, 1e-9);
  EXPECT_NEAR(both.filtered_m, one.filtered_m, 1e-9);
}

TEST(Scores, TheWorstRunIsNamedAndARunWithoutAnyPoseIsTheWorst) {
  Runs runs{line_run(40, {0.001, 0.0}), line_run(40, {0.009, 0.0}), line_run(40, {0.002, 0.0})};
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i].seed = i + 1;
  const PooledScore some = pooled(pointers(runs), staying());
  EXPECT_EQ(some.worst_run, "line-1, seed 2");
  EXPECT_NEAR(some.worst_error_m, 0.009, 1e-12);
  runs.push_back(line_run(40, {0.0, 0.0}, 0, 40));
  EXPECT_EQ(pooled(pointers(runs), staying()).worst_run, "line-1, seed 7");
}

TEST(Scores, ACalibrationsErrorIsStatedAndNotAveragedAway) {
  ObservedRun run = line_run(200, {0.003, 0.0});
  const double silent = score(run, moving()).filtered.score().nees_mean;
  for (ObservedFrame& frame : run.frames)
    frame.seen.at(0)->correlated = Eigen::Vector3d(9e-6, 9e-6, 1e-8).asDiagonal();
  const double told = score(run, moving()).filtered.score().nees_mean;
  EXPECT_LT(told, 1.01) << "one sigma off, along one axis";
  EXPECT_GT(told, 0.0);
  EXPECT_LT(told, silent);
}

TEST(Scores, ErrorPartsTellALagFromABias) {
  // Half a frame's way behind, 2 mm to the left, whatever the heading.
  ObservedRun run = test::empty_run("circle-1");
  for (int i = 0; i < 200; ++i) {
    const double yaw = wrap_angle(0.05 * i);
    const Pose2 truth{std::cos(0.05 * i), std::sin(0.05 * i), yaw};
    const Eigen::Vector2d off = Eigen::Rotation2Dd(yaw) * Eigen::Vector2d(-0.010, 0.002);
    test::add(run, truth, Pose2{truth.x + off.x(), truth.y + off.y(), yaw}, std::nullopt);
  }
  const ErrorParts parts = error_parts({&run}, staying());
  EXPECT_NEAR(parts.measured_bias_m.x(), -0.010, 1e-12);
  EXPECT_NEAR(parts.measured_bias_m.y(), 0.002, 1e-12);
  EXPECT_NEAR(parts.filtered_bias_m.x(), -0.010, 1e-12);
  EXPECT_NEAR(parts.measured_mean_m, std::hypot(0.010, 0.002), 1e-12);
}

TEST(Scores, RefuseAVariantThatIsNotThere) {
  ScoreOptions options = staying();
  options.variant = "calibrated";
  EXPECT_THROW(score(line_run(10), options), std::invalid_argument);
}

}  // namespace
}  // namespace skylight::service::reproduce
