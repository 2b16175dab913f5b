#include <algorithm>
#include <array>
#include <cctype>

#include <opencv2/imgcodecs.hpp>

#include "service/sources/frame_list.hpp"
#include "service/sources/tum_folder.hpp"
#include "service/sources/video.hpp"

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

}  // namespace

FolderFrames::FolderFrames(fs::path path, const FileSourceOptions& options)
    : path_(std::move(path)), options_(options) {
  std::error_code error;
  if (!fs::is_directory(path_, error)) throw SourceError(path_.string() + ": no such folder");
  listed_ = fs::exists(path_ / "frames.csv", error);
  if (listed_) {
    frames_ = read_frame_list(path_ / "frames.csv");
  } else if (is_tum_folder(path_)) {
    list_tum();
  } else {
    list_pictures();
    if (!(options_.frame_rate_hz > 0))
      throw SourceError(path_.string() + ": a folder without frames.csv needs a frame_rate_hz");
  }
}

void FolderFrames::list_tum() {
  listed_ = true;
  for (TumFrame& frame : read_tum_folder(path_)) {
    const std::uint64_t sequence = frames_.size();
    frames_.push_back({.file = std::move(frame.image), .captured = frame.captured, .sequence = sequence});
    tum_depths_.push_back(std::move(frame.depth));
  }
}

void FolderFrames::list_pictures() {
  for (const auto& entry : fs::directory_iterator(path_)) {
    if (entry.is_regular_file() && is_picture(entry.path()))
      frames_.push_back({.file = entry.path().filename().string(), .captured = {}});
  }
  if (frames_.empty()) throw SourceError(path_.string() + ": no pictures in this folder");
  std::sort(frames_.begin(), frames_.end(),
            [](const ListedFrame& a, const ListedFrame& b) { return natural_less(a.file, b.file); });
}

std::optional<Frame> FolderFrames::next() {
  for (;;) {
    while (index_ < frames_.size()) {
      Frame frame = read(frames_[index_++]);
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
    video_.release();
  }
}

// Without an image where it cannot be read.
Frame FolderFrames::read(const ListedFrame& listed) {
  const bool own_times = listed_ && !options_.loop;
  Frame frame{.camera = options_.camera, .sequence = own_times ? listed.sequence : count_};
  frame.captured = own_times ? listed.captured
                             : options_.start + from_seconds(static_cast<double>(count_) /
                                                             std::max(options_.frame_rate_hz, 0.01));
  ++count_;
  try {
    const bool from_video = is_video_name(listed.file);
    frame.image = from_video ? next_of_video(listed.file)
                             : as_frame_image(read_picture(path_ / listed.file, cv::IMREAD_UNCHANGED));
    frame.depth = depth_of(listed);
  } catch (const SourceError&) {
    frame.image.release();
  }
  return frame;
}

// Empty where there is none.
cv::Mat FolderFrames::depth_of(const ListedFrame& listed) const {
  if (!tum_depths_.empty()) {
    const std::string& name = tum_depths_[listed.sequence];
    return name.empty() ? cv::Mat{}
                        : millimetres_from_tum(read_picture(path_ / name, cv::IMREAD_UNCHANGED), name);
  }
  const fs::path depth =
      path_ / "depth" / (is_video_name(listed.file) ? numbered_picture(listed.sequence) : listed.file);
  std::error_code error;
  return fs::exists(depth, error) ? read_picture(depth, cv::IMREAD_UNCHANGED) : cv::Mat{};
}

cv::Mat FolderFrames::next_of_video(const std::string& file) {
  if (!video_.isOpened() && !video_.open((path_ / file).string(), cv::CAP_FFMPEG))
    throw SourceError((path_ / file).string() + ": no video that can be read");
  cv::Mat image;
  if (!video_.read(image)) throw SourceError((path_ / file).string() + ": breaks off");
  return image.clone();
}

}  // namespace skylight::service
