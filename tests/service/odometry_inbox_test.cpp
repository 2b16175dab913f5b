#include "service/odometry_inbox.hpp"

#include <gmock/gmock.h>

#include "tests/service/fakes.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

/// Stamped so long after kStart.
OdometryReading said(Duration after_start, double forward = 0.2) {
  OdometryReading reading{.stamp = kStart + after_start, .velocity = {}};
  reading.velocity.forward = forward;
  return reading;
}

std::vector<Time> times(const std::vector<HeardOdometry>& heard) {
  std::vector<Time> out;
  for (const HeardOdometry& each : heard) out.push_back(each.velocity.at);
  return out;
}

TEST(OdometryInbox, AReadingWaitsForTheFrameThatIsAsNewAndGoesOnce) {
  OdometryInbox inbox;
  for (const int at : {0, 20, 40}) inbox.hear("anna", {said(milliseconds(at))}, kStart + milliseconds(at));
  EXPECT_THAT(times(inbox.take(kStart + milliseconds(20))),
              testing::ElementsAre(kStart, kStart + milliseconds(20)));
  EXPECT_THAT(times(inbox.take(kStart + milliseconds(33))), testing::IsEmpty());
  EXPECT_THAT(times(inbox.take(kStart + milliseconds(66))), testing::ElementsAre(kStart + milliseconds(40)));
}

TEST(OdometryInbox, AMessageOfManyIsPutInTheOrderOfTime) {
  OdometryInbox inbox;
  const auto receipt =
      inbox.hear("anna", {said(milliseconds(40)), said(milliseconds(0)), said(milliseconds(20))},
                 kStart + milliseconds(40));
  EXPECT_EQ(receipt.accepted, 3U);
  EXPECT_THAT(times(inbox.take(kStart + milliseconds(50))),
              testing::ElementsAre(kStart, kStart + milliseconds(20), kStart + milliseconds(40)));
}

TEST(OdometryInbox, StampsAreBroughtToOurClock) {
  OdometryInbox inbox;
  // Ten days ahead, and two milliseconds under way.
  const auto ahead = std::chrono::hours(240);
  OdometryReceipt receipt;
  for (int i = 0; i < 10; ++i) {
    receipt = inbox.hear("anna", {said(ahead + milliseconds(20) * i)}, kStart + milliseconds(20 * i + 2));
  }
  EXPECT_EQ(receipt.clock_offset, ahead - milliseconds(2));
  const auto heard = inbox.take(kStart + milliseconds(500));
  ASSERT_EQ(heard.size(), 10U);
  EXPECT_EQ(heard[9].velocity.at, kStart + milliseconds(182));
  EXPECT_EQ(inbox.newest("anna")->at, kStart + ahead + milliseconds(180)) << "as the robot stamped it";
}

TEST(OdometryInbox, WithoutAStampItIsOfWhenItArrived) {
  OdometryInbox inbox;
  const auto receipt = inbox.hear("anna", {{}}, kStart + milliseconds(5));
  EXPECT_EQ(receipt.accepted, 1U);
  EXPECT_FALSE(receipt.clock_offset);
  EXPECT_THAT(times(inbox.take(kStart + milliseconds(5))), testing::ElementsAre(kStart + milliseconds(5)));
}

TEST(OdometryInbox, WhatIsTooOldTooDenseOrUsedAlreadyIsIgnoredWithAReason) {
  OdometryInbox inbox;
  const auto told = [&](Duration stamp) { return inbox.hear("anna", {said(stamp)}, kStart + seconds(2)); };
  told(seconds(2));  // the clocks agree
  inbox.take(kStart + seconds(2));
  EXPECT_THAT(std::string(told(milliseconds(1995)).reason), HasSubstr("used already"));
  EXPECT_EQ(told(milliseconds(1995)).ignored, 1U);
  const auto old = inbox.hear("ben", {said(milliseconds(1499)), said(milliseconds(1500)), said(seconds(2))},
                              kStart + seconds(2));
  EXPECT_EQ(old.accepted, 2U);
  EXPECT_EQ(old.ignored, 1U);
  EXPECT_THAT(std::string(old.reason), HasSubstr("older than the newest frame"));
  const auto dense =
      inbox.hear("ben", {said(milliseconds(1992)), said(milliseconds(1993))}, kStart + seconds(2));
  EXPECT_EQ(dense.accepted, 1U);
  EXPECT_THAT(std::string(dense.reason), HasSubstr("less than 8 ms"));
}

TEST(OdometryInbox, WhileARobotsClockIsInDoubtItIsNotReliedUpon) {
  OdometryInbox inbox;
  for (int i = 0; i < 10; ++i)
    inbox.hear("anna", {said(milliseconds(20 * i))}, kStart + milliseconds(20 * i));
  const auto odd = inbox.hear("anna", {said(seconds(60))}, kStart + milliseconds(200));
  EXPECT_EQ(odd.accepted, 0U);
  EXPECT_THAT(std::string(odd.reason), HasSubstr("clock"));
  EXPECT_EQ(odd.clock_offset, Duration::zero());
}

TEST(OdometryInbox, KeepsABoundedNumberOfEachRobotTheNewest) {
  OdometryInbox inbox;
  inbox.hear("ben", {said({})}, kStart);
  for (int i = 0; i < 1200; ++i)
    inbox.hear("anna", {said(milliseconds(10 * i))}, kStart + milliseconds(10 * i));
  EXPECT_EQ(inbox.dropped(), 200U);
  const auto heard = inbox.take(kStart + seconds(12));
  EXPECT_EQ(heard.back().velocity.at, kStart + milliseconds(11'990));
  EXPECT_EQ(heard.front().velocity.at, kStart + milliseconds(11'500)) << "and of those no older than is used";
}

TEST(OdometryInbox, WhoIsGoneIsForgotten) {
  OdometryInbox inbox;
  inbox.hear("anna", {said({})}, kStart);
  inbox.hear("ben", {said({})}, kStart);
  inbox.keep_only({"ben"});
  EXPECT_FALSE(inbox.newest("anna"));
  EXPECT_TRUE(inbox.newest("ben"));
  EXPECT_EQ(inbox.take(kStart).size(), 1U);
  inbox.clear();
  EXPECT_FALSE(inbox.newest("ben"));
}

}  // namespace
}  // namespace skylight::service::test
