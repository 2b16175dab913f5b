#include "service/clock_offset.hpp"

namespace skylight::service {
namespace {

Duration apart(Duration a, Duration b) {
  return a < b ? b - a : a - b;
}

}  // namespace

std::optional<Duration> ClockOffset::offset() const {
  if (least_.empty()) return std::nullopt;
  return -least_.front().late;
}

bool ClockOffset::hear(Time received, Time stamped) {
  const Message message{received, received - stamped};
  if (!least_.empty() && odd(message)) return false;
  take(message);
  return true;
}

bool ClockOffset::odd(const Message& message) {
  if (apart(message.late, least_.front().late) <= kOdd) {
    odd_since_.reset();
    return false;
  }
  if (!odd_since_ || apart(message.late, odd_since_->late) > kAgree) {
    odd_since_ = message;
    odd_count_ = 0;
  }
  ++odd_count_;
  if (odd_count_ < kLeast || message.received - odd_since_->received < kSettled) return true;
  least_.clear();
  odd_since_.reset();
  ++jumps_;
  return false;
}

void ClockOffset::take(const Message& message) {
  while (!least_.empty() && least_.back().late >= message.late) least_.pop_back();
  least_.push_back(message);
  while (message.received - least_.front().received > kWindow) least_.pop_front();
}

}  // namespace skylight::service
