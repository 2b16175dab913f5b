// Live cameras under the pipeline: times are kept, no camera pushes another out, and stop() waits for nobody.
#include <gmock/gmock.h>

#include "tests/service/live/live_fixture.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

TEST(LivePipeline, AFrameKeepsTheTimeThatItWasStampedWith) {
  LiveRoom room;
  room.clock.advance(milliseconds(500));
  const Time captured = kStart + milliseconds(123);
  room.posted["west"]->post(room.picture(milliseconds(123)), captured, room.clock.now());
  const auto snapshot = room.wait_for([](const Snapshot& s) { return s.cameras[1].frames == 1; });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[1].captured, captured) << "not paced, not shifted to now";
  EXPECT_EQ(snapshot->source, SourceState::running);
  ASSERT_TRUE(snapshot->cameras[1].feed);
  EXPECT_EQ(snapshot->cameras[1].feed->delay, milliseconds(377));
  EXPECT_EQ(snapshot->cameras[0].frames, 0U);
}

TEST(LivePipeline, BothCamerasTrackAndNoneIsDroppedForTheOther) {
  LiveRoom room;
  for (int i = 0; i < 10; ++i) {
    for (const std::size_t camera : {0U, 1U}) {
      const Duration after = milliseconds(33 * i + 10 * static_cast<int>(camera));
      room.posted[camera == 0 ? "east" : "west"]->post(room.picture(after), kStart + after, kStart + after);
    }
    const auto both = [i](const Snapshot& s) {
      return s.cameras[0].frames == static_cast<std::uint64_t>(i) + 1 &&
             s.cameras[1].frames == s.cameras[0].frames;
    };
    ASSERT_TRUE(room.wait_for(both)) << i;
  }
  const auto snapshot = room.pipeline->snapshot();
  EXPECT_EQ(snapshot->cameras[0].dropped + snapshot->cameras[1].dropped, 0U);
  const auto& measured = snapshot->robot("anna")->view.last_measured;
  ASSERT_TRUE(measured);
  EXPECT_LT((measured->pose.position() - room.scene.pictures[0].pose.position()).norm(), 0.002);
}

TEST(LivePipeline, ThePictureOfEachCameraWaitsForATrackerThatIsBusy) {
  LiveRoom room;
  std::promise<void> begun;
  std::promise<void> go;
  auto changing = std::async(std::launch::async, [&] {
    room.pipeline->change([&](Tracker&) {
      begun.set_value();
      go.get_future().wait();
    });
  });
  begun.get_future().wait();
  room.posted["east"]->post(room.picture({}), kStart, kStart);
  room.posted["west"]->post(room.picture(milliseconds(5)), kStart + milliseconds(5), kStart);
  go.set_value();
  changing.get();
  const auto snapshot =
      room.wait_for([](const Snapshot& s) { return s.cameras[0].frames == 1 && s.cameras[1].frames == 1; });
  ASSERT_TRUE(snapshot) << "one picture of each camera waits, whichever came last";
}

TEST(LivePipeline, ACameraWithoutPicturesShowsAlthoughNoFrameEverComes) {
  LiveRoom room;
  const auto snapshot = room.wait_for([](const Snapshot& s) { return s.cameras[0].feed.has_value(); });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[0].feed->state, FeedState::connecting);
}

TEST(LivePipeline, StopDoesNotWaitForCamerasThatAreSilent) {
  LiveRoom room;
  ASSERT_TRUE(room.wait_for([](const Snapshot& s) { return s.source == SourceState::running; }));
  room.pipeline->stop();  // an hour of silence would be waited for here
  EXPECT_THROW(room.pipeline->change([](Tracker&) {}), std::runtime_error);
}

TEST(LivePipeline, ANewStateIsAnEventThatNamesItsCamera) {
  LiveRoom room;
  room.posted["east"]->post(cv::Mat(10, 10, CV_8UC1, cv::Scalar(3)), kStart, kStart);
  const auto snapshot = room.wait_for(
      [](const Snapshot& s) { return s.cameras[0].feed && s.cameras[0].feed->state == FeedState::failed; });
  ASSERT_TRUE(snapshot);
  const EventPage page = room.pipeline->events().read({.kind = "camera.state", .camera = "east"});
  ASSERT_FALSE(page.items.empty());
  EXPECT_THAT(page.items.back()->message, HasSubstr("camera east is failed: "));
  EXPECT_EQ(page.items.back()->severity, Severity::warning);
  EXPECT_EQ(page.items.back()->data["state"], "failed");
}

}  // namespace
}  // namespace skylight::service::test
