#include "service/sources/tum_folder.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "service/sources/source.hpp"
#include "service/time_text.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

struct Line {
  Time at{};
  std::string file;
};

bool leads_out(const fs::path& path) {
  return path.is_absolute() || std::find(path.begin(), path.end(), fs::path("..")) != path.end();
}

std::vector<Line> read_list(const fs::path& file) {
  std::ifstream in(file);
  std::vector<Line> lines;
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    std::istringstream fields(text);
    std::string time;
    Line line;
    if (!(fields >> time) || time.front() == '#') continue;
    const auto at = time_from_text(time);
    if (!at || !(fields >> line.file) || leads_out(line.file)) {
      throw SourceError(file.string() + ":" + std::to_string(number) +
                        ": expected a time (Unix seconds) and a file in this folder, found: " + text);
    }
    line.at = *at;
    lines.push_back(line);
  }
  std::sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) { return a.at < b.at; });
  const auto twice = std::adjacent_find(lines.begin(), lines.end(),
                                        [](const Line& a, const Line& b) { return a.at == b.at; });
  if (twice != lines.end())
    throw SourceError(file.string() + ": the time " + time_text(twice->at) + " comes twice");
  return lines;
}

struct Pair {
  Duration apart{};
  std::size_t image = 0;
  std::size_t depth = 0;
};

// All that are near enough, the closest first.
std::vector<Pair> pairs_of(const std::vector<TumFrame>& images, const std::vector<Line>& depths) {
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < images.size(); ++i) {
    auto at = std::lower_bound(depths.begin(), depths.end(), images[i].captured - kTumTolerance,
                               [](const Line& line, Time t) { return line.at < t; });
    for (; at != depths.end() && at->at <= images[i].captured + kTumTolerance; ++at) {
      const Duration apart = at->at - images[i].captured;
      pairs.push_back(
          {apart < Duration{} ? -apart : apart, i, static_cast<std::size_t>(at - depths.begin())});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.apart < b.apart; });
  return pairs;
}

}  // namespace

bool is_tum_folder(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / "rgb.txt", error);
}

std::vector<TumFrame> read_tum_folder(const fs::path& folder) {
  std::vector<TumFrame> frames;
  for (Line& line : read_list(folder / "rgb.txt"))
    frames.push_back({.image = std::move(line.file), .captured = line.at});
  if (frames.empty()) throw SourceError((folder / "rgb.txt").string() + ": names no pictures");
  std::error_code error;
  if (!fs::exists(folder / "depth.txt", error)) return frames;
  const std::vector<Line> depths = read_list(folder / "depth.txt");
  std::vector<bool> taken(depths.size(), false);
  for (const Pair& pair : pairs_of(frames, depths)) {
    if (taken[pair.depth] || !frames[pair.image].depth.empty()) continue;
    taken[pair.depth] = true;
    frames[pair.image].depth = depths[pair.depth].file;
  }
  return frames;
}

cv::Mat millimetres_from_tum(const cv::Mat& depth, const std::string& name) {
  if (depth.type() != CV_16UC1) throw SourceError(name + ": a depth picture has 16 bits and one channel");
  cv::Mat out;
  depth.convertTo(out, CV_16U, 1000.0 / 5000.0);
  return out;
}

}  // namespace skylight::service
