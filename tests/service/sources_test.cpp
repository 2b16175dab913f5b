#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "service/sources/simulator.hpp"
#include "service/sources/video.hpp"
#include "tests/service/fakes.hpp"

namespace skylight::service::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class Sources : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("skylight_sources_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  /// A picture of one level: which one it is can be told from any pixel.
  void picture(const std::string& name, int level) const {
    fs::create_directories((folder_ / name).parent_path());
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), cv::Mat(24, 32, CV_8UC3, cv::Scalar::all(level))));
  }
  /// 20 frames at 25 per second: the level of the upper half goes up by 10, the lower half is noise (which
  /// takes room in the file).
  fs::path video() const {
    const fs::path path = folder_ / "room.avi";
    cv::VideoWriter writer(path.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25.0, {160, 120});
    EXPECT_TRUE(writer.isOpened());
    cv::RNG random(1);
    for (int i = 0; i < 20; ++i) {
      cv::Mat image(120, 160, CV_8UC3, cv::Scalar::all(20 + 10 * i));
      random.fill(image.rowRange(64, 120), cv::RNG::UNIFORM, 0, 255);
      writer.write(image);
    }
    return path;
  }
  fs::path truncated(const fs::path& path, double share) const {
    const fs::path cut = folder_ / "cut.avi";
    fs::copy_file(path, cut);
    fs::resize_file(cut, static_cast<std::uintmax_t>(static_cast<double>(fs::file_size(path)) * share));
    return cut;
  }

  fs::path folder_;
};

template <class Run>
std::string message_of(Run run) {
  try {
    run();
  } catch (const SourceError& error) {
    return error.what();
  }
  return "no error";
}

std::vector<int> levels_of(FrameSource& source, std::size_t at_most = 1000) {
  std::vector<int> levels;
  while (levels.size() < at_most) {
    const auto frame = source.next();
    if (!frame) break;
    levels.push_back(frame->image.data[0]);
  }
  return levels;
}

TEST_F(Sources, AVideoGivesItsFramesInOrderAtItsRate) {
  VideoFrames source(video(), {.start = kStart, .camera = 2});
  EXPECT_DOUBLE_EQ(source.frame_rate_hz(), 25.0);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const auto frame = source.next();
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(frame->sequence, i);
    EXPECT_EQ(frame->camera, 2U);
    EXPECT_EQ(frame->captured, kStart + std::chrono::milliseconds(40 * i));
    EXPECT_EQ(frame->image.type(), CV_8UC3);
    EXPECT_NEAR(frame->image.at<cv::Vec3b>(20, 32)[1], 20.0 + 10.0 * static_cast<double>(i), 4.0);
  }
  EXPECT_FALSE(source.next());
  EXPECT_FALSE(source.next()) << "and stays at its end";
}

TEST_F(Sources, AFrameKeepsItsPictureWhenTheNextOneComes) {
  VideoFrames source(video(), {});
  const auto first = source.next();
  const cv::Mat copy = first->image.clone();
  source.next();
  EXPECT_EQ(cv::norm(first->image, copy, cv::NORM_INF), 0.0);
}

TEST_F(Sources, AVideoThatLoopsBeginsAgainAndTimeGoesOn) {
  VideoFrames source(video(), {.start = kStart, .loop = true});
  std::optional<Frame> frame;
  for (int i = 0; i < 45; ++i) frame = source.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->sequence, 44U);
  EXPECT_EQ(frame->captured, kStart + std::chrono::milliseconds(40 * 44));
  EXPECT_NEAR(frame->image.at<cv::Vec3b>(0, 0)[0], 20.0 + 10.0 * 4, 4.0);
}

TEST_F(Sources, ATruncatedVideoGivesWhatIsThereAndSaysThatItBreaksOff) {
  VideoFrames source(truncated(video(), 0.5), {});
  std::size_t frames = 0;
  const std::string message = message_of([&] {
    while (source.next()) ++frames;
  });
  EXPECT_GT(frames, 2U);
  EXPECT_LT(frames, 18U);
  EXPECT_THAT(message, AllOf(HasSubstr("cut.avi"),
                             HasSubstr("breaks off after " + std::to_string(frames) + " of 20")));
}

