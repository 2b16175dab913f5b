// The watcher's thread: it looks at what it is offered, tells of changes, and holds nobody up.
#include "service/camera_watcher.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace skylight::service::test {
namespace {

cv::Mat speckled_floor() {
  cv::Mat floor(480, 640, CV_8UC1);
  cv::RNG noise(7);
  noise.fill(floor, cv::RNG::UNIFORM, 0, 255);
  cv::blur(floor, floor, {5, 5});
  return floor;
}

cv::Mat shifted(const cv::Mat& image, int by_px) {
  cv::Mat out = image.clone();
  image(cv::Rect(0, 0, image.cols - by_px, image.rows))
      .copyTo(out(cv::Rect(by_px, 0, image.cols - by_px, image.rows)));
  return out;
}

/// Offers frames half a second apart until the watch says so; a look may take as long as it likes.
class Offered {
 public:
  CameraWatchReport until(CameraHold hold, std::size_t camera, const cv::Mat& image) {
    for (int i = 0; i < 2000; ++i) {
      Frame frame;
      frame.camera = camera;
      frame.captured = Time{from_seconds(1000.0 + 0.5 * ++offered_)};
      frame.image = image;
      watcher.offer(frame);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      if (watcher.report(camera).hold == hold) break;
    }
    return watcher.report(camera);
  }

  CameraWatcher watcher{{}, 2};

 private:
  int offered_ = 0;
};

TEST(CameraWatcher, TellsWhichCameraWasMovedAndByHowMuch) {
  Offered offered;
  const cv::Mat floor = speckled_floor();
  ASSERT_EQ(offered.until(CameraHold::steady, 0, floor).hold, CameraHold::steady);
  ASSERT_EQ(offered.until(CameraHold::steady, 1, floor).hold, CameraHold::steady);
  const CameraWatchReport moved = offered.until(CameraHold::moved, 1, shifted(floor, 6));
  ASSERT_EQ(moved.hold, CameraHold::moved);
  EXPECT_NEAR(moved.shift_px, 6.0, 0.1);
  EXPECT_EQ(offered.watcher.report(0).hold, CameraHold::steady) << "the other one";
}

TEST(CameraWatcher, TakesWhatItSeesAfterANewCalibrationForRight) {
  Offered offered;
  const cv::Mat floor = speckled_floor();
  ASSERT_EQ(offered.until(CameraHold::steady, 1, floor).hold, CameraHold::steady);
  ASSERT_EQ(offered.until(CameraHold::moved, 1, shifted(floor, 6)).hold, CameraHold::moved);
  offered.watcher.relearn(1);
  EXPECT_EQ(offered.watcher.report(1).hold, CameraHold::learning) << "at once";
  const CameraWatchReport after = offered.until(CameraHold::steady, 1, shifted(floor, 6));
  ASSERT_EQ(after.hold, CameraHold::steady);
  EXPECT_LT(after.shift_px, 0.1);
}

TEST(CameraWatcher, EndsAtOnceAndIgnoresCamerasThatItDoesNotKnow) {
  Offered offered;
  Frame stranger;
  stranger.camera = 7;
  stranger.image = speckled_floor();
  offered.watcher.offer(stranger);
  EXPECT_EQ(offered.watcher.report(0).hold, CameraHold::learning);
}

}  // namespace
}  // namespace skylight::service::test
