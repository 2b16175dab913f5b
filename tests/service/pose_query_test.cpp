#include "service/pose_query.hpp"

#include <numeric>

#include <gmock/gmock.h>

#include "tests/service/line_history.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kFrames = 300;       // the filter has long settled
constexpr double kSettled = 1e-6;  // metres that the settling still moves it by

PoseAnswer ask(const Line& line, const PoseQuery& query, Duration since_newest = milliseconds(20)) {
  return answer(line.snapshot, line.robot, query, {.now = line.newest + since_newest});
}

std::string refusal(const Line& line, const PoseQuery& query) {
  try {
    ask(line, query);
  } catch (const QueryError& error) {
    return error.what();
  }
  return "answered";
}

TEST(PoseQuery, NowIsTheNewestFrameAsTheFilterSeesIt) {
  const Line line(kFrames);
  const PoseAnswer a = ask(line, {});
  ASSERT_TRUE(a.pose);
  EXPECT_EQ(a.robot, "anna");
  EXPECT_EQ(a.state, TrackState::tracking);
  EXPECT_THAT(a.reason, IsEmpty());
  EXPECT_EQ(a.last_seen, line.newest);
  EXPECT_EQ(a.pose->kind, PoseKind::filtered);
  EXPECT_EQ(a.pose->source, PoseSource::align);
  EXPECT_EQ(a.pose->captured, line.newest);
  EXPECT_EQ(a.pose->estimate.at, line.newest);
  EXPECT_EQ(a.pose->horizon, Duration::zero());
  EXPECT_THAT(a.pose->cameras, ElementsAre("ceiling"));
  EXPECT_NEAR(a.pose->estimate.pose.x, Line::kStep * (kFrames - 2), kSettled);  // one frame behind
  EXPECT_NEAR(a.pose->estimate.pose.y, 2.0, kSettled);
  EXPECT_NEAR(a.pose->estimate.velocity.x, 0.1, 1e-5);
}

TEST(PoseQuery, APoseOfACameraThatWasMovedSaysSoAlsoLater) {
  Line line(kFrames);
  CameraSnapshot& camera = line.snapshot.cameras[0];
  EXPECT_THAT(ask(line, {}).pose->warnings, IsEmpty());
  camera.moved = {{.from = Line::at(100), .until = Line::at(200)}};
  const auto at = [&](int frame) { return ask(line, {.at = Line::at(frame)}).pose->warnings; };
  EXPECT_THAT(at(99), IsEmpty());
  EXPECT_THAT(at(100), ElementsAre("camera ceiling was moved"));
  EXPECT_THAT(at(200), ElementsAre("camera ceiling was moved"));
  EXPECT_THAT(at(201), IsEmpty());
  camera.moved.push_back({.from = Line::at(250)});
  EXPECT_THAT(ask(line, {}).pose->warnings, ElementsAre("camera ceiling was moved"));
  EXPECT_THAT(ask(line, {.kind = PoseKind::predicted}).pose->warnings,
              ElementsAre("camera ceiling was moved"));
}

TEST(PoseQuery, NowMeasuredIsWhatTheNewestFrameShows) {
  const PoseAnswer a = ask(Line(kFrames), {.kind = PoseKind::measured});
  ASSERT_TRUE(a.pose);
  EXPECT_EQ(a.pose->kind, PoseKind::measured);
  EXPECT_EQ(a.pose->estimate.pose, (Pose2{Line::kStep * (kFrames - 1), 2.0, 0.5}));
  EXPECT_DOUBLE_EQ(a.pose->score, 0.9);
}

TEST(PoseQuery, NowMeasuredIsNoPoseWhereTheNewestFrameDoesNotShowTheRobot) {
  const Line line(kFrames, {kFrames - 1});
  const PoseAnswer a = ask(line, {.kind = PoseKind::measured});
  EXPECT_FALSE(a.pose);
  EXPECT_EQ(a.reason, "covered");
  EXPECT_EQ(a.state, TrackState::predicting);
  EXPECT_EQ(a.last_seen, Line::at(kFrames - 2));
  EXPECT_TRUE(ask(line, {}).pose) << "the filter carries on through the gap";
}

