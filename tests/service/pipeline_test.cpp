#include "service/pipeline.hpp"

#include <future>

#include <gmock/gmock.h>

#include "service/pose_query.hpp"
#include "tests/service/fakes.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

/// Keeps the tracking thread busy with a change until it is let go.
class Held {
 public:
  explicit Held(Pipeline& pipeline) {
    changing_ = std::async(std::launch::async, [this, &pipeline] {
      pipeline.change([this](Tracker&) {
        begun_.set_value();
        go_.get_future().wait();
      });
    });
    begun_.get_future().wait();
  }
  void let_go() {
    go_.set_value();
    changing_.get();
  }

 private:
  std::promise<void> begun_;
  std::promise<void> go_;
  std::future<void> changing_;
};

TEST(Pipeline, AFrameBecomesASnapshotWithAPose) {
  Rig rig(small_room(), {robot_of(small_room())});
  EXPECT_EQ(rig.pipeline->snapshot()->source, SourceState::starting);
  rig.pipeline->start();
  const auto snapshot = rig.track(6);
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->source, SourceState::running);
  EXPECT_EQ(snapshot->captured, kStart + milliseconds(5 * 33));
  EXPECT_EQ(snapshot->cameras[0].dropped, 0U);
  EXPECT_NEAR(snapshot->cameras[0].frame_rate_hz, 1 / 0.033, 1e-6);
  const RobotSnapshot* robot = snapshot->robot("anna");
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(snapshot->robot("ben"), nullptr);
  EXPECT_EQ(snapshot->camera("wall"), nullptr);
  ASSERT_TRUE(robot->view.last_measured);
  const Pose2 truth = rig.scene.pictures[0].pose;
  EXPECT_LT((robot->view.last_measured->pose.position() - truth.position()).norm(), 0.002);
  EXPECT_EQ(robot->view.state, TrackState::tracking);
}

TEST(Pipeline, TheNewestFrameWinsAndTheOthersAreCounted) {
  Rig rig;
  rig.pipeline->start();
  Held held(*rig.pipeline);
  for (int i = 0; i < 5; ++i) rig.push(milliseconds(i));
  rig.feed->wait_until_taken();
  EXPECT_EQ(rig.pipeline->snapshot()->cameras[0].frames, 0U);
  held.let_go();
  const auto snapshot = rig.wait_for_frames(1);
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[0].dropped, 4U);
  EXPECT_EQ(snapshot->captured, kStart + milliseconds(4)) << "the last one that came";
}

TEST(Pipeline, CaptureTimesAreWholeMicrosecondsSoThatTheySurviveTheWire) {
  Rig rig(small_room(), {robot_of(small_room())});
  rig.clock.advance(Duration(123'456'789));
  rig.pipeline->start();
  const auto snapshot = rig.track(3);
  ASSERT_TRUE(snapshot);
  const Time read_back = from_unix_seconds(unix_seconds(snapshot->captured));
  EXPECT_EQ(read_back, snapshot->captured);
  const PoseAnswer asked_back =
      answer(*snapshot, *snapshot->robot("anna"), {.at = read_back, .kind = PoseKind::measured},
             {.now = rig.clock.now()});
  EXPECT_TRUE(asked_back.pose) << "the very instant of the newest measurement";
}

TEST(Pipeline, AFrameThatCannotBeLookedAtIsCountedAndSkipped) {
  Rig rig;
  rig.pipeline->start();
  rig.track(1);
  Frame small = rig.scene.render(kStart + milliseconds(40));
  small.image = small.image(cv::Rect(0, 0, 100, 100)).clone();
  rig.feed->push(small);
  auto snapshot = rig.wait_for([](const Snapshot& s) { return s.cameras[0].bad_frames == 1; });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[0].frames, 1U);
  EXPECT_EQ(snapshot->captured, kStart) << "a bad frame is not the newest";
  EXPECT_EQ(snapshot->cameras[0].image.cols, 320);
  Frame elsewhere = rig.scene.render(kStart + milliseconds(50));
  elsewhere.camera = 7;
  rig.feed->push(elsewhere);
  rig.feed->wait_until_taken();
  rig.push(milliseconds(60));
  ASSERT_TRUE(rig.wait_for_frames(2)) << "and the next good one is tracked";
}

TEST(Pipeline, PicturesThatTheSourceCouldNotReadAreCounted) {
  Rig rig;
  rig.pipeline->start();
  rig.feed->count_bad();
  rig.feed->count_bad();
  rig.push({});
  auto snapshot = rig.wait_for([](const Snapshot& s) { return s.cameras[0].frames == 1; });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[0].bad_frames, 2U);
  rig.feed->count_bad();
  rig.feed->end();
  snapshot = rig.wait_for([](const Snapshot& s) { return s.source == SourceState::ended; });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[0].bad_frames, 3U) << "those at the very end too";
}

