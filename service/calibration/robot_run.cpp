#include "service/calibration/robot_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>

#include <Eigen/Geometry>

namespace skylight::calibration {
namespace {

// A look is judged by what the robot does within so much before and after it.
constexpr double kHalfWindow_s = 0.4;
constexpr double kEdge_s = 0.2;  // and used if it does the same for so long before and after
constexpr double kLongestGap_s = 1.0;
constexpr double kStanding_mps = 0.01;
constexpr double kStanding_radps = 0.03;
constexpr double kSpinning_radps = 0.1;
constexpr double kDriving_mps = 0.04;
constexpr double kSpinRadius_m = 0.2;
constexpr double kDriveRadius_m = 0.35;
// What counts as a stretch.
constexpr double kLeastStand_s = 0.4;
constexpr double kLeastSpin_rad = 0.5 * std::numbers::pi;
constexpr double kLeastDrive_m = 0.3;
// Odometry.
constexpr double kFurthestClock_s = 2.0;
constexpr double kClockStep_s = 0.02;
constexpr double kLargestYawMisfit_rad = 0.05;
constexpr double kLeastTurn_rad = 0.5;
constexpr double kLongestSilence_s = 0.5;

using Kinds = std::vector<std::optional<StretchKind>>;

// The looks of one camera, without gaps: places in RobotRun::seen, with what the assumed geometry makes of
// them.
struct Stream {
  std::vector<std::size_t> looks;
  std::vector<double> time_s;
  std::vector<Eigen::Vector2d> base;
  std::vector<double> yaw;  // goes on beyond pi
};

std::vector<Stream> streams_of(const RobotRun& run) {
  std::map<std::size_t, std::vector<Stream>> by_camera;
  const Eigen::Vector2d mounting =
      Eigen::Rotation2Dd(-run.assumed.mounting.yaw) * run.assumed.mounting.position();
  for (std::size_t i = 0; i < run.seen.size(); ++i) {
    const SeenRobot& seen = run.seen[i];
    std::vector<Stream>& streams = by_camera[seen.camera];
    const double time = to_seconds(seen.captured - run.seen.front().captured);
    if (streams.empty() || time - streams.back().time_s.back() > kLongestGap_s) streams.emplace_back();
    Stream& stream = streams.back();
    stream.yaw.push_back(stream.yaw.empty()
                             ? seen.pose.yaw
                             : stream.yaw.back() + wrap_angle(seen.pose.yaw - stream.yaw.back()));
    stream.looks.push_back(i);
    stream.time_s.push_back(time);
    stream.base.push_back(base_of(seen.pose, mounting));
  }
  std::vector<Stream> out;
  for (auto& [camera, streams] : by_camera) out.insert(out.end(), streams.begin(), streams.end());
  return out;
}

// First and last look within the window around look i.
std::pair<std::size_t, std::size_t> window_of(const Stream& stream, std::size_t i, double half_s) {
  const auto& t = stream.time_s;
  const auto low = std::lower_bound(t.begin(), t.end(), t[i] - half_s - 1e-6);
  const auto high = std::upper_bound(t.begin(), t.end(), t[i] + half_s + 1e-6);
  return {static_cast<std::size_t>(low - t.begin()), static_cast<std::size_t>(high - t.begin()) - 1};
}

std::optional<StretchKind> kind_at(const Stream& stream, std::size_t i) {
  const auto [first, last] = window_of(stream, i, kHalfWindow_s);
  const double time = stream.time_s[last] - stream.time_s[first];
  if (!(time > 0.0)) return std::nullopt;
  const double speed = (stream.base[last] - stream.base[first]).norm() / time;
  const double rate = std::abs(stream.yaw[last] - stream.yaw[first]) / time;
  if (speed < kStanding_mps && rate < kStanding_radps) return StretchKind::stand;
  if (rate >= kSpinning_radps && speed < kSpinRadius_m * rate) return StretchKind::spin;
  if (speed >= kDriving_mps && speed >= kDriveRadius_m * rate) return StretchKind::drive;
  return std::nullopt;
}

// Where something begins or ends, a look is not used.
Kinds settled_kinds(const Stream& stream) {
  Kinds raw;
  for (std::size_t i = 0; i < stream.looks.size(); ++i) raw.push_back(kind_at(stream, i));
  Kinds out = raw;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const auto [first, last] = window_of(stream, i, kEdge_s);
    for (std::size_t k = first; k <= last; ++k) {
      if (raw[k] != raw[i]) out[i].reset();
    }
  }
  return out;
}

bool is_long_enough(const Stretch& stretch, double time_s) {
  switch (stretch.kind) {
    case StretchKind::stand:
      return time_s >= kLeastStand_s;
    case StretchKind::spin:
      return std::abs(stretch.turned_rad) >= kLeastSpin_rad;
    case StretchKind::drive:
      return stretch.driven_m >= kLeastDrive_m;
  }
  return false;
}

void count(std::vector<LeftOut>& left_out, const std::string& reason, std::size_t looks) {
  if (looks > 0) left_out.push_back({reason, looks});
}

}  // namespace

Pose2 carried(const Pose2& seen, const Eigen::Vector3d& camera, double assumed_m, double height_m) {
  const Eigen::Vector2d under = camera.head<2>();
  const Eigen::Vector2d at =
      under + (seen.position() - under) * ((camera.z() - height_m) / (camera.z() - assumed_m));
  return {at.x(), at.y(), seen.yaw};
}

Eigen::Vector2d base_of(const Pose2& picture, const Eigen::Vector2d& mounting) {
  return picture.position() - Eigen::Rotation2Dd(picture.yaw) * mounting;
}