TEST(PoseQuery, NowPredictedIsCarriedToThePresent) {
  const Line line(kFrames);
  const PoseAnswer a = ask(line, {.kind = PoseKind::predicted}, milliseconds(300));
  ASSERT_TRUE(a.pose);
  EXPECT_EQ(a.pose->kind, PoseKind::predicted);
  EXPECT_EQ(a.pose->source, PoseSource::prediction);
  EXPECT_EQ(a.pose->captured, line.newest);
  EXPECT_EQ(a.pose->horizon, milliseconds(300));
  EXPECT_EQ(a.pose->estimate.at, line.newest + milliseconds(300));
  EXPECT_NEAR(a.pose->estimate.pose.x, Line::kStep * (kFrames - 2) + 0.1 * 0.3, 1e-5);
  EXPECT_GT(a.pose->estimate.covariance(0, 0), ask(line, {}).pose->estimate.covariance(0, 0));
}

TEST(PoseQuery, APredictionForAClockBehindTheNewestFrameIsForThatFrame) {
  const Line line(kFrames);
  const PoseAnswer a = ask(line, {.kind = PoseKind::predicted}, milliseconds(-50));
  ASSERT_TRUE(a.pose);
  EXPECT_EQ(a.pose->horizon, Duration::zero());
  EXPECT_EQ(a.pose->estimate.at, line.newest);
}

TEST(PoseQuery, ThePastIsInterpolatedBetweenFrames) {
  const Line line(kFrames);
  const PoseAnswer filtered = ask(line, {.at = Line::at(200.25)});
  ASSERT_TRUE(filtered.pose);
  EXPECT_EQ(filtered.pose->kind, PoseKind::filtered);
  EXPECT_EQ(filtered.pose->horizon, Duration::zero());
  EXPECT_NEAR(filtered.pose->estimate.pose.x, Line::kStep * 199.25, kSettled);
  EXPECT_EQ(filtered.pose->captured, Line::at(201)) << "the later of the two frames went into it";
  const PoseAnswer measured = ask(line, {.at = Line::at(200.25), .kind = PoseKind::measured});
  ASSERT_TRUE(measured.pose);
  EXPECT_NEAR(measured.pose->estimate.pose.x, Line::kStep * 200.25, 1e-12);
}

TEST(PoseQuery, ThePastHasTheStateOfThen) {
  const Line line(kFrames, {100});
  EXPECT_EQ(ask(line, {.at = Line::at(100)}).state, TrackState::predicting);
  EXPECT_EQ(ask(line, {.at = Line::at(150)}).state, TrackState::tracking);
  const PoseAnswer early = ask(line, {.at = Line::at(3)});
  EXPECT_EQ(early.state, TrackState::calibrating);
  EXPECT_FALSE(early.pose);
  EXPECT_THAT(early.reason, HasSubstr("calibrating"));
}

TEST(PoseQuery, AMeasurementIsNotMadeUpAcrossALongGap) {
  const Line line(kFrames, {100, 101, 102, 103, 104, 105, 106, 107});
  const PoseAnswer a = ask(line, {.at = Line::at(103.5), .kind = PoseKind::measured});
  EXPECT_FALSE(a.pose);
  EXPECT_THAT(a.reason, HasSubstr("not observed at that instant"));
}

TEST(PoseQuery, AnInstantBeforeTheHistoryIsRefusedWithTheOldest) {
  const Line line(kFrames);
  EXPECT_THAT(refusal(line, {.at = kStart - milliseconds(1)}),
              HasSubstr("oldest instant that is kept, 1700000000.000000"));
  EXPECT_EQ(refusal(line, {.at = kStart}), "answered") << "the oldest itself is within";
}

TEST(PoseQuery, TheFutureIsPredictedUpToTheHorizonAndNoFurther) {
  const Line line(kFrames);
  const PoseAnswer a = ask(line, {.at = line.newest + std::chrono::seconds(2)});
  ASSERT_TRUE(a.pose);
  EXPECT_EQ(a.pose->kind, PoseKind::predicted);
  EXPECT_NEAR(a.pose->estimate.pose.x, Line::kStep * (kFrames - 2) + 0.1 * 2.0, 1e-4);
  const std::string why = refusal(line, {.at = line.newest + std::chrono::microseconds(2'000'001)});
  EXPECT_THAT(why, HasSubstr("beyond the horizon of 2.000000 s"));
  EXPECT_THAT(why, HasSubstr("1700000029.900000")) << "names the newest frame";
}

TEST(PoseQuery, KindsThatCannotBeAtAnInstantAreRefused) {
  const Line line(kFrames);
  EXPECT_THAT(refusal(line, {.at = line.newest + milliseconds(1), .kind = PoseKind::measured}),
              HasSubstr("kind is measured, but at is after the newest frame at 1700000029.900000"));
  EXPECT_THAT(refusal(line, {.at = line.newest, .kind = PoseKind::predicted}),
              HasSubstr("kind is predicted, but at is not after the newest frame at 1700000029.900000"));
  EXPECT_THAT(refusal(line, {.kind = PoseKind::smoothed}),
              HasSubstr("allowed measured, filtered, predicted"));
  EXPECT_THAT(refusal(line, {.at = Line::at(10), .kind = PoseKind::smoothed}), HasSubstr("no smoother"));
}

