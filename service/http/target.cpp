#include "service/http/target.hpp"

#include <algorithm>

#include "service/http/message.hpp"
#include "service/http/text.hpp"

namespace skylight::http {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw Problem(400, "Malformed target", why);
}

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Once and no more: what a decoded text spells is never decoded again.
std::string decode(std::string_view text, std::string_view where) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    const int high = i + 2 < text.size() ? hex_value(text[i + 1]) : -1;
    const int low = i + 2 < text.size() ? hex_value(text[i + 2]) : -1;
    if (high < 0 || low < 0)
      refuse("a '%' in the " + std::string(where) + " is not followed by two hex digits");
    out += static_cast<char>(high * 16 + low);
    i += 2;
  }
  if (has_control(out)) refuse("the " + std::string(where) + " holds a control character");
  if (!is_utf8(out)) refuse("the " + std::string(where) + " is not UTF-8");
  return out;
}

void parse_path(std::string_view raw, Target& target) {
  for (std::size_t at = 0; at < raw.size();) {
    const std::size_t end = std::min(raw.find('/', at + 1), raw.size());
    std::string segment = decode(raw.substr(at + 1, end - at - 1), "path");
    if (segment.find('/') != std::string::npos) refuse("the path holds an encoded slash");
    if (segment == "." || segment == "..") refuse("the path holds a '.' or '..' segment");
    target.path += '/' + segment;
    target.segments.push_back(std::move(segment));
    at = end;
  }
}

void parse_query(std::string_view raw, Target& target) {
  std::string spaced(raw);
  std::replace(spaced.begin(), spaced.end(), '+', ' ');
  std::string_view rest = spaced;
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(pair.size() + 1, rest.size()));
    if (pair.empty()) continue;
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const std::string_view value = pair.substr(std::min(equals + 1, pair.size()));
    target.query.emplace_back(decode(pair.substr(0, equals), "query"), decode(value, "query"));
  }
}

}  // namespace

Target parse_target(std::string_view raw) {
  if (raw.empty() || raw.front() != '/') refuse("the target must begin with '/'");
  if (raw.find('#') != std::string_view::npos) refuse("the target holds a '#'");
  const bool plain = std::all_of(raw.begin(), raw.end(), [](char c) { return c > 0x20 && c < 0x7F; });
  if (!plain) refuse("the target holds a character that must be percent-encoded");
  Target target;
  const std::size_t question = std::min(raw.find('?'), raw.size());
  parse_path(raw.substr(0, question), target);
  parse_query(raw.substr(std::min(question + 1, raw.size())), target);
  return target;
}

std::string percent_encode(std::string_view text) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (kPlain.find(c) != std::string_view::npos) {
      out += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    out += '%';
    out += kHex[byte >> 4U];
    out += kHex[byte & 0xFU];
  }
  return out;
}

}  // namespace skylight::http
