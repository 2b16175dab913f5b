// One camera's life, judged by what a script says that the camera did.
#include "service/sources/live/camera_feed.hpp"

#include <gmock/gmock.h>

#include "tests/service/live/scripted_driver.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(CameraFeed, TriesAgainAfterTwiceAsLongEachTimeAndSoonOnceItRan) {
  Scripted camera;
  camera.script.open_failures = {"gone", "gone", "gone", "gone", "gone", "gone", "gone"};
  camera.script.picture(seconds(100), noisy_picture(1));
  camera.script.breaks("unplugged");
  camera.run();
  EXPECT_THAT(camera.script.rests, ElementsAre(milliseconds(500), seconds(1), seconds(2), seconds(4),
                                               seconds(8), seconds(10), seconds(10), milliseconds(500)));
  EXPECT_EQ(camera.script.opens, 9);
}

TEST(CameraFeed, ACameraThatAnswersWithoutAPictureIsNotAskedMoreOften) {
  Scripted camera;
  for (int i = 0; i < 3; ++i) camera.script.breaks("silent");
  camera.run();
  EXPECT_THAT(camera.script.rests, ElementsAre(milliseconds(500), seconds(1), seconds(2)));
}

TEST(CameraFeed, TellsItsStateTheReasonAndSinceWhen) {
  Scripted camera({.kind = "v4l2"});
  EXPECT_EQ(camera.feed->status().state, FeedState::connecting);
  camera.script.open_failures = {"/dev/video9: No such file or directory"};
  camera.script.picture(seconds(7), noisy_picture(1));
  camera.script.breaks("/dev/video9: unplugged");
  camera.script.picture(seconds(20), noisy_picture(2));
  camera.run();
  ASSERT_EQ(camera.states.size(), 4U);
  EXPECT_EQ(camera.states[0].state, FeedState::failed);
  EXPECT_EQ(camera.states[0].since, kMorning);
  EXPECT_THAT(camera.states[0].reason, HasSubstr("No such file"));
  EXPECT_EQ(camera.states[1].state, FeedState::running);
  EXPECT_EQ(camera.states[1].since, kMorning + seconds(7));
  EXPECT_EQ(camera.states[1].reason, "");
  EXPECT_EQ(camera.states[1].reconnects, 1U);
  EXPECT_THAT(camera.states[2].reason, HasSubstr("unplugged"));
  EXPECT_EQ(camera.states[3].reconnects, 2U);
  EXPECT_EQ(camera.states[3].kind, "v4l2");
}

TEST(CameraFeed, RepeatsOfAFrozenPictureAreNeverHandedOn) {
  Scripted camera({.frozen_after = seconds(2)});
  constexpr auto kApart = milliseconds(33);
  for (int i = 0; i < 10; ++i)
    camera.script.picture(kApart * i, noisy_picture(static_cast<std::uint64_t>(i)));
  for (int i = 10; i < 100; ++i) camera.script.picture(kApart * i, noisy_picture(9).clone());
  FeedStatus frozen;
  camera.script.look([&] { frozen = camera.feed->status(); });
  camera.script.picture(kApart * 100, noisy_picture(100));
  camera.run();
  EXPECT_EQ(camera.frames.size(), 11U) << "the ten before and the one after";
  EXPECT_EQ(frozen.state, FeedState::frozen);
  EXPECT_EQ(frozen.since, kMorning + kApart * 9) << "when the picture last changed";
  EXPECT_THAT(frozen.reason, HasSubstr("same picture"));
  EXPECT_EQ(frozen.repeats, 90U);
  EXPECT_EQ(camera.feed->status().state, FeedState::running);
  EXPECT_EQ(camera.feed->status().reconnects, 0U);
}

TEST(CameraFeed, AFewRepeatsAreLeftOutAndAreNoFrozenCamera) {
  Scripted camera({.frozen_after = seconds(2)});
  for (int i = 0; i < 90; ++i)
    camera.script.picture(milliseconds(33) * i, noisy_picture(static_cast<std::uint64_t>(i / 3)));
  camera.run();
  EXPECT_EQ(camera.frames.size(), 30U);
  EXPECT_EQ(camera.states.size(), 1U) << "running all the time";
}

TEST(CameraFeed, AStillSceneIsNoFrozenPictureBecauseASensorIsNeverStill) {
  Scripted camera({.frozen_after = seconds(2)});
  const cv::Mat scene = noisy_picture(1);
  for (int i = 0; i < 150; ++i) {  // one grey level of one pixel
    cv::Mat image = scene.clone();
    image.ptr(20)[7] = static_cast<unsigned char>(100 + i % 2);
    camera.script.picture(milliseconds(33) * i, image);
  }
  camera.run();
  EXPECT_EQ(camera.frames.size(), 150U);
  EXPECT_EQ(camera.feed->status().state, FeedState::running);
}

