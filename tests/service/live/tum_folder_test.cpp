// Recordings in TUM's RGB-D layout, judged by what the test wrote and by the benchmark's own description.
#include "service/sources/tum_folder.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "service/sources/video.hpp"
#include "tests/service/fakes.hpp"
#include "tests/support/shared_data.hpp"

namespace skylight::service::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class Tum : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("skylight_tum_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "rgb");
    fs::create_directories(folder_ / "depth");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  /// Frame i: its level is i everywhere, its depth 5000 (1 + i) per metre.
  void pictures(int count) const {
    for (int i = 0; i < count; ++i) {
      const std::string name = std::to_string(i) + ".png";
      cv::imwrite((folder_ / "rgb" / name).string(), cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(i)));
      cv::imwrite((folder_ / "depth" / name).string(), cv::Mat(4, 6, CV_16UC1, cv::Scalar(5000 * (1 + i))));
    }
  }
  std::string refusal() const {
    try {
      read_tum_folder(folder_);
    } catch (const SourceError& error) {
      return error.what();
    }
    return "read";
  }

  fs::path folder_;
};

TEST_F(Tum, TimesAreThoseOfThePicturesAndDepthIsInMillimetres) {
  pictures(3);
  write("rgb.txt",
        "# color images\n# timestamp filename\n1305031102.175304 rgb/0.png\n1305031102.211214 rgb/1.png\n"
        "1305031102.275326 rgb/2.png\n");
  write("depth.txt", "# depth maps\n1305031102.160407 depth/0.png\n1305031102.226738 depth/1.png\n");
  FolderFrames source(folder_, {});
  const auto first = source.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->captured, Time(std::chrono::nanoseconds(1305031102175304000)));
  EXPECT_EQ(first->image.at<cv::Vec3b>(0, 0)[0], 0);
  ASSERT_EQ(first->depth.type(), CV_16UC1);
  EXPECT_EQ(first->depth.at<std::uint16_t>(2, 3), 1000) << "5000 are a metre";
  const auto second = source.next();
  EXPECT_EQ(second->depth.at<std::uint16_t>(0, 0), 2000);
  const auto third = source.next();
  ASSERT_TRUE(third);
  EXPECT_TRUE(third->depth.empty()) << "none within 20 ms";
  EXPECT_EQ(third->sequence, 2U);
  EXPECT_FALSE(source.next());
  EXPECT_EQ(source.bad_frames(), 0U);
}

TEST_F(Tum, EachDepthGoesWithOnePictureTheNearestPairsFirst) {
  // Depth at 10 ms: 10 ms from the first picture, 3 ms from the second. Depth at 28: 15 ms from the second.
  write("rgb.txt", "0.000 rgb/0.png\n0.013 rgb/1.png\n0.060 rgb/2.png\n");
  write("depth.txt", "0.010 depth/0.png\n0.028 depth/1.png\n0.081 depth/2.png\n");
  const auto frames = read_tum_folder(folder_);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].depth, "") << "the nearest is taken, the next is 28 ms away";
  EXPECT_EQ(frames[1].depth, "depth/0.png");
  EXPECT_EQ(frames[2].depth, "") << "21 ms away";
}

TEST_F(Tum, LinesNeedNotBeInOrderAndDepthMayBeMissing) {
  write("rgb.txt", "2.5 rgb/b.png\r\n1.5 rgb/a.png\r\n");
  const auto frames = read_tum_folder(folder_);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].image, "rgb/a.png");
  EXPECT_EQ(frames[1].depth, "");
}

TEST_F(Tum, WhatIsWrongIsNamedWithFileAndLine) {
  write("rgb.txt", "# times\n1.0 rgb/0.png\nsoon rgb/1.png\n");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("rgb.txt:3"), HasSubstr("soon")));
  write("rgb.txt", "1.0 ../secret.png\n");
  EXPECT_THAT(refusal(), HasSubstr("rgb.txt:1"));
  write("rgb.txt", "1.0 /etc/passwd\n");
  EXPECT_THAT(refusal(), HasSubstr("rgb.txt:1"));
  write("rgb.txt", "1.0\n");
  EXPECT_THAT(refusal(), HasSubstr("rgb.txt:1"));
  write("rgb.txt", "# nothing\n");
  EXPECT_THAT(refusal(), HasSubstr("names no pictures"));
  write("rgb.txt", "1.0 rgb/0.png\n1.0 rgb/1.png\n");
  EXPECT_THAT(refusal(), HasSubstr("twice"));
}

TEST_F(Tum, ADepthPictureOfAnotherKindMakesABadFrameAndNoWrongDepth) {
  pictures(2);
  cv::imwrite((folder_ / "depth" / "0.png").string(), cv::Mat(4, 6, CV_8UC1, cv::Scalar(9)));
  write("rgb.txt", "1.0 rgb/0.png\n2.0 rgb/1.png\n");
  write("depth.txt", "1.0 depth/0.png\n2.0 depth/1.png\n");
  FolderFrames source(folder_, {});
  EXPECT_EQ(source.next()->sequence, 1U);
  EXPECT_EQ(source.bad_frames(), 1U);
}

TEST_F(Tum, APairOfTheBenchmarkItselfIsReadAtItsScale) {
  const auto data = skylight::test::shared_data("rgbd/open3d_rgbd/other_formats");
  if (!data) GTEST_SKIP() << "no shared data";
  fs::copy_file(*data / "TUM_color.png", folder_ / "rgb" / "0.png");
  fs::copy_file(*data / "TUM_depth.png", folder_ / "depth" / "0.png");
  write("rgb.txt", "1305031102.175304 rgb/0.png\n");
  write("depth.txt", "1305031102.160407 depth/0.png\n");
  FolderFrames source(folder_, {});
  const auto frame = source.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image.size(), cv::Size(640, 480));
  ASSERT_EQ(frame->depth.size(), frame->image.size());
  const cv::Mat raw = cv::imread((*data / "TUM_depth.png").string(), cv::IMREAD_UNCHANGED);
  std::size_t readings = 0;
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x) {
      const double metres = raw.at<std::uint16_t>(y, x) / 5000.0;
      ASSERT_NEAR(frame->depth.at<std::uint16_t>(y, x) / 1000.0, metres, 0.0005) << x << ", " << y;
      if (metres == 0.0) continue;
      ++readings;
      ASSERT_GT(metres, 0.4) << "nearer than a Kinect reads";
    }
  }
  EXPECT_GT(readings, raw.total() / 2);
}

}  // namespace
}  // namespace skylight::service::test
