#include "tracker/history.hpp"

#include <sstream>
#include <stdexcept>

namespace skylight {
namespace {

double mix(double a, double b, double share) {
  return a + (b - a) * share;
}

/// The estimate `share` of the way from a to b.
Estimate interpolate(const Estimate& a, const Estimate& b, double share) {
  Estimate out;
  out.pose.x = mix(a.pose.x, b.pose.x, share);
  out.pose.y = mix(a.pose.y, b.pose.y, share);
  out.pose.yaw = wrap_angle(a.pose.yaw + share * wrap_angle(b.pose.yaw - a.pose.yaw));
  out.velocity = {mix(a.velocity.x, b.velocity.x, share), mix(a.velocity.y, b.velocity.y, share),
                  mix(a.velocity.yaw_rate, b.velocity.yaw_rate, share)};
  out.covariance = (1.0 - share) * a.covariance + share * b.covariance;
  out.cameras = a.cameras | b.cameras;
  return out;
}

}  // namespace

std::string check(const HistoryLimits& limits) {
  std::ostringstream out;
  if (limits.max_age <= Duration::zero()) {
    out << "max_age is " << to_seconds(limits.max_age) << " s, must be above 0";
  } else if (limits.max_entries < 1) {
    out << "max_entries is 0, must be at least 1";
  }
  return out.str();
}

std::size_t HistoryView::first_at_or_after(Time at) const {
  std::size_t low = 0;
  std::size_t high = size_;
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if ((*this)[middle].captured < at) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

HistoryRange HistoryView::range(Time from, Time to) const {
  HistoryRange out{.first = first_at_or_after(from), .last = first_at_or_after(to)};
  if (out.last < size_ && (*this)[out.last].captured == to) ++out.last;
  if (out.last < out.first) out.last = out.first;
  return out;
}

HistoryAnswer HistoryView::pose(PoseKind kind, Time at, Duration max_gap) const {
  if (empty()) return {};
  if (at < oldest().captured) return {.lookup = HistoryLookup::before_history, .pose = {}};
  if (at > newest().captured) return {.lookup = HistoryLookup::after_history, .pose = {}};
  const std::size_t next = first_at_or_after(at);
  std::optional<HistoryPose> found;
  if (kind == PoseKind::measured) found = measured(at, next, max_gap);
  if (kind == PoseKind::smoothed && next >= settled_)
    return {.lookup = HistoryLookup::after_history, .pose = {}};
  if (kind == PoseKind::filtered || kind == PoseKind::smoothed) found = estimated(kind, at, next, max_gap);
  return {.lookup = found ? HistoryLookup::found : HistoryLookup::no_pose, .pose = found};
}

std::optional<HistoryPose> HistoryView::measured(Time at, std::size_t next, Duration max_gap) const {
  if ((*this)[next].captured == at && (*this)[next].measured) return at_entry(PoseKind::measured, next);
  // No further than max_gap either way: a search is short however long nothing was measured.
  std::size_t after = next;
  while (after < size_ && !(*this)[after].measured && (*this)[after].captured - at <= max_gap) ++after;
  if (after == size_ || !(*this)[after].measured) return std::nullopt;
  for (std::size_t before = next; before-- > 0;) {
    if ((*this)[after].captured - (*this)[before].captured > max_gap) break;
    if ((*this)[before].measured) return between(PoseKind::measured, before, after, at);
  }
  return std::nullopt;
}

std::optional<HistoryPose> HistoryView::estimated(PoseKind kind, Time at, std::size_t next,
                                                  Duration max_gap) const {
  if (!estimate(kind, next)) return std::nullopt;
  const Time after = (*this)[next].captured;
  if (after == at) return at_entry(kind, next);
  const Time before = (*this)[next - 1].captured;  // there is one: at lies after the oldest
  if (!estimate(kind, next - 1) || after - before > max_gap) return std::nullopt;
  return between(kind, next - 1, next, at);
}

Estimate HistoryView::pose_of(PoseKind kind, std::size_t i) const {
  const HistoryEntry& entry = (*this)[i];
  if (kind != PoseKind::measured) return *estimate(kind, i);
  return {.at = entry.captured,
          .pose = entry.measured->pose,
          .covariance = entry.measured->covariance + entry.measured->correlated,
          .velocity = {},
          .cameras = camera_bit(entry.measured->camera)};
}

HistoryPose HistoryView::at_entry(PoseKind kind, std::size_t i) const {
  const HistoryEntry& entry = (*this)[i];
  HistoryPose out;
  out.kind = kind;
  out.state = entry.state;
  out.captured = entry.captured;
  out.estimate = pose_of(kind, i);
  out.estimate.at = entry.captured;
  // A filtered pose may stand beside a measurement that the filter's gate refused.
  if (entry.measured && (kind == PoseKind::measured || entry.state == TrackState::tracking)) {
    out.source = entry.measured->source;
    out.score = entry.measured->score;
  }
  for (std::size_t k = i + 1; k-- > 0;) {
    if (!(*this)[k].measured) continue;
    out.heading_turns = (*this)[k].measured->heading_turns;
    break;
  }
  return out;
}

HistoryPose HistoryView::between(PoseKind kind, std::size_t before, std::size_t after, Time at) const {
  const HistoryEntry& a = (*this)[before];
  const HistoryEntry& b = (*this)[after];
  HistoryPose out = at_entry(kind, after);
  const double share = to_seconds(at - a.captured) / to_seconds(b.captured - a.captured);
  out.estimate = interpolate(pose_of(kind, before), pose_of(kind, after), share);
  out.estimate.at = at;
  return out;
}

PoseHistory::PoseHistory(const HistoryLimits& limits) : limits_(limits) {
  if (const std::string wrong = check(limits); !wrong.empty()) throw std::invalid_argument(wrong);
  now_.chunks_ = std::make_shared<const HistoryView::Chunks>();
}

bool PoseHistory::append(const HistoryEntry& entry) {
  if (!now_.empty() && entry.captured <= now_.newest().captured) return false;
  constexpr std::size_t kChunk = HistoryView::kChunk;
  if (now_.first_ + now_.size_ == now_.chunks_->size() * kChunk) {
    // Full: a new list, without the chunks of which nothing is shown any more.
    const auto dropped = static_cast<std::ptrdiff_t>(now_.first_ / kChunk);
    auto chunks = std::make_shared<HistoryView::Chunks>(now_.chunks_->begin() + dropped, now_.chunks_->end());
    chunks->push_back(std::make_shared<HistoryView::Chunk>());
    now_.chunks_ = std::move(chunks);
    now_.first_ %= kChunk;
  }
  const std::size_t place = now_.first_ + now_.size_;
  (*now_.chunks_)[place / kChunk]->entries[place % kChunk] = entry;
  ++now_.size_;
  while (now_.size_ > limits_.max_entries || entry.captured - now_.oldest().captured > limits_.max_age) {
    ++now_.first_;
    --now_.size_;
    if (now_.settled_ > 0) --now_.settled_;
  }
  return true;
}

void PoseHistory::settle(const std::vector<Estimate>& smoothed, Time until) {
  auto pose = smoothed.begin();
  for (; now_.settled_ < now_.size_; ++now_.settled_) {
    const Time at = now_[now_.settled_].captured;
    if (at > until) return;
    while (pose != smoothed.end() && pose->at < at) ++pose;
    const std::size_t place = now_.first_ + now_.settled_;
    constexpr std::size_t kChunk = HistoryView::kChunk;
    auto& slot = (*now_.chunks_)[place / kChunk]->smoothed[place % kChunk];
    if (pose != smoothed.end() && pose->at == at) slot = *pose;
  }
}

}  // namespace skylight
