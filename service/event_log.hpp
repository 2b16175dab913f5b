// What took place, for people and programs: the newest events, each with a number that counts up.
//
// Any thread adds; nobody who does waits for somebody who reads. Whoever wants all of them asks for those
// after the last that he has seen: a page, a stream and a store alike.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/clock.hpp"
#include "service/json.hpp"

namespace skylight::service {

enum class Severity : std::uint8_t { info, warning, error };
std::string_view to_string(Severity severity);
std::optional<Severity> severity_from_string(std::string_view text);

struct Event {
  std::uint64_t sequence = 0;  ///< 1 for the first; the log gives it
  Time at{};                   ///< when it was added; the log says so
  std::string kind;            ///< words in lower case with dots between: camera.moved
  Severity severity = Severity::info;
  std::string camera{};  ///< id of the one that it concerns; empty: none
  std::string robot{};   ///< the same
  std::string message;   ///< for people; names camera and robot itself
  Json data = Json::object();
};

/// One line for a log: kind and message.
std::string to_line(const Event& event);

struct EventQuery {
  std::optional<std::uint64_t> since{};  ///< those after this number; absent: the newest
  std::size_t limit = 100;
  std::string kind{};    ///< this one and those that go on with a dot after it; empty: any
  std::string camera{};  ///< empty: any
  std::string robot{};
  Severity least = Severity::info;
};

struct EventPage {
  std::vector<std::shared_ptr<const Event>> items;  ///< the oldest first
  std::uint64_t next = 0;    ///< `since` of the next page: nothing is skipped, nothing comes twice
  std::uint64_t oldest = 0;  ///< that is kept; 0: there is none yet
  /// Events after `since` are no longer kept, or it is of another run of the program: `items` begins with the
  /// oldest.
  bool dropped = false;
};

class EventLog {
 public:
  using Listener = std::function<void(const Event&)>;

  /// Keeps the newest `capacity` (at least 1).
  explicit EventLog(Clock clock = system_now, std::size_t capacity = 10'000);

  /// Returns its number.
  std::uint64_t add(Event event);
  EventPage read(const EventQuery& query = {}) const;

  /// Calls `listener` after each event, on the thread that added it: it must be quick and must not throw.
  /// Events of different threads may reach it in another order than their numbers; one that minds takes the
  /// call as a wake-up and reads from where it was.
  void listen(Listener listener);

 private:
  Clock clock_;
  std::size_t capacity_;
  mutable std::mutex mutex_;
  std::deque<std::shared_ptr<const Event>> events_;
  std::uint64_t newest_ = 0;
  std::shared_ptr<const std::vector<Listener>> listeners_;
};

}  // namespace skylight::service
