#include "service/event_log.hpp"

#include <algorithm>
#include <set>
#include <thread>

#include <gmock/gmock.h>

#include "tests/service/fakes.hpp"

namespace skylight::service::test {
namespace {

using testing::ElementsAre;

std::vector<std::uint64_t> numbers(const EventPage& page) {
  std::vector<std::uint64_t> out;
  for (const auto& event : page.items) out.push_back(event->sequence);
  return out;
}

Event event_of(const std::string& kind, const std::string& camera = {}) {
  return {.kind = kind, .camera = camera, .message = kind};
}

TEST(EventLog, NumbersAndDatesWhatIsAdded) {
  FakeClock clock;
  EventLog log(clock.function());
  EXPECT_EQ(log.read().oldest, 0U);
  EXPECT_EQ(log.read().next, 0U);
  EXPECT_EQ(log.add(event_of("a")), 1U);
  clock.advance(std::chrono::seconds(2));
  EXPECT_EQ(log.add(event_of("b")), 2U);
  const EventPage page = log.read();
  EXPECT_THAT(numbers(page), ElementsAre(1, 2));
  EXPECT_EQ(page.items[1]->at - page.items[0]->at, std::chrono::seconds(2));
  EXPECT_EQ(to_line(*page.items[0]), "a: a");
}

TEST(EventLog, KeepsTheNewestAndTellsWhoComesTooLate) {
  EventLog log(system_now, 3);
  for (int i = 0; i < 5; ++i) log.add(event_of("a"));
  EXPECT_THAT(numbers(log.read()), ElementsAre(3, 4, 5));
  EXPECT_FALSE(log.read().dropped) << "who asks for the newest has missed nothing";
  EXPECT_FALSE(log.read({.since = 2}).dropped) << "3 is the next, and is there";
  EXPECT_THAT(numbers(log.read({.since = 2})), ElementsAre(3, 4, 5));
  EXPECT_TRUE(log.read({.since = 1}).dropped) << "2 is gone";
  EXPECT_THAT(numbers(log.read({.since = 1})), ElementsAre(3, 4, 5));
  EXPECT_TRUE(log.read({.since = 6}).dropped) << "there never was a 6: another run's";
  EXPECT_THAT(numbers(log.read({.since = 6})), ElementsAre(3, 4, 5));
  EXPECT_EQ(log.read({.since = 1}).oldest, 3U);
  EXPECT_THAT(numbers(log.read({.since = 5})), ElementsAre());
  EXPECT_FALSE(log.read({.since = 5}).dropped);
}

TEST(EventLog, APageGoesOnWhereTheOneBeforeEnded) {
  EventLog log;
  for (int i = 0; i < 7; ++i) log.add(event_of(i % 2 == 0 ? "even" : "odd"));
  std::vector<std::uint64_t> seen;
  for (std::uint64_t since = 0;;) {
    const EventPage page = log.read({.since = since, .limit = 3, .kind = "even"});
    if (page.items.empty()) break;
    for (const auto number : numbers(page)) seen.push_back(number);
    since = page.next;
  }
  EXPECT_THAT(seen, ElementsAre(1, 3, 5, 7));
  EXPECT_THAT(numbers(log.read({.limit = 2, .kind = "odd"})), ElementsAre(4, 6))
      << "without since: the newest";
}

TEST(EventLog, PicksByKindCameraRobotAndSeverity) {
  EventLog log;
  log.add(event_of("camera.moved", "a"));
  log.add(event_of("camera.back", "b"));
  log.add(event_of("cameras.disagree", "a"));
  log.add({.kind = "robot.lost", .severity = Severity::warning, .robot = "r", .message = "gone"});
  log.add({.kind = "source.state", .severity = Severity::error, .message = "failed"});
  EXPECT_THAT(numbers(log.read({.kind = "camera"})), ElementsAre(1, 2)) << "cameras is another word";
  EXPECT_THAT(numbers(log.read({.kind = "camera.back"})), ElementsAre(2));
  EXPECT_THAT(numbers(log.read({.camera = "a"})), ElementsAre(1, 3));
  EXPECT_THAT(numbers(log.read({.robot = "r"})), ElementsAre(4));
  EXPECT_THAT(numbers(log.read({.least = Severity::warning})), ElementsAre(4, 5));
  EXPECT_THAT(numbers(log.read({.least = Severity::error})), ElementsAre(5));
}

TEST(EventLog, AListenerThatReadsFromWhereItWasMissesNothing) {
  constexpr int kThreads = 4;
  constexpr int kEach = 500;
  EventLog log(system_now, kThreads * kEach);
  std::mutex mutex;
  std::uint64_t since = 0;
  std::vector<std::uint64_t> stored;
  log.listen([&](const Event&) {
    const std::lock_guard lock(mutex);
    const EventPage page = log.read({.since = since, .limit = 10});
    for (const auto number : numbers(page)) stored.push_back(number);
    since = page.next;
  });
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < kEach; ++k) log.add(event_of("a"));
    });
  }
  for (std::thread& thread : threads) thread.join();
  ASSERT_EQ(stored.size(), static_cast<std::size_t>(kThreads * kEach));
  EXPECT_TRUE(std::is_sorted(stored.begin(), stored.end()));
  EXPECT_EQ(std::set(stored.begin(), stored.end()).size(), stored.size());
}

}  // namespace
}  // namespace skylight::service::test
