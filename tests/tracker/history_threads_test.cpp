// Readers and one writer of a history. Run under the thread sanitizer, this is the proof of the header's
// argument.
#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tracker/history.hpp"

namespace skylight {
namespace {

constexpr Time kStart{std::chrono::seconds(1'700'000'000)};

// Entry i says x = i in all that it holds.
HistoryEntry entry(int i) {
  const Time at = kStart + std::chrono::milliseconds(10) * i;
  const Pose2 pose{.x = static_cast<double>(i)};
  return {.captured = at,
          .state = TrackState::tracking,
          .measured = Observation{.captured = at, .pose = pose},
          .filtered = Estimate{.at = at, .pose = pose}};
}

/// As the service hands views on: behind a mutex that is held only to copy a pointer. (libstdc++ 12's
/// atomic shared pointer unlocks relaxed, which the thread sanitizer takes for a race.)
class Published {
 public:
  void set(std::shared_ptr<const HistoryView> view) {
    const std::lock_guard lock(mutex_);
    view_ = std::move(view);
  }
  std::shared_ptr<const HistoryView> get() const {
    const std::lock_guard lock(mutex_);
    return view_;
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const HistoryView> view_ = std::make_shared<const HistoryView>();
};

// How many entries of a view are not what was written.
int wrong_in(const HistoryView& view) {
  if (view.empty()) return 0;
  int wrong = 0;
  const double first = view.oldest().filtered->pose.x;
  for (std::size_t i = 0; i < view.size(); i += 7) {
    const double expected = first + static_cast<double>(i);
    if (view[i].filtered->pose.x != expected || view[i].measured->pose.x != expected) ++wrong;
  }
  const Time middle = view.oldest().captured + (view.newest().captured - view.oldest().captured) / 2;
  return wrong + (view.pose(PoseKind::filtered, middle).lookup == HistoryLookup::found ? 0 : 1);
}

TEST(PoseHistoryThreads, ReadersSeeWholeEntriesWhileOneThreadWrites) {
  Published published;
  std::atomic<bool> done{false};
  std::atomic<int> wrong{0};
  std::vector<std::thread> readers;
  for (int r = 0; r < 3; ++r) {
    readers.emplace_back([&] {
      while (!done.load()) wrong += wrong_in(*published.get());
    });
  }
  PoseHistory history({.max_age = std::chrono::seconds(1000), .max_entries = 700});
  for (int i = 0; i < 40'000; ++i) {
    history.append(entry(i));
    published.set(std::make_shared<const HistoryView>(history.view()));
  }
  done.store(true);
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(wrong.load(), 0);
  EXPECT_EQ(published.get()->size(), 700U);
}

}  // namespace
}  // namespace skylight
