#include "service/sources/frame_list.hpp"

#include <charconv>
#include <fstream>
#include <sstream>

#include "service/sources/source.hpp"
#include "service/time_text.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> fields_of(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  return fields;
}

bool read_number(const std::string& text, std::uint64_t& value) {
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return !text.empty() && error == std::errc() && stop == text.data() + text.size();
}

}  // namespace

std::vector<ListedFrame> read_frame_list(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return {};
  std::string line;
  if (!std::getline(in, line) || !line.starts_with("file,captured")) {
    throw SourceError(file.string() + ":1: expected the header file,captured, found: " + line);
  }
  const std::vector<std::string> header = fields_of(line);
  const bool numbered = header.size() > 2 && header[2] == "sequence";
  std::vector<ListedFrame> frames;
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty()) continue;
    const std::vector<std::string> fields = fields_of(line);
    const auto captured = fields.size() >= 2 ? time_from_text(fields[1]) : std::nullopt;
    std::uint64_t sequence = frames.size();
    const bool counted = !numbered || (fields.size() >= 3 && read_number(fields[2], sequence));
    const bool named = !fields.empty() && !fields[0].empty() && !fs::path(fields[0]).has_parent_path();
    if (!captured || !counted || !named) {
      throw SourceError(file.string() + ":" + std::to_string(number) +
                        ": expected file,captured (Unix seconds)" + (numbered ? ",sequence" : "") +
                        ", found: " + line);
    }
    frames.push_back({fields[0], *captured, sequence});
  }
  if (frames.empty()) throw SourceError(file.string() + ": names no pictures");
  return frames;
}

std::string frame_list_header() {
  return "file,captured,sequence\n";
}

std::string frame_list_line(const ListedFrame& frame) {
  return frame.file + "," + time_text(frame.captured) + "," + std::to_string(frame.sequence) + "\n";
}

std::string numbered_picture(std::uint64_t sequence) {
  const std::string digits = std::to_string(sequence);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits + ".png";
}

bool is_video_name(const fs::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".mkv" || extension == ".mp4" || extension == ".avi";
}

}  // namespace skylight::service
