#include "service/http/wire.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <string_view>

#include "service/http/text.hpp"

namespace skylight::http {
namespace {

// What a handler cannot set: they describe the connection or are written below.
constexpr std::array<std::string_view, 7> kFrontsOwn{
    "connection", "content-length", "content-type", "date", "keep-alive", "transfer-encoding", "trailer"};

constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kDefaults{{
    {"Cache-Control", "no-store"},
    {"Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'"},
    {"Referrer-Policy", "no-referrer"},
    {"X-Content-Type-Options", "nosniff"},
}};

bool fits(std::string_view name, std::string_view value) {
  const std::string lower = lower_case(name);
  return is_token(name) && !has_control(value) &&
         std::find(kFrontsOwn.begin(), kFrontsOwn.end(), lower) == kFrontsOwn.end();
}

// By hand: strftime would write the days of the process's locale.
std::string http_date() {
  constexpr std::array<const char*, 7> kDays{"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
  constexpr std::array<const char*, 12> kMonths{"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                                "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%s, %02d %s %04d %02d:%02d:%02d GMT",
                kDays[static_cast<std::size_t>(utc.tm_wday)], utc.tm_mday,
                kMonths[static_cast<std::size_t>(utc.tm_mon)], utc.tm_year + 1900, utc.tm_hour, utc.tm_min,
                utc.tm_sec);
  return text.data();
}

}  // namespace

bool is_bodiless(int status) {
  return status == 204 || status == 304;
}

HeaderList answer_headers(const Reply& reply, bool with_body) {
  HeaderList headers;
  headers.reserve(reply.headers.size() + kDefaults.size() + 2);
  if (with_body && !has_control(reply.content_type)) {
    headers.emplace_back("Content-Type", reply.content_type);
  }
  headers.emplace_back("Date", http_date());
  for (const auto& [name, value] : reply.headers) {
    if (fits(name, value)) headers.emplace_back(name, value);
  }
  const std::size_t own = headers.size();
  for (const auto& [name, value] : kDefaults) {
    const bool given =
        std::any_of(headers.begin(), headers.begin() + static_cast<std::ptrdiff_t>(own),
                    [&, key = name](const auto& header) { return equal_ignoring_case(header.first, key); });
    if (!given) headers.emplace_back(name, value);
  }
  return headers;
}

std::string answer_head(const Reply& reply, std::size_t body_bytes, const Envelope& envelope) {
  std::string out = "HTTP/1.1 " + std::to_string(reply.status) + ' ';
  out += status_words(reply.status);
  out += "\r\n";
  for (const auto& [name, value] : answer_headers(reply, body_bytes > 0))
    out.append(name).append(": ").append(value).append("\r\n");
  if (!is_bodiless(reply.status)) out += "Content-Length: " + std::to_string(body_bytes) + "\r\n";
  if (!envelope.keep_alive) {
    out += "Connection: close\r\n";
  } else if (envelope.http10) {
    out += "Connection: keep-alive\r\n";
  }
  return out + "\r\n";
}

std::string answer_bytes(const Reply& reply, const Envelope& envelope) {
  std::string out = answer_head(reply, reply.body.size(), envelope);
  if (!envelope.head_only && !is_bodiless(reply.status)) out += reply.body;
  return out;
}

}  // namespace skylight::http
