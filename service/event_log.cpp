#include "service/event_log.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace skylight::service {
namespace {

constexpr std::array<std::string_view, 3> kSeverities{"info", "warning", "error"};

bool is_of_kind(const std::string& kind, const std::string& asked) {
  return kind.starts_with(asked) && (kind.size() == asked.size() || kind[asked.size()] == '.');
}

bool is_asked_for(const Event& event, const EventQuery& query) {
  return (query.kind.empty() || is_of_kind(event.kind, query.kind)) &&
         (query.camera.empty() || event.camera == query.camera) &&
         (query.robot.empty() || event.robot == query.robot) && event.severity >= query.least;
}

}  // namespace

std::string_view to_string(Severity severity) {
  return kSeverities.at(static_cast<std::size_t>(severity));
}

std::optional<Severity> severity_from_string(std::string_view text) {
  const auto* const at = std::find(kSeverities.begin(), kSeverities.end(), text);
  if (at == kSeverities.end()) return std::nullopt;
  return static_cast<Severity>(at - kSeverities.begin());
}

std::string to_line(const Event& event) {
  return event.kind + ": " + event.message;
}

EventLog::EventLog(Clock clock, std::size_t capacity)
    : clock_(std::move(clock)),
      capacity_(std::max<std::size_t>(capacity, 1)),
      listeners_(std::make_shared<const std::vector<Listener>>()) {}

std::uint64_t EventLog::add(Event event) {
  const auto added = std::make_shared<Event>(std::move(event));
  std::shared_ptr<const std::vector<Listener>> listeners;
  std::shared_ptr<const Event> oldest;  // freed outside of the lock
  {
    const std::lock_guard lock(mutex_);
    added->at = clock_();
    added->sequence = ++newest_;
    events_.push_back(added);
    if (events_.size() > capacity_) {
      oldest = std::move(events_.front());
      events_.pop_front();
    }
    listeners = listeners_;
  }
  for (const Listener& listener : *listeners) listener(*added);
  return added->sequence;
}

EventPage EventLog::read(const EventQuery& query) const {
  EventPage page;
  std::vector<std::shared_ptr<const Event>> kept;
  {
    const std::lock_guard lock(mutex_);
    page.next = newest_;
    page.oldest = events_.empty() ? 0 : events_.front()->sequence;
    const std::uint64_t since = query.since.value_or(0);
    page.dropped = query.since && (since > newest_ || since + 1 < page.oldest);
    const std::uint64_t skipped = page.dropped || since < page.oldest ? 0 : since + 1 - page.oldest;
    kept.assign(events_.begin() + static_cast<std::ptrdiff_t>(events_.empty() ? 0 : skipped), events_.end());
  }
  std::erase_if(kept, [&](const auto& event) { return !is_asked_for(*event, query); });
  if (kept.size() > query.limit) {
    if (query.since) {
      kept.resize(query.limit);
      if (!kept.empty()) page.next = kept.back()->sequence;
    } else {
      kept.erase(kept.begin(), kept.end() - static_cast<std::ptrdiff_t>(query.limit));
    }
  }
  page.items = std::move(kept);
  return page;
}

void EventLog::listen(Listener listener) {
  const std::lock_guard lock(mutex_);
  auto more = std::make_shared<std::vector<Listener>>(*listeners_);
  more->push_back(std::move(listener));
  listeners_ = std::move(more);
}

}  // namespace skylight::service
