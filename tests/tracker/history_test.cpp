#include "tracker/history.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace skylight {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
constexpr double kPi = std::numbers::pi;
const Time kStart{seconds(1'700'000'000)};

Covariance3 variance(double v) {
  return v * Covariance3::Identity();
}

/// An entry with both poses, told apart by y: 0 measured, 1 filtered.
HistoryEntry entry(Duration after_start, double x, double yaw = 0.0) {
  HistoryEntry out;
  out.captured = kStart + after_start;
  out.state = TrackState::tracking;
  out.measured = Observation{.captured = out.captured, .pose = {x, 0.0, yaw}, .covariance = variance(0.01)};
  out.filtered = Estimate{
      .at = out.captured, .pose = {x, 1.0, yaw}, .covariance = variance(0.02), .velocity = {x, -x, 2 * x}};
  return out;
}

HistoryEntry unseen(Duration after_start) {
  HistoryEntry out;
  out.captured = kStart + after_start;
  out.state = TrackState::lost;
  return out;
}

PoseHistory filled(int entries, Duration interval, const HistoryLimits& limits = {}) {
  PoseHistory out(limits);
  for (int i = 0; i < entries; ++i) EXPECT_TRUE(out.append(entry(interval * i, i)));
  return out;
}

TEST(PoseHistory, GivesBackExactlyWhatStandsAtAnEntry) {
  const HistoryView view = filled(1000, milliseconds(33)).view();
  ASSERT_EQ(view.size(), 1000U);
  for (const int i : {0, 1, 127, 128, 500, 999}) {
    for (const PoseKind kind : {PoseKind::measured, PoseKind::filtered}) {
      const HistoryAnswer answer = view.pose(kind, kStart + milliseconds(33) * i);
      ASSERT_EQ(answer.lookup, HistoryLookup::found);
      EXPECT_EQ(answer.pose->estimate.pose,
                (Pose2{static_cast<double>(i), kind == PoseKind::filtered ? 1.0 : 0.0, 0.0}));
      EXPECT_EQ(answer.pose->estimate.at, kStart + milliseconds(33) * i);
      EXPECT_EQ(answer.pose->captured, answer.pose->estimate.at);
      EXPECT_EQ(answer.pose->kind, kind);
      EXPECT_EQ(answer.pose->state, TrackState::tracking);
      EXPECT_EQ(answer.pose->source, PoseSource::orb);
    }
  }
}

TEST(PoseHistory, InterpolatesLinearlyBetweenEntries) {
  PoseHistory history;
  HistoryEntry a = entry(milliseconds(0), 2.0, 0.4);
  HistoryEntry b = entry(milliseconds(100), 6.0, 0.8);
  b.filtered->covariance = variance(0.06);
  history.append(a);
  history.append(b);
  const HistoryAnswer answer = history.view().pose(PoseKind::filtered, kStart + milliseconds(25));
  ASSERT_TRUE(answer.pose);
  const Estimate& got = answer.pose->estimate;
  EXPECT_DOUBLE_EQ(got.pose.x, 3.0);
  EXPECT_DOUBLE_EQ(got.pose.y, 1.0);
  EXPECT_DOUBLE_EQ(got.pose.yaw, 0.5);
  EXPECT_DOUBLE_EQ(got.velocity.x, 3.0);
  EXPECT_DOUBLE_EQ(got.velocity.y, -3.0);
  EXPECT_DOUBLE_EQ(got.velocity.yaw_rate, 6.0);
  EXPECT_TRUE(got.covariance.isApprox(variance(0.03), 1e-12));
  EXPECT_EQ(got.at, kStart + milliseconds(25));
  EXPECT_EQ(answer.pose->captured, b.captured) << "the newest entry that went into it";
  const HistoryAnswer measured = history.view().pose(PoseKind::measured, kStart + milliseconds(75));
  ASSERT_TRUE(measured.pose);
  EXPECT_DOUBLE_EQ(measured.pose->estimate.pose.x, 5.0);
  EXPECT_EQ(measured.pose->estimate.velocity, Velocity2{});
}

TEST(PoseHistory, YawTurnsAlongTheShorterArc) {
  PoseHistory history;
  history.append(entry(milliseconds(0), 0.0, kPi - 0.1));
  history.append(entry(milliseconds(100), 0.0, -kPi + 0.3));
  const HistoryView view = history.view();
  EXPECT_NEAR(view.pose(PoseKind::filtered, kStart + milliseconds(10)).pose->estimate.pose.yaw, kPi - 0.06,
              1e-12);
  EXPECT_NEAR(view.pose(PoseKind::filtered, kStart + milliseconds(75)).pose->estimate.pose.yaw, -kPi + 0.2,
              1e-12);
}

TEST(PoseHistory, TellsBeforeAfterAndNoPoseApart) {
  EXPECT_EQ(PoseHistory().view().pose(PoseKind::filtered, kStart).lookup, HistoryLookup::no_pose);
  PoseHistory history = filled(10, milliseconds(100));
  history.append(unseen(milliseconds(1000)));
  history.append(unseen(milliseconds(1100)));
  const HistoryView view = history.view();
  const auto lookup = [&](PoseKind kind, Duration at) { return view.pose(kind, kStart + at).lookup; };
  for (const PoseKind kind : {PoseKind::measured, PoseKind::filtered}) {
    EXPECT_EQ(lookup(kind, Duration(-1)), HistoryLookup::before_history);
    EXPECT_EQ(lookup(kind, Duration(0)), HistoryLookup::found);
    EXPECT_EQ(lookup(kind, milliseconds(900)), HistoryLookup::found);
    EXPECT_EQ(lookup(kind, milliseconds(901)), HistoryLookup::no_pose);
    EXPECT_EQ(lookup(kind, milliseconds(1000)), HistoryLookup::no_pose);
    EXPECT_EQ(lookup(kind, milliseconds(1100)), HistoryLookup::no_pose);
    EXPECT_EQ(lookup(kind, milliseconds(1100) + Duration(1)), HistoryLookup::after_history);
    EXPECT_FALSE(view.pose(kind, kStart + milliseconds(1000)).pose);
  }
  EXPECT_EQ(lookup(PoseKind::smoothed, milliseconds(300)), HistoryLookup::after_history)
      << "nothing is settled";
  EXPECT_EQ(lookup(PoseKind::predicted, milliseconds(300)), HistoryLookup::no_pose);
}

Estimate smoothed_at(Duration at, double x) {
  return {.at = kStart + at, .pose = {x, 0.0, 0.0}};
}

TEST(PoseHistory, SmoothedPosesComeLaterAndOldViewsDoNotChange) {
  PoseHistory history = filled(400, milliseconds(100));
  const HistoryView before = history.view();
  std::vector<Estimate> smoothed;
  for (int i = 0; i < 300; ++i) {
    if (i != 200) smoothed.push_back(smoothed_at(milliseconds(100 * i), 1000.0 + i));
    smoothed.push_back(smoothed_at(milliseconds(100 * i + 50), -1.0));  // odometry between frames
  }
  history.settle(smoothed, kStart + milliseconds(25'000));
  const HistoryView view = history.view();
  EXPECT_EQ(before.settled(), 0U);
  EXPECT_EQ(view.settled(), 251U) << "up to and with the instant, though more is known";
  const auto pose = [&](double ms) {
    return view.pose(PoseKind::smoothed, kStart + from_seconds(ms / 1000));
  };
  EXPECT_EQ(pose(12'300).pose->estimate.pose.x, 1123.0);
  EXPECT_EQ(pose(12'300).pose->kind, PoseKind::smoothed);
  EXPECT_NEAR(pose(12'350).pose->estimate.pose.x, 1123.5, 1e-9);
  EXPECT_EQ(pose(20'000).lookup, HistoryLookup::no_pose) << "settled, but not known then";
  EXPECT_EQ(pose(20'050).lookup, HistoryLookup::no_pose) << "nothing is made up beside it";
  EXPECT_EQ(pose(25'000).lookup, HistoryLookup::found);
  EXPECT_EQ(pose(25'001).lookup, HistoryLookup::after_history);
  EXPECT_EQ(view.pose(PoseKind::filtered, kStart + milliseconds(12'300)).pose->estimate.pose.x,
            before.pose(PoseKind::filtered, kStart + milliseconds(12'300)).pose->estimate.pose.x);
}

TEST(PoseHistory, WhatIsSettledStaysSoWhenOldEntriesGo) {
  PoseHistory history({.max_age = std::chrono::seconds(20)});
  for (int i = 0; i < 1000; ++i) {
    history.append(
        {.captured = kStart + milliseconds(100 * i), .filtered = smoothed_at(milliseconds(100 * i), i)});
    if (i % 7 == 0 && i > 10)
      history.settle({smoothed_at(milliseconds(100 * (i - 10)), 5000.0 + i - 10)},
                     kStart + milliseconds(100 * (i - 10)));
    const HistoryView view = history.view();
    ASSERT_LE(view.settled(), view.size());
    if (i > 17) {
      ASSERT_GE(view.settled() + 17, view.size());
    }
    for (std::size_t k = 0; k < view.settled(); ++k) {
      if (view.smoothed(k)) {
        ASSERT_EQ(view.smoothed(k)->at, view[k].captured) << "entry " << k << " after " << i;
      }
    }
  }
}

TEST(PoseHistory, MeasuredBridgesMissesUpToTheGapAndFilteredNeverBridgesWhereTheFilterHadNone) {
  PoseHistory history;
  history.append(entry(milliseconds(0), 0.0));
  for (int i = 1; i < 5; ++i) history.append(unseen(milliseconds(100 * i)));
  history.append(entry(milliseconds(500), 5.0));
  history.append(entry(milliseconds(1001), 6.0));
  const HistoryView view = history.view();
  const HistoryAnswer bridged = view.pose(PoseKind::measured, kStart + milliseconds(200));
  ASSERT_EQ(bridged.lookup, HistoryLookup::found) << "500 ms apart, exactly the largest gap";
  EXPECT_DOUBLE_EQ(bridged.pose->estimate.pose.x, 2.0);
  EXPECT_EQ(view.pose(PoseKind::measured, kStart + milliseconds(200), milliseconds(499)).lookup,
            HistoryLookup::no_pose);
  EXPECT_EQ(view.pose(PoseKind::filtered, kStart + milliseconds(200)).lookup, HistoryLookup::no_pose);
  EXPECT_EQ(view.pose(PoseKind::filtered, kStart + milliseconds(50)).lookup, HistoryLookup::no_pose);
  for (const PoseKind kind : {PoseKind::measured, PoseKind::filtered}) {
    EXPECT_EQ(view.pose(kind, kStart + milliseconds(700)).lookup, HistoryLookup::no_pose) << "501 ms apart";
    EXPECT_EQ(view.pose(kind, kStart + milliseconds(700), seconds(1)).lookup, HistoryLookup::found);
  }
}

TEST(PoseHistory, AFilteredPoseWithoutAnAcceptedMeasurementIsAPrediction) {
  PoseHistory history;
  HistoryEntry seen = entry(milliseconds(0), 0.0);
  seen.measured->heading_turns = 4;
  seen.measured->score = 0.8;
  seen.measured->camera = 3;
  seen.filtered->cameras = camera_bit(3) | camera_bit(1);
  HistoryEntry gap = entry(milliseconds(33), 1.0);
  gap.state = TrackState::predicting;
  gap.measured.reset();
  HistoryEntry refused = entry(milliseconds(66), 2.0);
  refused.state = TrackState::predicting;
  refused.measured->heading_turns = 2;
  for (const HistoryEntry& e : {seen, gap, refused}) history.append(e);
  const HistoryView view = history.view();
  const HistoryPose at_seen = *view.pose(PoseKind::filtered, seen.captured).pose;
  EXPECT_EQ(at_seen.source, PoseSource::orb);
  EXPECT_EQ(at_seen.estimate.cameras, camera_bit(3) | camera_bit(1));
  EXPECT_EQ(view.pose(PoseKind::measured, seen.captured).pose->estimate.cameras, camera_bit(3));
  EXPECT_EQ(at_seen.score, 0.8);
  const HistoryPose in_gap = *view.pose(PoseKind::filtered, gap.captured).pose;
  EXPECT_EQ(in_gap.source, PoseSource::prediction);
  EXPECT_EQ(in_gap.state, TrackState::predicting);
  EXPECT_EQ(in_gap.heading_turns, 4) << "the heading is no better known for not being seen";
  EXPECT_EQ(view.pose(PoseKind::filtered, refused.captured).pose->source, PoseSource::prediction);
  EXPECT_EQ(view.pose(PoseKind::measured, refused.captured).pose->source, PoseSource::orb);
}

TEST(PoseHistory, RefusesTimesThatDoNotGoForward) {
  PoseHistory history = filled(3, milliseconds(33));
  EXPECT_FALSE(history.append(entry(milliseconds(66), 9.0)));
  EXPECT_FALSE(history.append(entry(milliseconds(40), 9.0)));
  EXPECT_EQ(history.view().size(), 3U);
  EXPECT_EQ(history.view().newest().filtered->pose.x, 2.0);
  EXPECT_TRUE(history.append(entry(milliseconds(66) + Duration(1), 9.0)));
}

TEST(PoseHistory, DropsWhatIsOlderThanTheAgeLimit) {
  PoseHistory history = filled(5000, milliseconds(10), {.max_age = seconds(2), .max_entries = 100'000});
  const HistoryView view = history.view();
  EXPECT_EQ(view.size(), 201U) << "exactly max_age old still counts";
  EXPECT_EQ(view.newest().captured - view.oldest().captured, seconds(2));
  EXPECT_EQ(view.pose(PoseKind::filtered, view.oldest().captured - Duration(1)).lookup,
            HistoryLookup::before_history);
  EXPECT_LE(history.chunk_count(), 201 / PoseHistory::entries_per_chunk() + 2);
  history.append(entry(seconds(1000), 0.0));
  EXPECT_EQ(history.view().size(), 1U) << "after a long pause only the newest is left";
}

TEST(PoseHistory, HoldsNoMoreThanItsEntriesWhateverIsAppended) {
  for (const std::size_t limit :
       {std::size_t{1}, std::size_t{127}, std::size_t{128}, std::size_t{129}, std::size_t{1000}}) {
    PoseHistory history({.max_age = seconds(1'000'000), .max_entries = limit});
    for (int i = 0; i < 4000; ++i) {
      history.append(entry(milliseconds(i), i));
      ASSERT_EQ(history.view().size(), std::min<std::size_t>(limit, static_cast<std::size_t>(i) + 1));
      ASSERT_LE(history.chunk_count() * PoseHistory::entries_per_chunk(),
                limit + 2 * PoseHistory::entries_per_chunk());
      ASSERT_EQ(history.view().newest().filtered->pose.x, i);
    }
    EXPECT_EQ(history.view().oldest().filtered->pose.x, 4000.0 - static_cast<double>(limit));
  }
}

TEST(PoseHistory, AViewOutlivesWhatTheHistoryDropsAndTheHistoryItself) {
  auto history = std::make_unique<PoseHistory>(HistoryLimits{.max_entries = 100});
  for (int i = 0; i < 100; ++i) history->append(entry(milliseconds(i), i));
  const HistoryView before = history->view();
  for (int i = 100; i < 2000; ++i) history->append(entry(milliseconds(i), i));
  history.reset();
  ASSERT_EQ(before.size(), 100U);
  for (std::size_t i = 0; i < 100; ++i) ASSERT_EQ(before[i].filtered->pose.x, static_cast<double>(i));
  EXPECT_EQ(before.pose(PoseKind::filtered, kStart + milliseconds(100)).lookup, HistoryLookup::after_history);
}

TEST(PoseHistory, ARangeTakesBothOfItsEnds) {
  const HistoryView view = filled(300, milliseconds(10)).view();
  EXPECT_EQ(view.range(kStart + milliseconds(100), kStart + milliseconds(200)), (HistoryRange{10, 21}));
  EXPECT_EQ(view.range(kStart + milliseconds(101), kStart + milliseconds(199)), (HistoryRange{11, 20}));
  EXPECT_EQ(view.range(kStart - seconds(9), kStart + seconds(900)), (HistoryRange{0, 300}));
  EXPECT_EQ(view.range(kStart + milliseconds(101), kStart + milliseconds(109)).size(), 0U);
  EXPECT_EQ(view.range(kStart + milliseconds(200), kStart + milliseconds(100)).size(), 0U);
  EXPECT_EQ(view.range(kStart + seconds(900), kStart + seconds(901)).size(), 0U);
  EXPECT_EQ(HistoryView().range(kStart, kStart + seconds(1)).size(), 0U);
}

TEST(PoseHistory, BadLimitsAreNamed) {
  EXPECT_EQ(check(HistoryLimits{}), "");
  EXPECT_THAT(check(HistoryLimits{.max_age = Duration::zero()}), HasSubstr("max_age is 0 s"));
  EXPECT_THAT(check(HistoryLimits{.max_entries = 0}), HasSubstr("max_entries is 0, must be at least 1"));
  EXPECT_THROW(PoseHistory({.max_age = seconds(-1)}), std::invalid_argument);
}

}  // namespace
}  // namespace skylight
