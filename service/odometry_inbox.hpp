// What robots say of their own motion, between the threads that hear it and the one that tracks.
//
// A reading waits here until a frame is as new as it is: then it goes to the tracker in the order of time, so
// that what the filter says of a frame is of that frame's instant and nothing later. Each robot has its own
// bounded queue; nobody waits for anybody.
#pragma once

#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "service/clock_offset.hpp"

namespace skylight::service {

/// One reading as the robot sent it.
struct OdometryReading {
  std::optional<Time> stamp{};  ///< by the robot's own clock; none: when it arrived
  BodyVelocity velocity{};      ///< its `at` is found from the stamp
};

/// What became of the readings of one message.
struct OdometryReceipt {
  std::size_t accepted = 0;
  std::size_t ignored = 0;
  std::string_view reason;               ///< in words, of those ignored; empty where there are none
  std::optional<Duration> clock_offset;  ///< robot's clock less ours; none where it has never stamped
};

struct HeardOdometry {
  std::string robot;
  BodyVelocity velocity;
};

/// All of it may be called from any thread.
class OdometryInbox {
 public:
  /// Readings kept per robot; of more the oldest are dropped and counted.
  static constexpr std::size_t kMost = 1000;
  /// Readings this much older than the newest frame are ignored: the filter would have to go back over all
  /// that came since, for each of them.
  static constexpr Duration kOldest = std::chrono::milliseconds(500);
  /// Readings nearer to another one of the same robot say nothing new and are ignored, and so are those
  /// before one that was taken already: what a robot says comes in order.
  static constexpr Duration kNearest = std::chrono::milliseconds(8);

  /// Takes in what one message of a robot says, which arrived at `received`.
  OdometryReceipt hear(const std::string& robot, const std::vector<OdometryReading>& readings, Time received);

  /// Those up to and with `until`, which is a frame's time; of each robot in the order of time.
  std::vector<HeardOdometry> take(Time until);

  /// The newest reading of a robot, with the robot's own stamp for its time; none where it has said nothing.
  std::optional<BodyVelocity> newest(const std::string& robot) const;

  /// Forgets all robots but these.
  void keep_only(const std::set<std::string>& robots);
  /// As if nothing had been said, nor any frame asked for.
  void clear();

  /// Readings that were dropped because they were too many.
  std::uint64_t dropped() const;

 private:
  struct Robot {
    ClockOffset clock;
    std::deque<BodyVelocity> waiting;    ///< by our clock, in the order of time
    std::optional<BodyVelocity> newest;  ///< as stamped
    std::optional<Time> used;            ///< of the newest that was taken
  };

  std::string_view put(Robot& robot, const BodyVelocity& velocity);

  mutable std::mutex mutex_;
  std::map<std::string, Robot> robots_;
  Time frame_ = Time::min();  ///< the newest that was asked for
  std::uint64_t dropped_ = 0;
};

}  // namespace skylight::service
