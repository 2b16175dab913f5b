#include "service/time_text.hpp"

#include <charconv>
#include <cstdio>

namespace skylight::service {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kLatest = 9'000'000'000;  // seconds; nanoseconds from there on leave 64 bits

std::optional<std::int64_t> whole(std::string_view digits) {
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || stop != digits.data() + digits.size()) return std::nullopt;
  return value;
}

}  // namespace

std::string time_text(Time time) {
  const std::int64_t count = time.time_since_epoch().count();
  std::int64_t seconds = count / kSecond;
  std::int64_t rest = count % kSecond;
  if (rest < 0) {
    rest += kSecond;
    --seconds;
  }
  char out[40];
  if (rest % 1000 == 0) {
    std::snprintf(out, sizeof out, "%lld.%06lld", static_cast<long long>(seconds),
                  static_cast<long long>(rest / 1000));
  } else {
    std::snprintf(out, sizeof out, "%lld.%09lld", static_cast<long long>(seconds),
                  static_cast<long long>(rest));
  }
  return out;
}

std::optional<Time> time_from_text(std::string_view text) {
  const std::size_t point = text.find('.');
  const auto seconds = whole(text.substr(0, point));
  if (!seconds || *seconds > kLatest) return std::nullopt;
  std::int64_t nanoseconds = 0;
  if (point != std::string_view::npos) {
    const std::string_view digits = text.substr(point + 1);
    const auto fraction = whole(digits);
    if (!fraction || digits.size() > 9) return std::nullopt;
    nanoseconds = *fraction;
    for (std::size_t i = digits.size(); i < 9; ++i) nanoseconds *= 10;
  }
  return Time{Duration{*seconds * kSecond + nanoseconds}};
}

}  // namespace skylight::service
