// frames.csv: which picture, or which frame of a video, was captured when.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tracker/types.hpp"

namespace skylight::service {

/// Columns `file,captured[,sequence[,...]]` under a header line; further ones are not looked at. `file` is a
/// picture in the same folder, or a video whose frames are meant in their order.
struct ListedFrame {
  std::string file;
  Time captured{};             ///< Unix seconds in the file, exact to the nanosecond
  std::uint64_t sequence = 0;  ///< absent: the line's number, from 0
};

/// Empty where there is no such file. Throws SourceError naming file and line where one is malformed.
std::vector<ListedFrame> read_frame_list(const std::filesystem::path& file);

/// The header line, and one line.
std::string frame_list_header();
std::string frame_list_line(const ListedFrame& frame);

/// The depth picture that goes with frame 12 lies in depth/000012.png, as its picture in 000012.png.
std::string numbered_picture(std::uint64_t sequence);

bool is_video_name(const std::filesystem::path& file);

}  // namespace skylight::service
