// A robot's poses over time: written by one thread, read by any number without a lock.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "tracker/types.hpp"

namespace skylight {

struct HistoryLimits {
  Duration max_age = std::chrono::minutes(10);  ///< older entries are dropped, > 0
  std::size_t max_entries = 60'000;             ///< 10 min at 100 Hz; at least 1
};

/// A pose read out of a history, between two entries or at one.
struct HistoryPose {
  PoseKind kind = PoseKind::filtered;
  TrackState state = TrackState::searching;
  PoseSource source = PoseSource::prediction;
  Estimate estimate;         ///< at the instant that was asked for
  Time captured{};           ///< capture time of the newest entry that went into it
  std::size_t camera = 0;
  double score = 0.0;
  int heading_turns = 1;
};

/// An immutable view of a history up to some entry. Cheap to copy; holds the entries that it shows alive.
class HistoryView;   // (left to the implementation: size(), operator[](i), oldest(), newest(),
                     //  pose(kind, at) -> std::optional<HistoryPose>, range(from, to) -> [first, last))

/// Append-only; entries never change once written. Memory is bounded by the limits (give or take a chunk).
class PoseHistory;   // (left to the implementation: append(entry), view())

}  // namespace skylight