TEST(Pipeline, ASourceThatEndsShows) {
  Rig rig;
  rig.pipeline->start();
  rig.track(2);
  rig.feed->end();
  const auto snapshot = rig.wait_for([](const Snapshot& s) { return s.source == SourceState::ended; });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->source_error, "");
  EXPECT_EQ(snapshot->cameras[0].frames, 2U) << "what was tracked stays";
}

TEST(Pipeline, ASourceThatFailsShowsItsMessage) {
  Rig rig;
  rig.pipeline->start();
  rig.track(1);
  rig.feed->fail("room.mp4: breaks off after 1 of 9 frames");
  const auto snapshot = rig.wait_for([](const Snapshot& s) { return s.source == SourceState::failed; });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->source_error, "room.mp4: breaks off after 1 of 9 frames");
  EXPECT_EQ(snapshot->cameras[0].frames, 1U);
}

TEST(Pipeline, AChangeShowsWhenItReturnsEvenWithoutFrames) {
  Rig rig;
  rig.pipeline->start();
  const RobotSpec anna = robot_of(rig.scene, "anna");
  rig.pipeline->change([&](Tracker& tracker) { tracker.add(anna); });
  ASSERT_NE(rig.pipeline->snapshot()->robot("anna"), nullptr);
  EXPECT_EQ(rig.pipeline->snapshot()->robot("anna")->copies, 1);
  RobotSpec twin = anna;
  twin.id = "twin";
  rig.pipeline->change([&](Tracker& tracker) { tracker.add(twin); });
  EXPECT_EQ(rig.pipeline->snapshot()->robot("anna")->copies, 2) << "they share an appearance";
  rig.pipeline->change([](Tracker& tracker) { tracker.remove("anna"); });
  EXPECT_EQ(rig.pipeline->snapshot()->robot("anna"), nullptr);
  EXPECT_EQ(rig.pipeline->snapshot()->robot("twin")->copies, 1);
}

TEST(Pipeline, AChangeRunsBetweenFramesOnTheTrackingThread) {
  Rig rig;
  rig.pipeline->start();
  std::atomic<bool> done{false};
  std::thread frames([&] {
    for (int i = 0; !done; ++i) {
      rig.push(milliseconds(i));
      rig.feed->wait_until_taken();
    }
  });
  std::thread::id first;
  for (int i = 0; i < 20; ++i) {
    RobotSpec robot = robot_of(rig.scene, "robot" + std::to_string(i));
    std::thread::id ran_on;
    rig.pipeline->change([&](Tracker& tracker) {
      ran_on = std::this_thread::get_id();
      tracker.add(robot);
    });
    EXPECT_NE(rig.pipeline->snapshot()->robot(robot.id), nullptr) << robot.id;
    if (i == 0) first = ran_on;
    EXPECT_EQ(ran_on, first);
    EXPECT_NE(ran_on, std::this_thread::get_id());
    rig.pipeline->change([&](Tracker& tracker) { tracker.remove(robot.id); });
  }
  done = true;
  frames.join();
}

TEST(Pipeline, AChangeThatIsRefusedThrowsToWhoAskedForItAndHarmsNoOther) {
  Rig rig(small_room(), {robot_of(small_room())});
  rig.pipeline->start();
  const RobotSpec again = robot_of(rig.scene);
  EXPECT_THROW(rig.pipeline->change([&](Tracker& tracker) { tracker.add(again); }), std::invalid_argument);
  EXPECT_THROW(rig.pipeline->change([](Tracker&) { throw 7; }), int);
  EXPECT_TRUE(rig.track(2));
  EXPECT_NE(rig.pipeline->snapshot()->robot("anna"), nullptr);
}

TEST(Pipeline, ChangesAfterTheSourceHasEndedStillWork) {
  Rig rig;
  rig.pipeline->start();
  rig.feed->end();
  ASSERT_TRUE(rig.wait_for([](const Snapshot& s) { return s.source == SourceState::ended; }));
  const RobotSpec anna = robot_of(rig.scene);
  rig.pipeline->change([&](Tracker& tracker) { tracker.add(anna); });
  EXPECT_NE(rig.pipeline->snapshot()->robot("anna"), nullptr);
}

RobotSpec with_motion_filter() {
  RobotSpec robot = robot_of(small_room());
  robot.filter = MotionFilterConfig{};
  return robot;
}

void standing(Pipeline& pipeline) {
  for (int i = 0; i < 25; ++i) {
    const Time at = kStart + milliseconds(20 * i);
    pipeline.odometry().hear("anna", {{.stamp = at, .velocity = {}}}, at);
  }
}

