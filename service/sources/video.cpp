#include "service/sources/video.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <sstream>

#include <opencv2/imgcodecs.hpp>

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kKnown{".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm"};
  return std::find(kKnown.begin(), kKnown.end(), extension) != kKnown.end();
}

// frame2 before frame10: runs of digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0;
  std::size_t j = 0;
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t end_i = i;
      std::size_t end_j = j;
      while (end_i < a.size() && digit(a[end_i])) ++end_i;
      while (end_j < b.size() && digit(b[end_j])) ++end_j;
      while (i < end_i && a[i] == '0') ++i;
      while (j < end_j && b[j] == '0') ++j;
      if (end_i - i != end_j - j) return end_i - i < end_j - j;
      if (const int order = a.compare(i, end_i - i, b, j, end_j - j); order != 0) return order < 0;
      i = end_i;
      j = end_j;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  return a.size() - i < b.size() - j;
}

// Eight bits, one or three channels: what the tracker takes.
cv::Mat as_frame_image(const cv::Mat& image) {
  cv::Mat out = image;
  if (out.depth() == CV_16U) out.convertTo(out, CV_8U, 1.0 / 257.0);
  if (out.depth() != CV_8U) return {};
  if (out.channels() == 4) {
    cv::Mat bgr;
    const std::array pairs{0, 0, 1, 1, 2, 2};
    bgr.create(out.size(), CV_8UC3);
    cv::mixChannels(&out, 1, &bgr, 1, pairs.data(), 3);
    return bgr;
  }
  return out.channels() == 1 || out.channels() == 3 ? out : cv::Mat{};
}

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

FolderFrames::FolderFrames(fs::path path, const FileSourceOptions& options)
    : path_(std::move(path)), options_(options) {
  std::error_code error;
  if (!fs::is_directory(path_, error)) throw SourceError(path_.string() + ": no such folder");
  for (const auto& entry : fs::directory_iterator(path_)) {
    if (entry.is_regular_file() && is_picture(entry.path())) files_.push_back(entry.path());
  }
  if (files_.empty()) throw SourceError(path_.string() + ": no pictures in this folder");
  std::sort(files_.begin(), files_.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  read_times();
  if (times_.empty() && !(options_.frame_rate_hz > 0)) {
    throw SourceError(path_.string() + ": a folder without frames.csv needs a frame_rate_hz");
  }
}

// frames.csv: a header line, then file,captured[,...]; a picture that it does not name is left out.
void FolderFrames::read_times() {
  std::ifstream in(path_ / "frames.csv");
  if (!in) return;
  std::string line;
  if (!std::getline(in, line) || !line.starts_with("file,captured")) {
    throw SourceError((path_ / "frames.csv").string() +
                      ":1: expected the header file,captured, found: " + line);
  }
  std::vector<fs::path> named;
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty()) continue;
    std::istringstream fields(line);
    std::string file;
    double captured = 0.0;
    const bool read = std::getline(fields, file, ',') && fields >> captured;
    const bool whole = read && (fields.eof() || fields.peek() == ',' || fields.peek() == '\r');
    if (!whole || !(std::abs(captured) < 9e9) || file.empty() || fs::path(file).has_parent_path()) {
      throw SourceError((path_ / "frames.csv").string() + ":" + std::to_string(number) +
                        ": expected file,captured (Unix seconds), found: " + line);
    }
    named.push_back(path_ / file);
    times_.emplace_back(std::chrono::microseconds(std::llround(captured * 1e6)));  // all that a double holds
  }
  files_ = std::move(named);
  if (files_.empty()) throw SourceError((path_ / "frames.csv").string() + ": names no pictures");
}

std::optional<Frame> FolderFrames::next() {
  for (;;) {
    while (index_ < files_.size()) {
      Frame frame = read(index_++);
      if (!frame.image.empty()) {
        ++frames_this_round_;
        return frame;
      }
      ++bad_frames_;  // a bad frame is counted and skipped, never fatal
    }
    if (frames_this_round_ == 0)
      throw SourceError(path_.string() + ": not one picture of this folder can be read");
    if (!options_.loop) return std::nullopt;
    index_ = 0;
    frames_this_round_ = 0;
  }
}

// Without an image where it cannot be read.
Frame FolderFrames::read(std::size_t index) {
  Frame frame{.camera = options_.camera, .sequence = sequence_};
  frame.captured = !times_.empty() && !options_.loop
                       ? times_[index]
                       : options_.start + from_seconds(static_cast<double>(sequence_) /
                                                       std::max(options_.frame_rate_hz, 0.01));
  ++sequence_;
  try {
    frame.image = as_frame_image(read_picture(files_[index], cv::IMREAD_UNCHANGED));
    const fs::path depth = path_ / "depth" / files_[index].filename();
    if (std::error_code error; fs::exists(depth, error))
      frame.depth = read_picture(depth, cv::IMREAD_UNCHANGED);
  } catch (const SourceError&) {
    frame.image.release();
  }
  return frame;
}

}  // namespace skylight::service
