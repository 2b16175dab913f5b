// The V4L2 driver over a kernel that the tests play.
#include "service/sources/live/v4l2_camera.hpp"

#include <gmock/gmock.h>

#include "service/sources/live/camera_feed.hpp"
#include "tests/service/live/fake_v4l2.hpp"
#include "tests/service/live/scripted_driver.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::AllOf;
using testing::HasSubstr;

class V4l2 : public testing::Test {
 protected:
  V4l2() {
    options_.device = "/dev/v4l/by-path/pci-0000:00:14.0-usb-0:2:1.0-video-index0";
    options_.format = PixelFormat::grey;
    options_.size_px = {4, 2};
    options_.clock = [this] { return now_; };
  }

  V4l2Camera& camera() {
    if (!camera_) camera_ = std::make_unique<V4l2Camera>(options_, std::make_unique<FakeV4l2>(device_));
    return *camera_;
  }
  /// A grey picture whose first pixel is its number, taken so long before now by the monotonic clock.
  Device::Filled filled(std::uint32_t sequence, Duration ago = {}) const {
    std::vector<unsigned char> bytes(8, 100);
    bytes[0] = static_cast<unsigned char>(sequence);
    return {.bytes = bytes, .stamp = device_->monotonic - ago, .sequence = sequence};
  }
  Shot read(const std::vector<Device::Filled>& ready) {
    device_->turns.push_back(ready);
    return camera().read();
  }
  std::string refusal() {
    try {
      camera().open();
    } catch (const SourceError& error) {
      return error.what();
    }
    return "opened";
  }

  Time now_ = kMorning;
  V4l2Options options_;
  std::shared_ptr<Device> device_ = std::make_shared<Device>();
  std::unique_ptr<V4l2Camera> camera_;
};

TEST_F(V4l2, PicturesAreReadAndTheBuffersGivenBackForEver) {
  camera().open();
  for (std::uint32_t i = 0; i < 50; ++i) {
    const Shot picture = read({filled(i)});
    ASSERT_EQ(picture.image.size(), cv::Size(4, 2));
    EXPECT_EQ(picture.image.data[0], i);
    EXPECT_EQ(picture.lost, 0U);
  }
  camera().close();
  EXPECT_EQ(device_->mapped, 4);
  EXPECT_EQ(device_->unmapped, 4);
  EXPECT_EQ(device_->closed, 1);
}

TEST_F(V4l2, AStampOfTheStartOfExposureBecomesTheMidpoint) {
  // Rows of 10 ms one after the other over 8 ms: the middle of the middle one is 9 ms after the first begins.
  device_->controls = {{V4L2_CID_EXPOSURE_AUTO, 3}, {V4L2_CID_EXPOSURE_ABSOLUTE, 50}};
  options_.exposure_us = 10'000;
  options_.readout = milliseconds(8);
  camera().open();
  EXPECT_EQ(device_->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(device_->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 100) << "in units of 100 us";
  Device::Filled buffer = filled(0, milliseconds(40));
  buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  EXPECT_EQ(read({buffer}).captured, now_ - milliseconds(40) + milliseconds(9));
}

TEST_F(V4l2, AStampOfTheEndOfTheFrameBecomesTheMidpoint) {
  device_->controls = {{V4L2_CID_EXPOSURE_AUTO, 1}, {V4L2_CID_EXPOSURE_ABSOLUTE, 200}};
  options_.readout = milliseconds(8);
  camera().open();
  EXPECT_EQ(device_->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_APERTURE_PRIORITY) << "automatic";
  // It tells 20 ms itself: half of 28 ms before the end.
  EXPECT_EQ(read({filled(0, milliseconds(5))}).captured, now_ - milliseconds(5) - milliseconds(14));
}

TEST_F(V4l2, ADriverWithoutStampsIsDatedByArrival) {
  camera().open();
  Device::Filled buffer = filled(0, seconds(4000));
  buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  EXPECT_EQ(read({buffer}).captured, now_);
}

TEST_F(V4l2, GapsInTheSequenceAreLostPicturesEvenAcrossItsWrap) {
  camera().open();
  EXPECT_EQ(read({filled(0xfffffffdU)}).lost, 0U) << "it may begin anywhere";
  EXPECT_EQ(read({filled(0xfffffffeU)}).lost, 0U);
  EXPECT_EQ(read({filled(2)}).lost, 3U) << "ffffffff, 0 and 1";
  EXPECT_EQ(read({filled(0)}).lost, 0U) << "begun anew";
  EXPECT_EQ(read({filled(1)}).lost, 0U);
  EXPECT_EQ(read({filled(3)}).lost, 1U);
}

TEST_F(V4l2, WhereSeveralWaitTheNewestIsTakenAndTheOthersAreLost) {
  camera().open();
  const Shot picture = read({filled(0), filled(1), filled(3)});
  EXPECT_EQ(picture.image.data[0], 3);
  EXPECT_EQ(picture.lost, 3U) << "two that were overtaken and one that never came";
  EXPECT_EQ(read({filled(4)}).lost, 0U);
}

TEST_F(V4l2, ABufferThatTheDriverMarksOrThatIsTooShortIsUnreadable) {
  camera().open();
  Device::Filled marked = filled(0);
  marked.flags |= V4L2_BUF_FLAG_ERROR;
  EXPECT_TRUE(read({marked}).image.empty());
  Device::Filled brief = filled(1);
  brief.bytes.resize(7);
  EXPECT_THAT(read({brief}).unreadable, AllOf(HasSubstr("7 bytes"), HasSubstr("need 8")));
  EXPECT_FALSE(read({filled(2)}).image.empty()) << "and the next one is read";
}

TEST_F(V4l2, FormatsAreAskedForAndRowsMayBePadded) {
  options_.format = PixelFormat::yuyv;
  device_->stride = 12;
  camera().open();
  Device::Filled buffer = filled(0);
  buffer.bytes.assign(12 + 8, 128);
  const Shot picture = read({buffer});
  EXPECT_EQ(picture.image.type(), CV_8UC3);
  EXPECT_EQ(picture.image.size(), cv::Size(4, 2));
}

TEST_F(V4l2, WhatTheDeviceDoesNotGiveIsRefusedWithWhatItGives) {
  options_.format = PixelFormat::mjpg;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("gives 4 x 2 YUYV"), HasSubstr("asked for 4 x 2 MJPG"),
                               HasSubstr("offers YUYV, GREY")));
  options_.format = PixelFormat::grey;
  options_.size_px = {1920, 1080};
  camera_.reset();
  EXPECT_THAT(refusal(), AllOf(HasSubstr("gives 4 x 2 GREY"), HasSubstr("asked for 1920 x 1080 GREY")));
  options_.size_px = {4, 2};
  options_.frame_rate_hz = 60;
  camera_.reset();
  EXPECT_THAT(refusal(), AllOf(HasSubstr("gives 30 frames/s"), HasSubstr("asked for 60")));
}