TEST(Pipeline, WhatARobotSaysOfItselfGoesToTheFrameThatIsAsNewAndNoEarlier) {
  // Every 20 ms for half a second that it stands: of the eight frames, and of later instants than they show.
  const auto after_eight_frames = [](bool talks) {
    Rig rig(small_room(), {with_motion_filter()});
    rig.pipeline->start();
    if (talks) standing(*rig.pipeline);
    const auto snapshot = rig.track(8);
    return snapshot ? snapshot->robot("anna")->view : RobotView{};
  };
  const RobotView silent = after_eight_frames(false);
  const RobotView told = after_eight_frames(true);
  ASSERT_TRUE(silent.filter && told.filter);
  const Time last = kStart + milliseconds(7 * 33);
  ASSERT_TRUE(told.filter->predict(last)) << "the filter knows nothing of later than the frame";
  EXPECT_EQ(told.history.newest().filtered->at, last);
  const auto speed = [&](const RobotView& view) {
    const Velocity2 v = view.filter->predict(last)->velocity;
    return std::hypot(v.x, v.y);
  };
  EXPECT_LT(speed(told), 0.5 * speed(silent)) << "who says that it stands is believed";
}

TEST(Pipeline, WhoSpeaksForItselfNeverWaitsForTheTracker) {
  Rig rig(small_room(), {with_motion_filter()});
  rig.pipeline->start();
  Held held(*rig.pipeline);  // which would hold up a change for as long
  OdometryInbox& inbox = rig.pipeline->odometry();
  std::vector<std::thread> connections;
  for (int c = 0; c < 4; ++c) {
    connections.emplace_back([&, c] {
      for (int i = 0; i < 500; ++i) inbox.hear("anna", {{}}, kStart + milliseconds(8) * (4 * i + c));
    });
  }
  for (std::thread& connection : connections) connection.join();
  EXPECT_EQ(inbox.dropped(), 1000U) << "of 2000 the oldest";
  held.let_go();
  ASSERT_TRUE(rig.track(3));
  EXPECT_EQ(rig.pipeline->snapshot()->cameras[0].frames, 3U);
}

TEST(Pipeline, ARobotThatIsGoneIsForgottenWithWhatItSaid) {
  Rig rig(small_room(), {with_motion_filter()});
  rig.pipeline->start();
  standing(*rig.pipeline);
  EXPECT_TRUE(rig.pipeline->odometry().newest("anna"));
  rig.pipeline->change([](Tracker& tracker) { tracker.remove("anna"); });
  EXPECT_FALSE(rig.pipeline->odometry().newest("anna"));
}

