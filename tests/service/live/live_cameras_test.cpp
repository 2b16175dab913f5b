// Several cameras as one source, driven by threads that the tests hold in their hands.
#include "service/sources/live/live_cameras.hpp"

#include <atomic>
#include <future>

#include <gmock/gmock.h>

#include "service/sources/live/posted_camera.hpp"
#include "tests/service/live/scripted_driver.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// Posted pictures are a camera that a test can play.
struct Cameras {
  explicit Cameras(std::size_t count, Duration silence = std::chrono::hours(1)) {
    std::vector<LiveCameras::Camera> cameras;
    for (std::size_t i = 0; i < count; ++i) {
      posted.push_back(
          std::make_shared<PostedPictures>(PostedOptions{.size_px = {32, 24}, .silence = silence}));
      cameras.push_back(
          {.options = {.kind = "posted", .shortest_rest = milliseconds(1), .longest_rest = milliseconds(1)},
           .driver = std::make_unique<PostedCamera>(posted.back())});
    }
    source = std::make_unique<LiveCameras>(std::move(cameras));
  }
  void post(std::size_t camera, int number) {
    const Time at = kMorning + milliseconds(number);
    posted[camera]->post(noisy_picture(static_cast<std::uint64_t>(number)), at, at);
  }
  /// Until its feed has handed on so many.
  void wait_for(std::size_t camera, std::uint64_t received) const {
    while (source->feeds()[camera].received < received) std::this_thread::yield();
  }

  std::vector<std::shared_ptr<PostedPictures>> posted;
  std::unique_ptr<LiveCameras> source;
};

TEST(LiveCameras, FramesOfAllCamerasComeInTheOrderOfTheirArrival) {
  Cameras cameras(2);
  auto first = std::async(std::launch::async, [&] { return cameras.source->next(); });
  cameras.post(1, 1);
  EXPECT_EQ(first.get()->camera, 1U);
  cameras.post(1, 2);
  cameras.wait_for(1, 2);
  cameras.post(0, 3);
  cameras.wait_for(0, 1);
  const auto second = cameras.source->next();
  const auto third = cameras.source->next();
  EXPECT_EQ(second->camera, 1U);
  EXPECT_EQ(second->captured, kMorning + milliseconds(2));
  EXPECT_EQ(third->camera, 0U);
}

TEST(LiveCameras, ASlowReaderFindsTheNewestOfEachCameraAndTheRestCounted) {
  Cameras cameras(2);
  auto first = std::async(std::launch::async, [&] { return cameras.source->next(); });
  cameras.post(0, 1);
  first.get();
  cameras.post(1, 2);
  cameras.wait_for(1, 1);
  for (int i = 2; i <= 20; ++i) {
    cameras.post(0, i);
    cameras.wait_for(0, static_cast<std::uint64_t>(i));
  }
  EXPECT_EQ(cameras.source->next()->camera, 1U) << "a fast camera does not push a slow one out";
  const auto newest = cameras.source->next();
  EXPECT_EQ(newest->camera, 0U);
  EXPECT_EQ(newest->captured, kMorning + milliseconds(20));
  EXPECT_EQ(cameras.source->feeds()[0].overtaken, 18U);
  EXPECT_EQ(cameras.source->feeds()[1].overtaken, 0U);
}

TEST(LiveCameras, InterruptEndsAReaderThatWaitsAndTheCamerasToo) {
  Cameras cameras(2);
  auto frame = std::async(std::launch::async, [&] { return cameras.source->next(); });
  cameras.source->interrupt();
  EXPECT_FALSE(frame.get());
  EXPECT_FALSE(cameras.source->next());
  cameras.source.reset();  // joins its threads: an hour of silence would be waited for here
}

TEST(LiveCameras, OneThatFailsKeepsNoOtherFromRunningAndTheWatcherIsTold) {
  Script script;
  script.open_failures = {"/dev/video9: No such file or directory"};
  script.at_end = [] {};
  auto posted = std::make_shared<PostedPictures>(PostedOptions{.silence = std::chrono::hours(1)});
  std::vector<LiveCameras::Camera> list;
  list.push_back({.options = {.kind = "v4l2",
                              .shortest_rest = std::chrono::hours(1),
                              .longest_rest = std::chrono::hours(1)},
                  .driver = std::make_unique<ScriptedDriver>(script)});
  list.push_back({.options = {.kind = "posted"}, .driver = std::make_unique<PostedCamera>(posted)});
  LiveCameras source(std::move(list));
  std::promise<void> failed;
  std::atomic<bool> told{false};
  source.watch([&] {
    if (source.feeds()[0].state == FeedState::failed && !told.exchange(true)) failed.set_value();
  });
  auto frame = std::async(std::launch::async, [&] { return source.next(); });
  failed.get_future().wait();
  posted->post(noisy_picture(1), kMorning, kMorning);
  EXPECT_EQ(frame.get()->camera, 1U);
  EXPECT_EQ(source.feeds()[0].state, FeedState::failed);
  source.watch({});
}

TEST(PostedCamera, SilenceIsAFailureAndTheNextPictureEndsIt) {
  Cameras cameras(1, milliseconds(5));
  auto frame = std::async(std::launch::async, [&] { return cameras.source->next(); });
  while (cameras.source->feeds()[0].state != FeedState::failed) std::this_thread::yield();
  cameras.post(0, 1);
  EXPECT_TRUE(frame.get());
  EXPECT_EQ(cameras.source->feeds()[0].reconnects, 1U);
}

TEST(PostedCamera, TheNewestWaitsAndThoseBeforeItCountAsLost) {
  PostedPictures pictures({.size_px = {32, 24}});
  for (int i = 0; i < 4; ++i) pictures.post(noisy_picture(1), kMorning + seconds(i), kMorning);
  const auto picture = pictures.take();
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->lost, 3U);
  EXPECT_EQ(picture->captured, kMorning + seconds(3));
}

}  // namespace
}  // namespace skylight::service::test
