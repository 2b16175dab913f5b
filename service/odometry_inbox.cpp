#include "service/odometry_inbox.hpp"

#include <algorithm>

namespace skylight::service {
namespace {

constexpr std::string_view kOddClock =
    "the robot's clock seems to have been set, or the message was long under way";
constexpr std::string_view kTooOld = "more than 0.5 s older than the newest frame";
constexpr std::string_view kTooMany = "less than 8 ms from another reading";
constexpr std::string_view kUsed = "not later than one that was used already";

}  // namespace

OdometryReceipt OdometryInbox::hear(const std::string& robot, const std::vector<OdometryReading>& readings,
                                    Time received) {
  std::optional<Time> newest;
  for (const OdometryReading& reading : readings) newest = std::max(newest, reading.stamp);

  const std::lock_guard lock(mutex_);
  Robot& said = robots_[robot];
  const bool relied = !newest || said.clock.hear(received, *newest);
  OdometryReceipt out{.accepted = 0, .ignored = 0, .reason = {}, .clock_offset = said.clock.offset()};
  for (const OdometryReading& reading : readings) {
    BodyVelocity velocity = reading.velocity;
    velocity.at = reading.stamp.value_or(received);
    if (!said.newest || velocity.at >= said.newest->at || !relied) said.newest = velocity;
    if (reading.stamp) velocity.at -= *out.clock_offset;
    const std::string_view why = reading.stamp && !relied ? kOddClock : put(said, velocity);
    ++(why.empty() ? out.accepted : out.ignored);
    if (!why.empty()) out.reason = why;
  }
  return out;
}

/// Empty, or why not.
std::string_view OdometryInbox::put(Robot& robot, const BodyVelocity& velocity) {
  if (frame_ != Time::min() && velocity.at < frame_ - kOldest) return kTooOld;
  if (robot.used && velocity.at < *robot.used + kNearest) return kUsed;
  const auto after =
      std::upper_bound(robot.waiting.begin(), robot.waiting.end(), velocity,
                       [](const BodyVelocity& a, const BodyVelocity& b) { return a.at < b.at; });
  if (after != robot.waiting.end() && after->at - velocity.at < kNearest) return kTooMany;
  if (after != robot.waiting.begin() && velocity.at - std::prev(after)->at < kNearest) return kTooMany;
  robot.waiting.insert(after, velocity);
  if (robot.waiting.size() > kMost) {
    robot.waiting.pop_front();
    ++dropped_;
  }
  return {};
}

std::vector<HeardOdometry> OdometryInbox::take(Time until) {
  std::vector<HeardOdometry> out;
  const std::lock_guard lock(mutex_);
  frame_ = std::max(frame_, until);
  for (auto& [id, robot] : robots_) {
    while (!robot.waiting.empty() && robot.waiting.front().at <= until) {
      // What waited while frames did not come may have grown old meanwhile.
      if (robot.waiting.front().at >= frame_ - kOldest) out.push_back({id, robot.waiting.front()});
      robot.used = robot.waiting.front().at;
      robot.waiting.pop_front();
    }
  }
  return out;
}

std::optional<BodyVelocity> OdometryInbox::newest(const std::string& robot) const {
  const std::lock_guard lock(mutex_);
  const auto at = robots_.find(robot);
  return at == robots_.end() ? std::nullopt : at->second.newest;
}

void OdometryInbox::keep_only(const std::set<std::string>& robots) {
  const std::lock_guard lock(mutex_);
  std::erase_if(robots_, [&](const auto& each) { return !robots.contains(each.first); });
}

void OdometryInbox::clear() {
  const std::lock_guard lock(mutex_);
  robots_.clear();
  frame_ = Time::min();
}

std::uint64_t OdometryInbox::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

}  // namespace skylight::service
