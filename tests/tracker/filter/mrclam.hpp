// The UTIAS MRCLAM data set 6 (K. Y. K. Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu, "The UTIAS
// multi-robot cooperative localization and mapping dataset", Int. J. Robotics Research 30(8), 2011): five
// iRobot Create, their place by Vicon and the velocity that they were commanded to have.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracker/types.hpp"

namespace skylight::test {

class MrclamRobot {
 public:
  struct Said {
    double t = 0.0;  ///< s from the truth's first
    double u = 0.0;  ///< m/s
    double w = 0.0;  ///< rad/s
  };

  /// Robot 1 to 5; none where the data or xz is absent.
  static std::optional<MrclamRobot> load(const std::filesystem::path& folder, int robot) {
    const std::string stem = (folder / ("Robot" + std::to_string(robot))).string();
    MrclamRobot out;
    const auto truth = read(stem + "_Groundtruth.dat.xz", 4);
    const auto odometry = read(stem + "_Odometry.dat.xz", 3);
    if (truth.empty() || odometry.empty()) return std::nullopt;
    const double first = truth.front()[0];
    for (const auto& row : truth) {
      if (!out.time_.empty() && row[0] - first <= out.time_.back()) continue;
      out.time_.push_back(row[0] - first);
      out.pose_.push_back({row[1], row[2], row[3]});
    }
    for (const auto& row : odometry) out.said_.push_back({row[0] - first, row[1], row[2]});
    return out;
  }

  double seconds() const { return time_.back(); }
  const std::vector<Said>& said() const { return said_; }
  /// Between the two readings beside it; none where Vicon lost it for more than 0.1 s.
  std::optional<Pose2> at(double t) const {
    const auto after = std::upper_bound(time_.begin(), time_.end(), t);
    if (after == time_.begin() || after == time_.end()) return std::nullopt;
    const auto i = static_cast<std::size_t>(after - time_.begin());
    const double span = time_[i] - time_[i - 1];
    if (span > 0.1) return std::nullopt;
    const double share = (t - time_[i - 1]) / span;
    const Pose2& a = pose_[i - 1];
    const Pose2& b = pose_[i];
    return Pose2{a.x + share * (b.x - a.x), a.y + share * (b.y - a.y),
                 a.yaw + share * std::remainder(b.yaw - a.yaw, 2.0 * std::numbers::pi)};
  }

 private:
  static std::vector<std::array<double, 4>> read(const std::string& file, int columns) {
    std::vector<std::array<double, 4>> rows;
    if (!std::filesystem::exists(file)) return rows;
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(("xz -dc '" + file + "'").c_str(), "r"), pclose);
    std::array<char, 256> line{};
    while (pipe && std::fgets(line.data(), line.size(), pipe.get()) != nullptr) {
      std::array<double, 4> row{};
      if (std::sscanf(line.data(), "%lf %lf %lf %lf", &row[0], &row[1], &row[2], &row[3]) == columns)
        rows.push_back(row);
    }
    return rows;
  }

  std::vector<double> time_;
  std::vector<Pose2> pose_;
  std::vector<Said> said_;
};

}  // namespace skylight::test