TEST(CameraFeed, StampsThatStandStillMeanAFrozenPictureToo) {
  Scripted camera({.frozen_after = seconds(2)});
  for (int i = 0; i < 150; ++i) {
    camera.script.picture(milliseconds(33) * i, noisy_picture(static_cast<std::uint64_t>(i)),
                          [i](Shot& picture) { picture.stamp = milliseconds(33) * std::min(i, 60); });
  }
  camera.run();
  EXPECT_EQ(camera.frames.size(), 30U) << "31, after the first second, to 60";
  EXPECT_EQ(camera.feed->status().state, FeedState::frozen);
  EXPECT_THAT(camera.feed->status().reason, HasSubstr("time stamps"));
}

TEST(CameraFeed, NothingIsARepeatWhereTheWatchIsTurnedOff) {
  Scripted camera({.frozen_after = {}});
  for (int i = 0; i < 100; ++i) camera.script.picture(milliseconds(33) * i, noisy_picture(1).clone());
  camera.run();
  EXPECT_EQ(camera.frames.size(), 100U);
  EXPECT_EQ(camera.feed->status().state, FeedState::running);
}

TEST(CameraFeed, APictureOfAnotherSizeIsRefusedByName) {
  Scripted camera({.size_px = {640, 480}});
  camera.script.picture(seconds(1), noisy_picture(1));
  camera.run();
  EXPECT_TRUE(camera.frames.empty());
  EXPECT_EQ(camera.feed->status().state, FeedState::failed);
  EXPECT_THAT(camera.feed->status().reason, testing::AllOf(HasSubstr("32 x 24"), HasSubstr("640 x 480")));
}

TEST(CameraFeed, CountsWhatNeverCameAndWhatCouldNotBeRead) {
  Scripted camera;
  camera.script.picture({}, noisy_picture(1));
  camera.script.picture(milliseconds(100), noisy_picture(2), [](Shot& picture) { picture.lost = 2; });
  camera.script.reads.emplace_back([] { return Shot{.unreadable = "damaged"}; });
  camera.script.picture(milliseconds(200), noisy_picture(3));
  camera.run();
  const FeedStatus status = camera.feed->status();
  EXPECT_EQ(status.received, 3U);
  EXPECT_EQ(status.lost, 2U);
  EXPECT_EQ(status.unreadable, 1U);
  ASSERT_EQ(camera.frames.size(), 3U);
  EXPECT_EQ(camera.frames[0].sequence, 0U);
  EXPECT_EQ(camera.frames[1].sequence, 3U) << "a gap tells of the two";
  EXPECT_EQ(camera.frames[2].sequence, 5U);
}

TEST(CameraFeed, MeasuresItsRateAndForgetsItWhenNothingComes) {
  Scripted camera;
  for (int i = 0; i < 100; ++i)
    camera.script.picture(milliseconds(40) * i, noisy_picture(static_cast<std::uint64_t>(i)));
  FeedStatus running;
  camera.script.look([&] { running = camera.feed->status(); });
  camera.script.look([&] { camera.script.now += seconds(5); });
  camera.run();
  EXPECT_NEAR(running.frame_rate_hz, 25.0, 1e-9);
  EXPECT_EQ(camera.feed->status().frame_rate_hz, 0.0);
}

TEST(CameraFeed, SubtractsTheConfiguredLatencyAndShowsTheDelay) {
  Scripted camera({.latency = milliseconds(120)});
  camera.script.picture(seconds(1), noisy_picture(1));
  camera.script.picture(seconds(2), noisy_picture(2),
                        [](Shot& picture) { picture.captured = picture.arrived - milliseconds(30); });
  camera.run();
  ASSERT_EQ(camera.frames.size(), 2U);
  EXPECT_EQ(camera.frames[0].captured, kMorning + seconds(1) - milliseconds(120));
  EXPECT_EQ(camera.frames[1].captured, kMorning + seconds(2) - milliseconds(150));
  EXPECT_EQ(camera.feed->status().delay, milliseconds(150));
}

TEST(CameraFeed, TimesOnlyGoForward) {
  Scripted camera;
  const auto at = [](Duration after) {
    return [after](Shot& picture) { picture.captured = kMorning + after; };
  };
  camera.script.picture(seconds(1), noisy_picture(1), at(milliseconds(900)));
  camera.script.picture(seconds(2), noisy_picture(2), at(milliseconds(900)));
  camera.script.picture(seconds(3), noisy_picture(3), at(milliseconds(800)));
  camera.script.picture(seconds(4), noisy_picture(4), at(milliseconds(901)));
  camera.run();
  EXPECT_EQ(camera.frames.size(), 2U);
  EXPECT_EQ(camera.feed->status().undated, 2U);
}

TEST(CameraFeed, TheOffsetOfACamerasOwnClockIsShown) {
  Scripted camera;
  for (int i = 0; i < 50; ++i) {  // 25 minutes ahead, at the least 4 ms under way
    const Duration shot = milliseconds(40) * i;
    camera.script.picture(shot + milliseconds(4 + i * 7 % 11), noisy_picture(static_cast<std::uint64_t>(i)),
                          [shot](Shot& picture) {
                            picture.stamp = (kMorning + shot + std::chrono::minutes(25)).time_since_epoch();
                            picture.stamp_is_unix = true;
                          });
  }
  camera.run();
  EXPECT_EQ(camera.feed->status().clock_offset, std::chrono::minutes(25) - milliseconds(4));
}

}  // namespace
}  // namespace skylight::service::test