std::vector<Stretch> stretches_of(const RobotRun& run, std::vector<LeftOut>& left_out) {
  std::vector<Stretch> out;
  std::size_t between = 0;
  std::size_t brief = 0;
  for (const Stream& stream : streams_of(run)) {
    const Kinds kinds = settled_kinds(stream);
    for (std::size_t i = 0, next = 0; i < kinds.size(); i = next) {
      next = i + 1;
      if (!kinds[i]) {
        ++between;
        continue;
      }
      while (next < kinds.size() && kinds[next] == kinds[i]) ++next;
      Stretch stretch{.kind = *kinds[i],
                      .camera = run.seen[stream.looks[i]].camera,
                      .first = stream.looks[i],
                      .last = stream.looks[next - 1],
                      .turned_rad = stream.yaw[next - 1] - stream.yaw[i]};
      for (std::size_t k = i + 1; k < next; ++k)
        stretch.driven_m += (stream.base[k] - stream.base[k - 1]).norm();
      if (is_long_enough(stretch, stream.time_s[next - 1] - stream.time_s[i])) {
        out.push_back(stretch);
      } else {
        brief += next - i;
      }
    }
  }
  count(left_out, "between standing, turning on the spot and driving", between);
  count(left_out, "too short a stand, turn or drive", brief);
  return out;
}

OdometryPath::OdometryPath(const RobotRun& run) {
  if (run.odometry.empty() || run.seen.empty()) return;
  origin_ = run.seen.front().captured;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < run.odometry.size(); ++i) {
    const BodyVelocity& now = run.odometry[i];
    const double time = to_seconds(now.at - origin_);
    if (!times_s_.empty()) {
      const BodyVelocity& before = run.odometry[i - 1];
      if (!(time > times_s_.back())) continue;
      sum += 0.5 * (time - times_s_.back()) *
             Eigen::Vector3d(now.forward + before.forward, now.sideways + before.sideways,
                             now.yaw_rate + before.yaw_rate);
    }
    times_s_.push_back(time);
    sums_.push_back(sum);
  }
  std::vector<Eigen::Vector2d> yaws;  // time, yaw that goes on beyond pi
  for (const SeenRobot& seen : run.seen) {
    const double yaw =
        yaws.empty() ? seen.pose.yaw : yaws.back().y() + wrap_angle(seen.pose.yaw - yaws.back().y());
    yaws.emplace_back(to_seconds(seen.captured - origin_), yaw);
  }
  double least = misfit(yaws, 0.0);
  for (double step = kClockStep_s, span = kFurthestClock_s; step > 1e-4; span = step, step /= 10.0) {
    const double middle = offset_s_;
    for (double offset = middle - span; offset <= middle + span + 0.5 * step; offset += step) {
      const double here = misfit(yaws, offset);
      if (here >= least) continue;
      least = here;
      offset_s_ = offset;
    }
  }
  if (least <= kLargestYawMisfit_rad) return;
  times_s_.clear();
  if (std::isinf(least)) {
    problem_ = "the odometry was left out: it covers less than half of the looks, within 2 s of clock offset";
    return;
  }
  char text[160];
  std::snprintf(
      text, sizeof text,
      "the odometry was left out: it turns otherwise than the robot was seen to (%.1f degrees RMS), "
      "within 2 s of clock offset",
      least * 180.0 / std::numbers::pi);
  problem_ = text;
}

std::optional<Eigen::Vector3d> OdometryPath::at(double time_s) const {
  const auto next = std::lower_bound(times_s_.begin(), times_s_.end(), time_s);
  if (next == times_s_.begin() || next == times_s_.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(next - times_s_.begin());
  const double span = times_s_[i] - times_s_[i - 1];
  if (span > kLongestSilence_s) return std::nullopt;
  const double share = (time_s - times_s_[i - 1]) / span;
  return Eigen::Vector3d(sums_[i - 1] + share * (sums_[i] - sums_[i - 1]));
}

// Root mean square by which the yaw that was seen and the odometry's part, once both were made to begin
// alike; wheels that are a little nearer to each other than believed turn more by a constant share.
double OdometryPath::misfit(const std::vector<Eigen::Vector2d>& yaws, double offset_s) const {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  for (const Eigen::Vector2d& seen : yaws) {
    const auto said = at(seen.x() + offset_s);
    if (!said) continue;
    n += 1.0;
    x += said->z();
    y += seen.y();
    xx += said->z() * said->z();
    xy += said->z() * seen.y();
    yy += seen.y() * seen.y();
  }
  if (n < 3.0 || 2.0 * n < static_cast<double>(yaws.size())) return std::numeric_limits<double>::infinity();
  const double turned = std::sqrt(std::max(0.0, (xx - x * x / n) / n));
  const double slope = turned > kLeastTurn_rad ? (xy - x * y / n) / (xx - x * x / n) : 1.0;
  const double rest = (yy - y * y / n) - 2.0 * slope * (xy - x * y / n) + slope * slope * (xx - x * x / n);
  return std::sqrt(std::max(0.0, rest / n));
}

std::optional<Eigen::Vector2d> OdometryPath::between(Time from, Time to) const {
  if (times_s_.empty()) return std::nullopt;
  const auto a = at(to_seconds(from - origin_) + offset_s_);
  const auto b = at(to_seconds(to - origin_) + offset_s_);
  if (!a || !b) return std::nullopt;
  return Eigen::Vector2d((*b - *a).head<2>());
}

}  // namespace skylight::calibration