TEST_F(V4l2, ControlsThatItLacksOrRefusesAreNamedWithTheirRange) {
  options_.exposure_us = 5000;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("exposure_us: 5000"), HasSubstr("no such control")));
  device_->controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, 1}, {V4L2_CID_GAIN, 0}};
  device_->ranges = {{V4L2_CID_EXPOSURE_ABSOLUTE, {1, 40}}, {V4L2_CID_GAIN, {0, 255}}};
  EXPECT_THAT(refusal(), HasSubstr("allowed 100 to 4000"));
  device_->ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 50};
  EXPECT_EQ(refusal(), "opened");
  options_.gain = 300;
  camera_.reset();
  EXPECT_THAT(refusal(), AllOf(HasSubstr("gain: 300"), HasSubstr("allowed 0 to 255")));
}

TEST_F(V4l2, WhatIsNoCameraIsRefusedByName) {
  device_->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("by-path"), HasSubstr("no camera that streams")));
  EXPECT_EQ(refusal(), refusal()) << "and can be asked again";
  device_->open_error = EACCES;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("Permission denied"), HasSubstr("group video")));
  device_->open_error = ENOENT;
  EXPECT_THAT(refusal(), HasSubstr("No such file"));
  EXPECT_EQ(device_->opened, 3);
  camera_.reset();
  EXPECT_EQ(device_->closed, 3);
}

TEST_F(V4l2, ACameraThatIsSilentIsToldApartFromOneThatIsGone) {
  const auto why = [this] {
    try {
      camera().read();
    } catch (const SourceError& error) {
      return std::string(error.what());
    }
    return std::string("read");
  };
  camera().open();
  EXPECT_THAT(why(), HasSubstr("no picture for 2 s"));
  device_->turns.push_back({{.error = ENODEV}});
  EXPECT_THAT(why(), HasSubstr("unplugged"));
  device_->turns.push_back({{.error = EIO}});
  EXPECT_THAT(why(), HasSubstr("Input/output error"));
  camera().interrupt();
  EXPECT_THAT(why(), HasSubstr("interrupted"));
  EXPECT_THROW(camera().open(), SourceError);
}

TEST_F(V4l2, UnpluggedAndPluggedInAgainItRunsOn) {
  for (std::uint32_t i = 0; i < 5; ++i) device_->turns.push_back({filled(i)});
  device_->turns.push_back({{.error = ENODEV}});
  int rests = 0;
  std::vector<Time> captured;
  std::unique_ptr<CameraFeed> feed;
  FeedOptions options{.kind = "v4l2", .frozen_after = {}, .clock = options_.clock};
  options.rest = [&](Duration duration) {
    now_ += duration;
    device_->monotonic += duration;
    ++rests;
    device_->open_error = rests < 3 ? ENOENT : 0;
    if (rests == 3) {
      for (std::uint32_t i = 0; i < 5; ++i) device_->turns.push_back({filled(i)});
    }
    return rests < 4;  // the fourth is after the second five
  };
  feed = std::make_unique<CameraFeed>(
      options, std::make_unique<V4l2Camera>(options_, std::make_unique<FakeV4l2>(device_)),
      CameraFeed::Listener{.frame = [&](const Frame& frame) {
        captured.push_back(frame.captured);
        now_ += milliseconds(33);
        device_->monotonic += milliseconds(33);
        for (auto& turn : device_->turns) turn.front().stamp = device_->monotonic;
      }});
  feed->run();
  EXPECT_EQ(captured.size(), 10U);
  EXPECT_EQ(feed->status().reconnects, 1U);
  EXPECT_EQ(device_->opened, 2);
  EXPECT_EQ(device_->closed, 2);
  EXPECT_EQ(feed->status().state, FeedState::failed) << "silent at last";
}

}  // namespace
}  // namespace skylight::service::test