TEST_F(Sources, AVideoCutOffInItsHeadIsRefused) {
  const fs::path path = truncated(video(), 0.02);
  EXPECT_THAT(message_of([&] { VideoFrames(path, {}).next(); }), HasSubstr("cut.avi"));
}

TEST_F(Sources, WhatIsNoVideoIsRefusedByName) {
  const fs::path text = write("notes.mp4", "these are notes, no video\n");
  EXPECT_THAT(message_of([&] { VideoFrames(text, {}); }),
              AllOf(HasSubstr("notes.mp4"), HasSubstr("no video")));
  EXPECT_THAT(message_of([&] { VideoFrames(write("empty.mp4", ""), {}); }), HasSubstr("empty.mp4"));
  EXPECT_THAT(message_of([&] { VideoFrames(folder_ / "absent.mp4", {}); }),
              AllOf(HasSubstr("absent.mp4"), HasSubstr("no such file")));
  EXPECT_THAT(message_of([&] { VideoFrames(folder_, {}); }), HasSubstr("skylight_sources_")) << "a folder";
}

TEST_F(Sources, AFolderIsReadInTheOrderThatPeopleCountIn) {
  picture("frame10.png", 100);
  picture("frame2.png", 20);
  picture("frame1.png", 10);
  picture("frame0009.png", 90);
  write("notes.txt", "no picture");
  FolderFrames source(folder_, {.start = kStart, .frame_rate_hz = 10.0});
  EXPECT_THAT(levels_of(source), testing::ElementsAre(10, 20, 90, 100));
  FolderFrames again(folder_, {.start = kStart, .frame_rate_hz = 10.0});
  again.next();
  EXPECT_EQ(again.next()->captured, kStart + std::chrono::milliseconds(100));
}

TEST_F(Sources, PicturesBecomeEightBitsAndOneOrThreeChannels) {
  cv::imwrite((folder_ / "a16.png").string(), cv::Mat(24, 32, CV_16UC1, cv::Scalar(257 * 200)));
  cv::imwrite((folder_ / "b16.png").string(), cv::Mat(24, 32, CV_16UC3, cv::Scalar(257 * 1, 257 * 2, 65535)));
  cv::imwrite((folder_ / "c8.png").string(), cv::Mat(24, 32, CV_8UC4, cv::Scalar(1, 2, 3, 4)));
  cv::imwrite((folder_ / "d8.png").string(), cv::Mat(24, 32, CV_8UC1, cv::Scalar(55)));
  FolderFrames source(folder_, {.frame_rate_hz = 10.0});
  auto frame = source.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image.type(), CV_8UC1);
  EXPECT_EQ(frame->image.at<uchar>(5, 5), 200);
  frame = source.next();
  EXPECT_EQ(frame->image.at<cv::Vec3b>(5, 5), cv::Vec3b(1, 2, 255));
  frame = source.next();
  EXPECT_EQ(frame->image.type(), CV_8UC3);
  EXPECT_EQ(frame->image.at<cv::Vec3b>(5, 5), cv::Vec3b(1, 2, 3));
  frame = source.next();
  EXPECT_EQ(frame->image.at<uchar>(5, 5), 55);
}

TEST_F(Sources, ADamagedPictureIsSkippedAndCounted) {
  picture("1.png", 10);
  write("2.png", "\x89PNG\r\n\x1a\n and nothing more");
  picture("3.png", 30);
  FolderFrames source(folder_, {.start = kStart, .frame_rate_hz = 10.0});
  EXPECT_EQ(source.next()->image.data[0], 10);
  const auto after = source.next();
  ASSERT_TRUE(after);
  EXPECT_EQ(after->image.data[0], 30);
  EXPECT_EQ(after->sequence, 2U) << "the gap shows";
  EXPECT_EQ(after->captured, kStart + std::chrono::milliseconds(200)) << "and time does not close up";
  EXPECT_FALSE(source.next());
  EXPECT_EQ(source.bad_frames(), 1U);
}

TEST_F(Sources, AFolderThatLoopsDoesSoForEverThoughAPictureIsDamaged) {
  picture("1.png", 10);
  write("2.png", "damaged");
  FolderFrames source(folder_, {.frame_rate_hz = 10.0, .loop = true});
  EXPECT_THAT(levels_of(source, 9), testing::Each(10));
  EXPECT_GE(source.bad_frames(), 8U);
}

