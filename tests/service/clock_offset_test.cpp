// A robot's clock, judged against the one that the test sets.
#include "service/clock_offset.hpp"

#include <gtest/gtest.h>

#include "tests/service/fakes.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// Messages every 20 ms, each 1 to 31 ms under way in an order that looks like chance; every 16th is quick.
struct Sender {
  ClockOffset clock{};
  Duration lead{};  ///< of the robot's clock
  int sent = 0;
  int odd = 0;

  static Duration delay(int i) { return milliseconds(1 + i * 7 % 16 * 2); }
  Time now() const { return kStart + milliseconds(20) * sent; }

  void send(int count) {
    for (int i = 0; i < count; ++i, ++sent) odd += clock.hear(now() + delay(sent), now() + lead) ? 0 : 1;
  }
  double error_ms() const { return to_seconds(clock.offset().value() - lead) * 1e3; }
};

TEST(ClockOffset, IsNotKnownBeforeTheFirstMessage) {
  EXPECT_FALSE(ClockOffset{}.offset());
}

TEST(ClockOffset, IsThatOfTheMessageWithTheLeastDelay) {
  for (const Duration lead : {Duration(0), Duration(milliseconds(-137)), Duration(std::chrono::hours(240))}) {
    Sender sender{.lead = lead};
    sender.send(16);
    EXPECT_NEAR(sender.error_ms(), -1.0, 1e-9) << "all but that message's one millisecond";
    EXPECT_EQ(sender.odd, 0);
  }
}

TEST(ClockOffset, AStampLessTheOffsetIsNeverAfterItsArrival) {
  ClockOffset clock;
  for (int i = 0; i < 200; ++i) {
    const Time stamped = kStart + milliseconds(20 * i + 400);
    const Time received = kStart + milliseconds(20 * i) + Sender::delay(i * i);
    ASSERT_TRUE(clock.hear(received, stamped));
    EXPECT_LE(stamped - *clock.offset(), received);
  }
}

TEST(ClockOffset, FollowsAClockThatDriftsWithinAMillisecond) {
  // 50 parts in a million, as a cheap crystal's: over five minutes 15 ms.
  ClockOffset clock;
  double worst = 0.0;
  for (int i = 0; i < 15'000; ++i) {
    const Time now = kStart + milliseconds(20) * i;
    const Duration lead = microseconds(i);  // 20 ms * 50e-6
    ASSERT_TRUE(clock.hear(now + Sender::delay(i), now + lead));
    if (i > 16) worst = std::max(worst, std::abs(to_seconds(*clock.offset() - lead)));
  }
  EXPECT_LT(worst, 2e-3) << "one millisecond of delay, half a millisecond of drift";
  EXPECT_EQ(clock.jumps(), 0);
}

TEST(ClockOffset, AMessageThatWasLongUnderWayIsOddAndChangesNothing) {
  Sender sender{.lead = milliseconds(80)};
  sender.send(50);
  const auto before = sender.clock.offset();
  EXPECT_FALSE(sender.clock.hear(sender.now() + seconds(1), sender.now() + sender.lead));
  EXPECT_FALSE(sender.clock.hear(sender.now(), sender.now() + std::chrono::hours(1))) << "a stamp gone wrong";
  EXPECT_EQ(sender.clock.offset(), before);
  sender.send(10);
  EXPECT_EQ(sender.odd, 0);
  EXPECT_EQ(sender.clock.jumps(), 0);
}

TEST(ClockOffset, AClockThatIsSetIsFoundOutWithinASecondOrTwo) {
  for (const Duration jump : {Duration(milliseconds(-400)), Duration(seconds(3)), Duration(seconds(-3600))}) {
    Sender sender{.lead = milliseconds(80)};
    sender.send(100);
    sender.lead += jump;
    sender.send(75);
    EXPECT_EQ(sender.clock.jumps(), 1);
    EXPECT_NEAR(sender.error_ms(), -1.0, 1e-9);
    EXPECT_LE(sender.odd, 52) << "a second's messages";
    EXPECT_GE(sender.odd, 45) << "not on the word of a few";
  }
}

TEST(ClockOffset, ANetworkThatCatchesUpIsNoClockThatWasSet) {
  Sender sender{};
  sender.send(100);
  // Three seconds held up, then delivered within one: each is less late than the one before.
  const Time again = sender.now() + seconds(3);
  for (int i = 0; i < 150; ++i)
    sender.clock.hear(again + milliseconds(7) * i, sender.now() + milliseconds(20) * i);
  EXPECT_EQ(sender.clock.jumps(), 0);
  EXPECT_NEAR(sender.error_ms(), -1.0, 1e-9);
}

}  // namespace
}  // namespace skylight::service::test
