#include "service/reproduce/mrclam_data.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <span>
#include <string_view>

#include "service/reproduce/xz.hpp"

namespace skylight::service::reproduce {
namespace {

constexpr Duration kLongestHole = std::chrono::milliseconds(100);
constexpr double kLatestTime = 9e9;  // s; what a Time can hold
constexpr std::string_view kBlanks = " \t\r";

constexpr std::array<std::string_view, 4> kTruthColumns{"time", "x", "y", "orientation"};
constexpr std::array<std::string_view, 3> kOdometryColumns{"time", "forward velocity", "angular velocity"};

struct File {
  std::string name;  ///< without its folder: how errors call it
  std::string content;
};

[[noreturn]] void fail(const std::string& file, std::size_t line, const std::string& what) {
  throw MrclamError(file + ":" + std::to_string(line) + ": " + what);
}

File open(const std::filesystem::path& folder, const std::string& plain) {
  const std::string packed = plain + ".xz";
  std::error_code ignored;
  if (std::filesystem::exists(folder / plain, ignored)) {
    std::ifstream file(folder / plain, std::ios::binary);
    std::string content{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file) throw MrclamError(plain + ": cannot be read");
    return {plain, std::move(content)};
  }
  if (!std::filesystem::exists(folder / packed, ignored))
    throw MrclamError(folder.string() + ": holds neither " + packed + " nor " + plain);
  try {
    return {packed, read_xz(folder / packed)};
  } catch (const std::runtime_error& error) {
    throw MrclamError(packed + ": " + error.what());
  }
}

/// The next word of the line; empty at its end.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

double number(std::string_view word, std::string_view column, const File& file, std::size_t line) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value))
    fail(file.name, line, std::string(column) + " is no number: \"" + std::string(word) + "\"");
  return value;
}

using Columns = std::span<const std::string_view>;
using Values = std::array<double, kTruthColumns.size()>;

Values values(std::string_view text, Columns columns, const File& file, std::size_t line) {
  Values out{};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::string_view word = take_word(text);
    if (word.empty()) fail(file.name, line, std::string(columns[i]) + " is missing");
    out.at(i) = number(word, columns[i], file, line);
  }
  if (const std::string_view more = take_word(text); !more.empty())
    fail(file.name, line,
         "more than " + std::to_string(columns.size()) + " values: \"" + std::string(more) + "\"");
  if (!(out[0] >= 0.0 && out[0] <= kLatestTime)) fail(file.name, line, "time is not between 0 and 9e9 s");
  return out;
}

/// Calls each(values) with every line's. Of lines with the same time the first counts.
template <typename Each>
void read(const File& file, Columns columns, const Each& each) {
  std::string_view rest = file.content;
  std::optional<double> last;
  for (std::size_t line = 1; !rest.empty(); ++line) {
    std::string_view text = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(text.size() + 1, rest.size()));
    if (text.find_first_not_of(kBlanks) == std::string_view::npos || text.front() == '#') continue;
    const Values row = values(text, columns, file, line);
    if (last && row[0] < *last)
      fail(file.name, line, "time goes back by " + std::to_string(*last - row[0]) + " s");
    if (last != row[0]) each(row);
    last = row[0];
  }
  if (!last) throw MrclamError(file.name + ": holds no readings");
}

Time instant(double seconds) {
  return Time{from_seconds(seconds)};
}

}  // namespace

MrclamRobot read_mrclam_robot(const std::filesystem::path& folder, int robot) {
  if (robot < 1 || robot > kMrclamRobots)
    throw std::invalid_argument("robot must be 1 to " + std::to_string(kMrclamRobots) + ", not " +
                                std::to_string(robot));
  const std::string stem = "Robot" + std::to_string(robot);
  MrclamRobot out{.robot = robot};
  read(open(folder, stem + "_Groundtruth.dat"), kTruthColumns, [&](const Values& row) {
    out.truth.push_back({.at = instant(row[0]), .pose = {row[1], row[2], wrap_angle(row[3])}});
  });
  read(open(folder, stem + "_Odometry.dat"), kOdometryColumns, [&](const Values& row) {
    out.odometry.push_back({.at = instant(row[0]), .forward = row[1], .yaw_rate = row[2]});
  });
  return out;
}

std::optional<Pose2> truth_at(const MrclamRobot& robot, Time at) {
  const auto after = std::upper_bound(robot.truth.begin(), robot.truth.end(), at,
                                      [](Time t, const MrclamReading& reading) { return t < reading.at; });
  if (after == robot.truth.begin()) return std::nullopt;
  const MrclamReading& a = *std::prev(after);
  if (a.at == at) return a.pose;
  if (after == robot.truth.end() || after->at - a.at > kLongestHole) return std::nullopt;
  const Pose2& b = after->pose;
  const double share = to_seconds(at - a.at) / to_seconds(after->at - a.at);
  return Pose2{a.pose.x + share * (b.x - a.pose.x), a.pose.y + share * (b.y - a.pose.y),
               wrap_angle(a.pose.yaw + share * wrap_angle(b.yaw - a.pose.yaw))};
}

}  // namespace skylight::service::reproduce