TEST_F(Sources, AFolderThatLoopsAndIsEmptiedSaysSo) {
  picture("1.png", 10);
  picture("2.png", 20);
  FolderFrames source(folder_, {.frame_rate_hz = 10.0, .loop = true});
  EXPECT_THAT(levels_of(source, 5), testing::ElementsAre(10, 20, 10, 20, 10));
  fs::remove(folder_ / "1.png");
  fs::remove(folder_ / "2.png");
  EXPECT_THAT(message_of([&] { levels_of(source, 3); }), HasSubstr("not one picture"));
}

TEST_F(Sources, AFolderWithoutOnePictureThatCanBeReadIsRefused) {
  EXPECT_THAT(message_of([&] { FolderFrames(folder_, {.frame_rate_hz = 10.0}); }), HasSubstr("no pictures"));
  EXPECT_THAT(message_of([&] { FolderFrames(folder_ / "absent", {.frame_rate_hz = 10.0}); }),
              AllOf(HasSubstr("absent"), HasSubstr("no such folder")));
  write("1.png", "damaged");
  write("2.jpg", "damaged");
  FolderFrames source(folder_, {.frame_rate_hz = 10.0});
  EXPECT_THAT(message_of([&] { source.next(); }), HasSubstr("not one picture"));
  EXPECT_THAT(message_of([&] { FolderFrames(folder_, {}); }), HasSubstr("frame_rate_hz"));
}

TEST_F(Sources, FramesCsvGivesTimesAndOrder) {
  picture("a.png", 10);
  picture("b.png", 20);
  picture("c.png", 30);
  write("frames.csv", "file,captured\nc.png,1700000000.25\na.png,1700000001.5,whatever\r\n\n");
  FolderFrames source(folder_, {});
  auto frame = source.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image.data[0], 30);
  EXPECT_EQ(frame->captured, kStart + std::chrono::milliseconds(250));
  frame = source.next();
  EXPECT_EQ(frame->image.data[0], 10);
  EXPECT_EQ(frame->captured, kStart + std::chrono::milliseconds(1500));
  EXPECT_FALSE(source.next()) << "b.png is not named";
}

TEST_F(Sources, AMalformedFramesCsvIsRefusedWithItsLine) {
  picture("a.png", 10);
  for (const char* line : {"a.png", "a.png,", "a.png,soon", "a.png,nan", "a.png,1e99", "a.png,17x", ",1.0",
                           "../a.png,1.0", "/etc/a.png,1.0"}) {
    write("frames.csv", std::string("file,captured\na.png,1.0\n") + line + "\n");
    EXPECT_THAT(message_of([&] { FolderFrames(folder_, {}); }), HasSubstr("frames.csv:3: ")) << line;
  }
  write("frames.csv", "a.png,1.0\n");
  EXPECT_THAT(message_of([&] { FolderFrames(folder_, {}); }), HasSubstr("frames.csv:1: expected the header"));
  write("frames.csv", "file,captured\n");
  EXPECT_THAT(message_of([&] { FolderFrames(folder_, {}); }), HasSubstr("names no pictures"));
}

TEST_F(Sources, DepthOfTheSameNameGoesWithItsPicture) {
  picture("1.png", 10);
  picture("2.png", 20);
  picture("3.png", 30);
  fs::create_directories(folder_ / "depth");
  cv::imwrite((folder_ / "depth/1.png").string(), cv::Mat(24, 32, CV_16UC1, cv::Scalar(2750)));
  write("depth/3.png", "damaged");
  FolderFrames source(folder_, {.frame_rate_hz = 10.0});
  auto frame = source.next();
  ASSERT_TRUE(frame);
  ASSERT_EQ(frame->depth.type(), CV_16UC1);
  EXPECT_EQ(frame->depth.at<std::uint16_t>(3, 3), 2750);
  frame = source.next();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->depth.empty());
  EXPECT_FALSE(source.next());
  EXPECT_EQ(source.bad_frames(), 1U) << "a frame with damaged depth is a bad frame";
}