std::string outcome_of(std::future<void>& change) {
  try {
    change.get();
    return "done";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

Recalibration calibration(const std::string& camera, const CameraModel& model,
                          const CameraUncertainty& uncertainty = {}) {
  return {.camera = camera,
          .calibration =
              std::make_shared<const CalibrationInUse>(CalibrationInUse{calibration_of(model, uncertainty)})};
}

TEST(Pipeline, AnotherCalibrationOfACameraShowsInSnapshotsAndPoses) {
  Rig rig(small_room(), {robot_of(small_room())});
  rig.pipeline->start();
  const auto before = rig.track(6);
  ASSERT_TRUE(before);
  EXPECT_TRUE(uncertainty_of(before->cameras[0].calibration->document).covariance.isZero(0.0));
  CameraParameters by = CameraParameters::Zero();
  by[kCameraPosition] = 0.004;
  const CameraModel model = moved(rig.scene.camera(), by);
  rig.pipeline->recalibrate({calibration("ceiling", model, camera_uncertainty({.position_m = 0.001}))});
  const auto told = rig.pipeline->snapshot();
  EXPECT_EQ(told->cameras[0].model->map_from_camera().translation(), model.map_from_camera().translation());
  EXPECT_EQ(told->cameras[0].calibration->document.sigmas.position_m[0], 0.001);
  const auto after = rig.track(1);
  ASSERT_TRUE(after);
  const Observation& was = *before->robots[0].view.last_measured;
  const Observation& is = *after->robots[0].view.last_measured;
  EXPECT_NEAR(is.pose.x - was.pose.x, 0.004, 1e-4);
  EXPECT_NEAR(is.correlated(0, 0), 1e-6, 2e-7);
}

TEST(Pipeline, ACalibrationOfNoCameraOrAnotherPictureIsRefused) {
  Rig rig;
  rig.pipeline->start();
  const CameraModel model = rig.scene.camera();
  EXPECT_THAT([&] { rig.pipeline->recalibrate({calibration("attic", model)}); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("there is no camera 'attic'")));
  Intrinsics other = model.intrinsics();
  other.width_px += 2;
  EXPECT_THROW(
      rig.pipeline->recalibrate({calibration("ceiling", CameraModel(other, model.map_from_camera()))}),
      std::invalid_argument);
}

TEST(Pipeline, StoppingAnswersEveryPendingChange) {
  Rig rig;
  rig.pipeline->start();
  Held held(*rig.pipeline);
  std::vector<std::future<void>> pending;
  for (int i = 0; i < 4; ++i)
    pending.push_back(std::async(std::launch::async, [&] { rig.pipeline->change([](Tracker&) {}); }));
  rig.feed->end();
  std::thread stopper([&] { rig.pipeline->stop(); });
  std::this_thread::sleep_for(
      milliseconds(20));  // so that stopping mostly comes first; both orders are right
  held.let_go();
  stopper.join();
  for (auto& change : pending)
    EXPECT_THAT(outcome_of(change), testing::AnyOf("done", "the service is stopping"));
  EXPECT_THROW(rig.pipeline->change([](Tracker&) {}), std::runtime_error);
}

TEST(Pipeline, StoppingOneThatNeverStartedAnswersToo) {
  Rig rig;
  auto pending = std::async(std::launch::async, [&] { rig.pipeline->change([](Tracker&) {}); });
  std::this_thread::sleep_for(milliseconds(20));
  rig.pipeline->stop();
  EXPECT_EQ(outcome_of(pending), "the service is stopping");
}

TEST(Pipeline, StopsAtOnceThoughTheNextFrameIsDueInAnHour) {
  Rig rig;
  rig.pipeline->start();
  rig.track(1);
  rig.push(std::chrono::hours(1));
  rig.feed->end();
  const auto begin = std::chrono::steady_clock::now();
  rig.pipeline->stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::minutes(5));
}

// What a reader checks of one snapshot; empty where all is well. `image` pixels of a frame share one value
// in their corners, so that a torn picture shows.
std::string wrong_with(const Snapshot& snapshot) {
  const CameraSnapshot& camera = snapshot.cameras[0];
  if (!camera.image.empty()) {
    const auto first = camera.image.at<cv::Vec3b>(0, 0);
    const auto last = camera.image.at<cv::Vec3b>(camera.image.rows - 1, camera.image.cols - 1);
    if (first != last) return "a picture of two frames";
  }
  for (const RobotSnapshot& robot : snapshot.robots) {
    if (robot.spec->id != robot.view.id) return "settings of another robot";
    const HistoryView& history = robot.view.history;
    for (std::size_t i = 1; i < history.size(); ++i) {
      if (history[i].captured <= history[i - 1].captured) return "a history out of order";
    }
    if (!history.empty() && history.newest().captured > snapshot.captured)
      return "a history newer than its snapshot";
    answer(snapshot, robot, {}, {.now = snapshot.captured});
    if (!history.empty()) answer(snapshot, robot, {.kind = PoseKind::predicted}, {.now = snapshot.captured});
  }
  return {};
}

// Under the thread sanitizer this is the proof that readers need no lock.
TEST(Pipeline, SnapshotsStayWhatTheyWereWhileReadersHoldThem) {
  Rig rig(small_room(), {robot_of(small_room())});
  rig.pipeline->start();
  std::atomic<bool> done{false};
  std::vector<std::future<std::string>> readers;
  for (int r = 0; r < 3; ++r) {
    readers.push_back(std::async(std::launch::async, [&]() -> std::string {
      const auto held = rig.pipeline->snapshot();
      const std::size_t entries = held->robots.empty() ? 0 : held->robots[0].view.history.size();
      std::uint64_t sequence = 0;
      while (!done) {
        const auto snapshot = rig.pipeline->snapshot();
        if (snapshot->sequence < sequence) return "went back";
        sequence = snapshot->sequence;
        if (auto wrong = wrong_with(*snapshot); !wrong.empty()) return wrong;
      }
      if (!held->robots.empty() && held->robots[0].view.history.size() != entries) return "changed";
      return wrong_with(*held);
    }));
  }
  const cv::Mat scene = rig.scene.render().image;
  const RobotSpec ben = robot_of(rig.scene, "ben");
  for (int i = 0; i < 80; ++i) {
    Frame frame{.captured = kStart + milliseconds(i), .image = scene.clone(), .depth = {}};
    const cv::Vec3b mark(static_cast<uchar>(i), 0, 0);
    frame.image.at<cv::Vec3b>(0, 0) = mark;
    frame.image.at<cv::Vec3b>(frame.image.rows - 1, frame.image.cols - 1) = mark;
    rig.feed->push(std::move(frame));
    rig.feed->wait_until_taken();
    if (i % 10 == 3) rig.pipeline->change([&](Tracker& tracker) { tracker.add(ben); });
    if (i % 10 == 8) rig.pipeline->change([](Tracker& tracker) { tracker.remove("ben"); });
  }
  done = true;
  for (auto& reader : readers) EXPECT_EQ(reader.get(), "");
}

}  // namespace
}  // namespace skylight::service::test