TEST(PoseQuery, SmoothedAtTheNewestFrameIsTheFilteredPose) {
  const Line line(kFrames, {}, Line::motion());
  const PoseAnswer smoothed = ask(line, {.kind = PoseKind::smoothed});
  const PoseAnswer filtered = ask(line, {.kind = PoseKind::filtered});
  ASSERT_TRUE(smoothed.pose && filtered.pose);
  EXPECT_EQ(smoothed.pose->kind, PoseKind::smoothed);
  EXPECT_EQ(smoothed.pose->captured, line.newest);
  EXPECT_EQ(smoothed.pose->source, PoseSource::align);
  EXPECT_NEAR(smoothed.pose->estimate.pose.x, filtered.pose->estimate.pose.x, 1e-9);
  EXPECT_NEAR(smoothed.pose->estimate.covariance(0, 0), filtered.pose->estimate.covariance(0, 0), 1e-12);
}

TEST(PoseQuery, SmoothedIsThereForEveryInstantSettledOrNot) {
  // The history knows those that are final, the filter the rest; no instant between them falls through.
  const Line line(kFrames, {}, Line::motion());
  const HistoryView& history = line.robot.view.history;
  ASSERT_GT(history.settled(), 250U);
  ASSERT_LT(history.settled(), history.size());
  for (double frame = 250.0; frame <= kFrames - 1; frame += 0.25) {
    const PoseAnswer smoothed = ask(line, {.at = Line::at(frame), .kind = PoseKind::smoothed});
    ASSERT_TRUE(smoothed.pose) << "frame " << frame << ": " << smoothed.reason;
    EXPECT_EQ(smoothed.pose->kind, PoseKind::smoothed);
    EXPECT_EQ(smoothed.pose->estimate.at, Line::at(frame));
    EXPECT_NEAR(smoothed.pose->estimate.pose.x, Line::kStep * frame, 2e-4) << "frame " << frame;
    EXPECT_NEAR(smoothed.pose->estimate.velocity.x, 0.1, 2e-3) << "frame " << frame;
  }
}

TEST(PoseQuery, LaterDataMakesASmoothedPoseSurer) {
  const Line line(kFrames, {}, Line::motion());
  for (const double back : {3.0, 20.0, 200.0}) {  // not final yet, just final, long final
    const Time at = Line::at(kFrames - 1 - back);
    const PoseAnswer smoothed = ask(line, {.at = at, .kind = PoseKind::smoothed});
    const PoseAnswer filtered = ask(line, {.at = at, .kind = PoseKind::filtered});
    ASSERT_TRUE(smoothed.pose && filtered.pose);
    EXPECT_LT(smoothed.pose->estimate.covariance(0, 0), 0.9 * filtered.pose->estimate.covariance(0, 0))
        << back;
  }
}

TEST(PoseQuery, AGapIsBridgedFromBothItsEnds) {
  const Line line(kFrames, {100, 101, 102, 103, 104, 105, 106, 107}, Line::motion());
  const auto at = [&](double frame, PoseKind kind) {
    return ask(line, {.at = Line::at(frame), .kind = kind}).pose.value();
  };
  for (const double frame : {103.0, 103.5, 107.0}) {
    const PublishedPose smoothed = at(frame, PoseKind::smoothed);
    EXPECT_EQ(smoothed.source, PoseSource::prediction);
    EXPECT_NEAR(smoothed.estimate.pose.x, Line::kStep * frame, 2e-3);
    EXPECT_LT(smoothed.estimate.covariance(0, 0), at(frame, PoseKind::filtered).estimate.covariance(0, 0));
    EXPECT_GT(smoothed.estimate.covariance(0, 0), at(90, PoseKind::smoothed).estimate.covariance(0, 0));
  }
}

TEST(PoseQuery, WhereTheRobotWasLostThereIsNoSmoothedPoseEither) {
  std::vector<int> unseen(100);
  std::iota(unseen.begin(), unseen.end(), 100);  // ten seconds, of which five are carried over
  const Line line(kFrames, unseen, Line::motion());
  const PoseAnswer a = ask(line, {.at = Line::at(180), .kind = PoseKind::smoothed});
  EXPECT_FALSE(a.pose);
  EXPECT_EQ(a.state, TrackState::lost);
  EXPECT_THAT(a.reason, HasSubstr("lost"));
  EXPECT_TRUE(ask(line, {.at = Line::at(250), .kind = PoseKind::smoothed}).pose) << "found again";
}

