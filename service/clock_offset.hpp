// How a robot's clock stands to ours, from messages that go one way only: a stamp by the robot's clock, an
// arrival by ours.
//
// A message is never early: its arrival less its stamp is its delay less the robot's lead, so the smallest of
// many is the one with the least delay in it (the minimum filter of NTP's clock filter, RFC 5905, section 10;
// S. Moon, P. Skelly, D. Towsley, "Estimation and removal of clock skew from network delay measurements",
// INFOCOM 1999). What delay is left in that one counts as the clock's: one way cannot tell the two apart.
#pragma once

#include <deque>
#include <optional>

#include "tracker/types.hpp"

namespace skylight::service {

class ClockOffset {
 public:
  /// Over which the smallest counts: clocks that drift by 50 ppm part by half a millisecond meanwhile.
  static constexpr Duration kWindow = std::chrono::seconds(10);
  /// Further from the rest a message is odd: much delayed, or its clock has been set.
  static constexpr Duration kOdd = std::chrono::milliseconds(250);
  /// Odd messages that agree to this, for so long and so many of them, tell of a clock that has been set;
  /// those of a network that catches up do not agree.
  static constexpr Duration kAgree = std::chrono::milliseconds(50);
  static constexpr Duration kSettled = std::chrono::seconds(1);
  static constexpr int kLeast = 5;

  /// A message: when it arrived by our clock, and its newest stamp by the robot's. Messages come in the order
  /// of arrival. False where it is odd: its stamps are not to be relied upon.
  bool hear(Time received, Time stamped);

  /// The robot's clock less ours; none before the first message. A stamp less this is the instant by our
  /// clock, never after the arrival of a message that is not odd.
  std::optional<Duration> offset() const;

  /// How often the clock was found to have been set.
  int jumps() const { return jumps_; }

 private:
  struct Message {
    Time received{};
    Duration late{};  ///< arrival less stamp
  };

  bool odd(const Message& message);
  void take(const Message& message);

  std::deque<Message> least_;  ///< of the window: each later and larger than the one before it
  std::optional<Message> odd_since_;
  int odd_count_ = 0;
  int jumps_ = 0;
};

}  // namespace skylight::service