// The head of a PNG that claims to be 60,000 x 60,000: 3.6 billion pixels, 10.8 GB.
std::string absurd_png() {
  const auto number = [](unsigned value) {
    return std::string{static_cast<char>(value >> 24), static_cast<char>(value >> 16),
                       static_cast<char>(value >> 8), static_cast<char>(value)};
  };
  const std::string head = "IHDR" + number(60000) + number(60000) + std::string("\x08\x02\x00\x00\x00", 5);
  unsigned crc = 0xffffffffU;  // as the PNG specification, annex D
  for (const char c : head) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? 0xedb88320U ^ (crc >> 1) : crc >> 1;
  }
  return "\x89PNG\r\n\x1a\n" + number(13) + head + number(~crc) + number(0) + "IDAT" + number(0x35af061e);
}

long peak_kb() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("VmPeak:")) return std::stol(line.substr(7));
  }
  return 0;
}

TEST_F(Sources, APictureOfAbsurdSizeIsRefusedBeforeMemoryIsTaken) {
  const fs::path path = write("huge.png", absurd_png());
  const long before = peak_kb();
  EXPECT_THAT(
      message_of([&] { read_picture(path, cv::IMREAD_UNCHANGED); }),
      AllOf(HasSubstr("huge.png"), HasSubstr("3600000000 pixels"), HasSubstr("allowed up to 67108864")));
  EXPECT_LT(peak_kb() - before, 512 * 1024) << "kB of address space";
}

TEST_F(Sources, APictureThatIsMissingOrDamagedIsRefusedByName) {
  EXPECT_THAT(message_of([&] { read_picture(folder_ / "absent.png", cv::IMREAD_COLOR); }),
              AllOf(HasSubstr("absent.png"), HasSubstr("no such file")));
  EXPECT_THAT(message_of([&] { read_picture(folder_, cv::IMREAD_COLOR); }), HasSubstr("not a file"));
  EXPECT_THAT(message_of([&] { read_picture(write("bad.png", "x"), cv::IMREAD_COLOR); }),
              AllOf(HasSubstr("bad.png"), HasSubstr("damaged")));
}

TEST_F(Sources, AScenarioIsFoundByNameOrPathAndElseNamed) {
  EXPECT_TRUE(fs::exists(find_scenario("straight")));
  EXPECT_THAT(message_of([] { find_scenario("no_such_room"); }),
              AllOf(HasSubstr("no_such_room"), HasSubstr(".json")));
  EXPECT_THAT(message_of([&] { find_scenario((folder_ / "absent.json").string()); }),
              AllOf(HasSubstr("absent.json"), HasSubstr("no such scenario file")));
}

TEST_F(Sources, TheSimulatorGivesTruthWithEachFrameAndASeedFixesIt) {
  const fs::path path = write("room.json", R"({"seed": 4, "duration_s": 0.3, "room": {"size_m": [2, 2]},
    "cameras": [{"id": "ceiling", "position_m": [0, 0, 2], "width_px": 160, "height_px": 120, "fx_px": 100,
                 "fy_px": 100, "distortion": [0, 0, 0, 0, 0], "frame_rate_hz": 10}],
    "robots": [{"id": "anna", "start": {"x_m": 0.2, "y_m": 0.1, "yaw_deg": 90}}]})");
  SimulatorFrames one(path.string(), std::nullopt);
  SimulatorFrames same(path.string(), 4);
  SimulatorFrames other(path.string(), 5);
  EXPECT_EQ(one.seed(), 4U);
  EXPECT_DOUBLE_EQ(one.duration_s(), 0.3);
  ASSERT_EQ(one.cameras().size(), 1U);
  EXPECT_EQ(one.cameras()[0].model.intrinsics().width_px, 160);
  ASSERT_EQ(one.robots().size(), 1U);
  const auto frame = one.next();
  ASSERT_TRUE(frame);
  ASSERT_EQ(one.truth().size(), 1U);
  EXPECT_TRUE(one.truth()[0].in_view);
  EXPECT_NEAR(one.truth()[0].pose.x, 0.2, 1e-3);
  EXPECT_NEAR(one.truth()[0].pose.yaw, std::numbers::pi / 2, 1e-3);
  EXPECT_EQ(cv::norm(frame->image, same.next()->image, cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(frame->image, other.next()->image, cv::NORM_INF), 0.0);
  std::size_t frames = 1;
  while (one.next()) ++frames;
  EXPECT_EQ(frames, 3U);
}

}  // namespace
}  // namespace skylight::service::test
