// Streams' stamps on our clock, judged against the instants at which the pictures were truly taken.
#include "service/sources/live/stream_clock.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/service/live/scripted_driver.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A network that lets one picture in ten through at once and holds the others up, by chance, up to 80 ms.
Duration hold_up(std::uint64_t i) {
  std::uint64_t x = i * 0x9e3779b97f4a7c15ULL + 0x1234;
  x ^= x >> 29;
  x *= 0xbf58476d1ce4e5b9ULL;
  x ^= x >> 32;
  return x % 10 == 0 ? Duration{} : Duration(microseconds(x / 10 % 80'000));
}

constexpr Duration kQuickest = milliseconds(95);  ///< encoder, network, decoder: what latency_s is told
constexpr Duration kOrigin = std::chrono::hours(11);

TEST(StreamClock, JitterOfTheArrivalsDoesNotReachTheTimesOfThePictures) {
  Scripted camera({.latency = kQuickest});
  std::vector<Time> truth;
  for (std::uint64_t i = 0; i < 900; ++i) {
    const Duration shot = milliseconds(33) * i;
    truth.push_back(kMorning + shot);
    camera.script.picture(shot + kQuickest + hold_up(i), noisy_picture(i),
                          [shot](Shot& picture) { picture.stamp = kOrigin + shot; });
  }
  camera.run();
  ASSERT_GT(camera.frames.size(), 865U);
  double worst_ms = 0.0;
  for (const Frame& frame : camera.frames) {
    const double error_ms = to_seconds(frame.captured - truth[frame.sequence]) * 1e3;
    EXPECT_LE(error_ms, 80.0);
    if (frame.sequence > 60) worst_ms = std::max(worst_ms, std::abs(error_ms));  // two seconds to settle
  }
  EXPECT_LT(worst_ms, 0.001) << "arrivals alone would be off by up to 80 ms";
}

TEST(StreamClock, FollowsACameraWhoseCrystalIsSlow) {
  // 100 parts in a million, ten minutes: 60 ms apart at the end.
  Scripted camera({.latency = kQuickest});
  double worst_ms = 0.0;
  StreamClock clock;
  for (std::uint64_t i = 0; i < 18'000; ++i) {
    const Duration shot = milliseconds(33) * i;
    const Duration stamp = kOrigin + shot - shot / 10'000;
    const auto at = clock.instant(stamp, kMorning + shot + kQuickest + hold_up(i));
    ASSERT_TRUE(at);
    if (i > 60) worst_ms = std::max(worst_ms, std::abs(to_seconds(*at - kQuickest - kMorning - shot) * 1e3));
  }
  EXPECT_LT(worst_ms, 1.1) << "over the ten seconds of the window it drifts by one millisecond";
}

TEST(StreamClock, APictureAfterAStallKeepsItsTimeOrHasNone) {
  StreamClock clock;
  int without = 0;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const Duration shot = milliseconds(33) * i;
    // Nothing comes from 10 s to 11.5 s; then all of it within a moment.
    const bool stalled = shot > seconds(10) && shot < milliseconds(11'500);
    const Duration arrives = stalled ? milliseconds(11'500) + microseconds(100 * i) : shot + hold_up(i) / 10;
    const auto at = clock.instant(kOrigin + shot, kMorning + arrives);
    if (!at) ++without;
    if (at && i > 60) {
      EXPECT_LT(std::abs(to_seconds(*at - kMorning - shot)), 1e-6) << "picture " << i;
    }
  }
  EXPECT_GT(without, 20);
  EXPECT_LT(without, 46);
}

TEST(StreamClock, TheBurstAtAStreamsBeginningIsNotTakenForItsOwnDelay) {
  // A server sends what it has kept: 0.9 s of pictures within a moment, then the rest as they are taken.
  Scripted camera({.latency = kQuickest});
  for (std::uint64_t i = 0; i < 120; ++i) {
    const Duration shot = milliseconds(33) * i;
    const Duration arrives = std::max<Duration>(shot, milliseconds(900) + microseconds(100) * i) + kQuickest;
    camera.script.picture(arrives, noisy_picture(i),
                          [shot](Shot& picture) { picture.stamp = kOrigin + shot; });
  }
  camera.run();
  ASSERT_GT(camera.frames.size(), 30U);
  for (const Frame& frame : camera.frames) {
    const Time truth = kMorning + milliseconds(33) * frame.sequence;
    EXPECT_LT(std::abs(to_seconds(frame.captured - truth)), 1e-6) << frame.sequence;
  }
}

TEST(StreamClock, FindsOutThatTheStreamHasBegunAnewWithinTwoSeconds) {
  StreamClock clock;
  int without = 0;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const Duration shot = milliseconds(33) * i;
    const Duration stamp = i < 300 ? kOrigin + shot : shot - seconds(9);
    const auto at = clock.instant(stamp, kMorning + shot + hold_up(i) / 10);
    if (!at) ++without;
    if (at && (i < 300 ? i > 60 : i > 400)) {
      EXPECT_LT(std::abs(to_seconds(*at - kMorning - shot)), 1e-6) << "picture " << i;
    }
  }
  EXPECT_GT(without, 0);
  EXPECT_LE(without, 60);
}

}  // namespace
}  // namespace skylight::service::test
