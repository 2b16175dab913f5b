// A robot's poses over time: written by one thread, read by any number without a lock.
//
// Entries lie in chunks of fixed size, and a view is a shared pointer to an immutable list of chunks with the
// numbers of the first and the last entry that it shows. Why no reader races with the writer:
//  - an entry is written once, before any view that shows it exists, and never again;
//  - appending writes to the first free entry of the last chunk, which no view so far shows, and a view never
//    reads past its last entry;
//  - smoothed poses come later and lie beside the entries: in their order, each written once, and a view
//  never
//    reads past the last that was there when it was made;
//  - when a chunk is full a new list is made; old lists, and with them the chunks that fell out, live on in
//    the views that hold them.
// So a view needs no atomics of its own. Handing one to another thread must synchronise, as any hand-over
// does (a mutex, a queue, or std::atomic<std::shared_ptr<const HistoryView>>): that makes the writes to its
// entries visible.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracker/types.hpp"

namespace skylight {

struct HistoryLimits {
  Duration max_age = std::chrono::minutes(10);  ///< entries this much older than the newest are dropped, > 0
  std::size_t max_entries = 60'000;             ///< 10 min at 100 Hz; at least 1
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const HistoryLimits& limits);

/// A pose read out of a history, between two entries or at one.
struct HistoryPose {
  PoseKind kind = PoseKind::filtered;
  TrackState state = TrackState::searching;  ///< of the newest entry that went into it
  /// Of that entry: what was measured; `prediction` for a filtered pose that took no measurement.
  PoseSource source = PoseSource::prediction;
  Estimate estimate;      ///< at the instant that was asked for; no velocity (0) where measured
  Time captured{};        ///< capture time of the newest entry that went into it
  double score = 0.0;     ///< 0 where source is `prediction`
  int heading_turns = 1;  ///< of the newest measurement up to `captured`; 1 where there is none
};

/// Where an instant lies, and whether a pose stands there.
enum class HistoryLookup : std::uint8_t {
  found,
  before_history,  ///< before the oldest entry: dropped, or not yet begun
  after_history,   ///< after the newest entry: for the tracker's prediction
  no_pose          ///< within, but the robot had no such pose then; or the history is empty
};

struct HistoryAnswer {
  HistoryLookup lookup = HistoryLookup::no_pose;
  std::optional<HistoryPose> pose;  ///< present exactly where `found`
};

/// Entries first to last - 1.
struct HistoryRange {
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t size() const { return last - first; }
  friend bool operator==(const HistoryRange&, const HistoryRange&) = default;
};

/// An immutable view of a history up to some entry. Cheap to copy; holds the entries that it shows alive.
class HistoryView {
 public:
  /// Poses further apart in time than this are not interpolated between, unless asked otherwise.
  static constexpr Duration kMaxGap = std::chrono::milliseconds(500);

  HistoryView() = default;

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  /// Entry i in order of time, i < size().
  const HistoryEntry& operator[](std::size_t i) const {
    const std::size_t place = first_ + i;
    return (*chunks_)[place / kChunk]->entries[place % kChunk];
  }
  /// Not on an empty view.
  const HistoryEntry& oldest() const { return (*this)[0]; }
  const HistoryEntry& newest() const { return (*this)[size_ - 1]; }

  /// The pose at an instant. At an entry that has one, exactly that; between entries: x, y, velocity and
  /// covariance linear, yaw along the shorter arc.
  ///  - measured: between the nearest two entries with a measurement;
  ///  - filtered: between neighbouring entries, both with an estimate: where the filter said that it had
  ///    none, none is made up;
  ///  - smoothed: the same, between entries that are settled; `after_history` beyond them;
  ///  - predicted: not kept here, `no_pose` within the history.
  /// None between two poses further apart than max_gap.
  HistoryAnswer pose(PoseKind kind, Time at, Duration max_gap = kMaxGap) const;

  /// The smoothed pose of entry i < settled(); none where the robot was not known then.
  const std::optional<Estimate>& smoothed(std::size_t i) const {
    const std::size_t place = first_ + i;
    return (*chunks_)[place / kChunk]->smoothed[place % kChunk];
  }
  /// Entries, from the oldest on, whose smoothed pose is final.
  std::size_t settled() const { return settled_; }

  /// The entries with from <= captured <= to; an empty range where there are none or from > to.
  HistoryRange range(Time from, Time to) const;

 private:
  friend class PoseHistory;
  static constexpr std::size_t kChunk = 128;
  struct Chunk {
    std::array<HistoryEntry, kChunk> entries;
    std::array<std::optional<Estimate>, kChunk> smoothed;
  };
  using Chunks = std::vector<std::shared_ptr<Chunk>>;

  std::size_t first_at_or_after(Time at) const;
  std::optional<HistoryPose> measured(Time at, std::size_t next, Duration max_gap) const;
  /// Filtered and smoothed.
  std::optional<HistoryPose> estimated(PoseKind kind, Time at, std::size_t next, Duration max_gap) const;
  const std::optional<Estimate>& estimate(PoseKind kind, std::size_t i) const {
    return kind == PoseKind::smoothed ? smoothed(i) : (*this)[i].filtered;
  }
  Estimate pose_of(PoseKind kind, std::size_t i) const;
  HistoryPose at_entry(PoseKind kind, std::size_t i) const;
  HistoryPose between(PoseKind kind, std::size_t before, std::size_t after, Time at) const;

  std::shared_ptr<const Chunks> chunks_;
  std::size_t first_ = 0;  ///< place of entry 0, counted from the first chunk of the list
  std::size_t size_ = 0;
  std::size_t settled_ = 0;
};

/// Append-only; entries never change once written. Shows no more than the limits allow; memory holds up to
/// two chunks of entries more. For one writing thread; readers take views.
class PoseHistory {
 public:
  /// Throws std::invalid_argument with check()'s message.
  explicit PoseHistory(const HistoryLimits& limits = {});

  /// False, and nothing appended, where the entry is not later than the newest. Its `captured` is taken for
  /// the time of its measured and filtered poses too.
  bool append(const HistoryEntry& entry);

  /// Smoothed poses that have become final, in order of time: every entry up to and with `until` is settled,
  /// with the pose of its very instant or, where there is none among these, without.
  void settle(const std::vector<Estimate>& smoothed, Time until);

  /// The history as it now stands.
  HistoryView view() const { return now_; }

  /// Chunks that the history itself holds, of entries_per_chunk() each.
  std::size_t chunk_count() const { return now_.chunks_->size(); }
  static constexpr std::size_t entries_per_chunk() { return HistoryView::kChunk; }

 private:
  HistoryLimits limits_;
  HistoryView now_;
};

}  // namespace skylight
