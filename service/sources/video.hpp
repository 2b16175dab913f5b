// A video file or a folder of images as a frame source.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include <opencv2/videoio.hpp>

#include "service/sources/frame_list.hpp"
#include "service/sources/source.hpp"

namespace skylight::service {

struct FileSourceOptions {
  Time start{};                ///< capture time of the first frame
  double frame_rate_hz = 0.0;  ///< 0: what the video says (a folder has to be told)
  bool loop = false;           ///< begin again at the end; time goes on
  std::size_t camera = 0;
};

/// Reads a picture with a clear error: missing, no picture, larger than kMaxPicturePixels. `flags` as for
/// cv::imread. Throws SourceError.
cv::Mat read_picture(const std::filesystem::path& path, int flags);

class VideoFrames final : public FrameSource {
 public:
  /// Throws SourceError where the file is missing, is no video or has no plausible frame rate.
  VideoFrames(std::filesystem::path path, const FileSourceOptions& options);
  /// Throws SourceError too where the file breaks off well before the end that it states, unless it loops.
  std::optional<Frame> next() override;

  double frame_rate_hz() const { return frame_rate_hz_; }

 private:
  std::filesystem::path path_;
  FileSourceOptions options_;
  cv::VideoCapture capture_;
  double frame_rate_hz_ = 0.0;
  std::uint64_t sequence_ = 0;
  double stated_frames_ = 0.0;  ///< 0 where the file does not say
  std::uint64_t frames_this_round_ = 0;
};

/// Pictures (.png .jpg .jpeg .bmp .tif .tiff .pgm .ppm) in the order of their names, numbers in them compared
/// as numbers. Where there is a folder `depth` with pictures of the same names (16-bit millimetres), they go
/// with them; where there is a `frames.csv` (sources/frame_list.hpp, as `skylight simulate` writes it) its
/// times and sequence numbers are taken, in its order; it may name a video in the folder instead of pictures.
/// Where there is an `rgb.txt` the folder is one of TUM's RGB-D recordings (sources/tum_folder.hpp).
class FolderFrames final : public FrameSource {
 public:
  /// Throws SourceError where the folder is missing or has no pictures.
  FolderFrames(std::filesystem::path path, const FileSourceOptions& options);
  std::optional<Frame> next() override;
  std::uint64_t bad_frames() const override { return bad_frames_; }

 private:
  void list_pictures();
  void list_tum();
  Frame read(const ListedFrame& listed);
  cv::Mat depth_of(const ListedFrame& listed) const;
  cv::Mat next_of_video(const std::string& file);

  std::filesystem::path path_;
  FileSourceOptions options_;
  std::vector<ListedFrame> frames_;
  std::vector<std::string> tum_depths_;  ///< with each of frames_, in TUM's layout
  bool listed_ = false;                  ///< by frames.csv or rgb.txt, which tell times
  cv::VideoCapture video_;
  std::size_t index_ = 0;
  std::uint64_t count_ = 0;
  std::uint64_t bad_frames_ = 0;
  std::uint64_t frames_this_round_ = 0;
};

}  // namespace skylight::service