TEST(PoseQuery, SmoothedAfterTheNewestFrameIsRefused) {
  const Line line(kFrames, {}, Line::motion());
  EXPECT_THAT(refusal(line, {.at = line.newest + milliseconds(1), .kind = PoseKind::smoothed}),
              HasSubstr("kind is smoothed, but at is after the newest frame at 1700000029.900000"));
}

TEST(PoseQuery, NothingStaleLooksFresh) {
  Line line(kFrames);
  EXPECT_TRUE(ask(line, {}, std::chrono::seconds(2)).pose) << "as old as the horizon will do";
  for (const auto kind : {PoseKind::measured, PoseKind::filtered, PoseKind::predicted}) {
    const PoseAnswer a = ask(line, {.kind = kind}, milliseconds(2100));
    EXPECT_FALSE(a.pose) << to_string(kind);
    EXPECT_EQ(a.state, TrackState::lost);
    EXPECT_EQ(a.reason, "the newest frame is 2.1 s old");
    EXPECT_EQ(a.last_seen, line.newest);
  }
  line.snapshot.source = SourceState::ended;
  EXPECT_THAT(ask(line, {}, milliseconds(2100)).reason, HasSubstr("the source has ended"));
  line.snapshot.source = SourceState::failed;
  line.snapshot.source_error = "room.mp4: breaks off";
  EXPECT_THAT(ask(line, {}, milliseconds(2100)).reason, HasSubstr("room.mp4: breaks off"));
  EXPECT_TRUE(ask(line, {.at = Line::at(100)}, std::chrono::hours(1)).pose) << "the past stays the past";
}

TEST(PoseQuery, BeforeTheFirstFrameThereIsNoPoseAndAReason) {
  Line line(0);
  EXPECT_FALSE(ask(line, {}).pose);
  EXPECT_EQ(ask(line, {}).reason, "no frame yet");
  EXPECT_EQ(ask(line, {}).state, TrackState::searching);
  EXPECT_FALSE(ask(line, {.at = kStart}).last_seen);
  line.snapshot.source = SourceState::failed;
  line.snapshot.source_error = "no such camera";
  EXPECT_EQ(ask(line, {}).reason, "no such camera");
}

TEST(PoseQuery, ARobotThatWasNeverSeenIsSearchedFor) {
  const Line line(3, {0, 1, 2});
  for (const PoseQuery& query : {PoseQuery{}, PoseQuery{.at = line.newest + milliseconds(10)},
                                 PoseQuery{.kind = PoseKind::measured}}) {
    const PoseAnswer a = ask(line, query);
    EXPECT_FALSE(a.pose);
    EXPECT_EQ(a.state, TrackState::searching);
    EXPECT_EQ(a.reason, "covered");
    EXPECT_FALSE(a.last_seen);
  }
  EXPECT_THAT(ask(line, {.at = Line::at(1)}).reason, HasSubstr("searching"));
}

TEST(PoseQuery, ACalibratingRobotIsMeasuredButNotYetFiltered) {
  const Line line(4);
  const PoseAnswer a = ask(line, {});
  EXPECT_FALSE(a.pose);
  EXPECT_EQ(a.state, TrackState::calibrating);
  EXPECT_THAT(a.reason, HasSubstr("calibrating"));
  EXPECT_EQ(a.last_seen, line.newest);
  EXPECT_TRUE(ask(line, {.kind = PoseKind::measured}).pose);
}

TEST(PoseQuery, AmongCopiesThatNothingTellsApartIdentityIsAGuess) {
  Line line(kFrames);
  EXPECT_DOUBLE_EQ(ask(line, {}).identity_confidence, 1.0);
  line.robot.copies = 4;
  EXPECT_DOUBLE_EQ(ask(line, {}).identity_confidence, 0.25);
}

TEST(PoseQuery, AnInstantSurvivesTheWire) {
  const Time odd = kStart + std::chrono::microseconds(123'457);
  EXPECT_EQ(from_unix_seconds(unix_seconds(odd)), odd);
  EXPECT_EQ(unix_seconds(odd + Duration(499)), unix_seconds(odd)) << "to the nearest microsecond";
  EXPECT_EQ(unix_seconds(odd + Duration(501)), unix_seconds(odd + std::chrono::microseconds(1)));
}

}  // namespace
}  // namespace skylight::service::test
