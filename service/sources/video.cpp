#include "service/sources/video.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include <opencv2/imgcodecs.hpp>

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

// Width times height from the file's own head, without decoding: PNG states it at a fixed place. Other
// formats are bounded by OpenCV itself (OPENCV_IO_MAX_IMAGE_PIXELS, 2^30).
long long png_pixels(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<unsigned char, 24> head{};
  if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return 0;
  constexpr std::array<unsigned char, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  if (!std::equal(kSignature.begin(), kSignature.end(), head.begin())) return 0;
  const auto number = [&](std::size_t at) {
    return (static_cast<long long>(head[at]) << 24) | (head[at + 1] << 16) | (head[at + 2] << 8) |
           head[at + 3];
  };
  return number(16) * number(20);
}

}  // namespace

cv::Mat read_picture(const fs::path& path, int flags) {
  std::error_code error;
  if (!fs::exists(path, error)) throw SourceError(path.string() + ": no such file");
  if (!fs::is_regular_file(path, error)) throw SourceError(path.string() + ": not a file");
  if (const long long pixels = png_pixels(path); pixels > kMaxPicturePixels) {
    throw SourceError(path.string() + ": the picture has " + std::to_string(pixels) +
                      " pixels, allowed up to " + std::to_string(kMaxPicturePixels));
  }
  cv::Mat image;
  try {
    image = cv::imread(path.string(), flags);
  } catch (const cv::Exception& e) {
    throw SourceError(path.string() + ": cannot be decoded: " + e.err);
  }
  if (image.empty())
    throw SourceError(path.string() + ": no picture that can be read (damaged, or of an unknown format)");
  if (static_cast<long long>(image.total()) > kMaxPicturePixels) {
    throw SourceError(path.string() + ": the picture has " + std::to_string(image.total()) +
                      " pixels, allowed up to " + std::to_string(kMaxPicturePixels));
  }
  return image;
}

VideoFrames::VideoFrames(fs::path path, const FileSourceOptions& options)
    : path_(std::move(path)), options_(options) {
  std::error_code error;
  if (!fs::exists(path_, error)) throw SourceError(path_.string() + ": no such file");
  if (!capture_.open(path_.string(), cv::CAP_FFMPEG))
    throw SourceError(path_.string() + ": no video that can be read");
  frame_rate_hz_ = options_.frame_rate_hz > 0 ? options_.frame_rate_hz : capture_.get(cv::CAP_PROP_FPS);
  if (!(frame_rate_hz_ >= 0.01 && frame_rate_hz_ <= 10'000.0)) {
    throw SourceError(path_.string() + ": the video states no plausible frame rate");
  }
  stated_frames_ = capture_.get(cv::CAP_PROP_FRAME_COUNT);
}

std::optional<Frame> VideoFrames::next() {
  cv::Mat image;
  if (!capture_.read(image) || image.empty()) {
    if (frames_this_round_ == 0)
      throw SourceError(path_.string() + ": not one frame can be decoded (truncated?)");
    if (!options_.loop) {
      // Some containers only estimate their length: a little less is no truncation.
      if (const auto read = static_cast<double>(frames_this_round_); read < 0.9 * stated_frames_ - 2.0) {
        throw SourceError(path_.string() + ": breaks off after " + std::to_string(frames_this_round_) +
                          " of " + std::to_string(std::llround(stated_frames_)) + " frames (truncated?)");
      }
      return std::nullopt;
    }
    frames_this_round_ = 0;
    if (!capture_.open(path_.string(), cv::CAP_FFMPEG))
      throw SourceError(path_.string() + ": can no longer be read");
    return next();
  }
  ++frames_this_round_;
  Frame frame{.camera = options_.camera, .sequence = sequence_};
  frame.captured = options_.start + from_seconds(static_cast<double>(sequence_) / frame_rate_hz_);
  frame.image = image.clone();
  ++sequence_;
  return frame;
}

}  // namespace skylight::service
