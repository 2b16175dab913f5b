#include "service/report/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>

namespace skylight::service::report {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kMinus = "\xE2\x88\x92";        // U+2212

struct Decoded {
  std::uint32_t code = 0;
  std::size_t bytes = 1;
};

// One code point from the front; nothing where the bytes are not UTF-8 (RFC 3629: no overlong forms, no
// surrogates).
std::optional<Decoded> decode(std::string_view text) {
  const auto byte = [&](std::size_t i) -> std::uint32_t { return static_cast<unsigned char>(text[i]); };
  const std::uint32_t first = byte(0);
  if (first < 0x80) return Decoded{first, 1};
  const std::size_t bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < bytes) return std::nullopt;
  std::uint32_t code = first & (0xFFu >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return std::nullopt;
    code = code << 6 | (byte(i) & 0x3F);
  }
  constexpr std::array<std::uint32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast.at(bytes) || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return std::nullopt;
  return Decoded{code, bytes};
}

bool allowed_in_xml(std::uint32_t code) {
  if (code < 0x20) return code == '\t' || code == '\n' || code == '\r';
  return code != 0x7F && code != 0xFFFE && code != 0xFFFF;
}

std::string fixed(double value, int digits) {
  std::array<char, 400> out{};  // 1e308 has 309 digits before the point
  const auto end =
      std::to_chars(out.data(), out.data() + out.size(), value, std::chars_format::fixed, digits);
  return {out.data(), end.ptr};
}

bool is_zero(std::string_view number) {
  return number.find_first_of("123456789") == std::string_view::npos;
}

std::string with_true_minus(const std::string& number) {
  if (number.empty() || number[0] != '-') return number;
  if (is_zero(number)) return number.substr(1);
  return std::string(kMinus) + number.substr(1);
}

// Of DejaVu Sans, rounded up, in shares of the font's size.
double advance(std::uint32_t code) {
  if (code >= 0x2E80) return 1.0;  // ideographs
  if (code > 0x7E) return 0.84;    // the minus sign, Greek, arrows
  struct Group {
    std::string_view letters;
    double advance;
  };
  constexpr std::array<Group, 5> kGroups{{{"ijl|'", 0.30},
                                          {"fIrt.,:;!()[]/\\- ", 0.42},
                                          {"csvxyzkJ", 0.60},
                                          {"mMwW@%", 1.0},
                                          {"+=<>#~&", 0.84}}};
  const char c = static_cast<char>(code);
  for (const Group& group : kGroups) {
    if (group.letters.find(c) != std::string_view::npos) return group.advance;
  }
  return c >= 'A' && c <= 'Z' ? 0.79 : 0.64;
}

}  // namespace

std::string clean(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::optional<Decoded> next = decode(text);
    const std::size_t bytes = next ? next->bytes : 1;
    out += next && allowed_in_xml(next->code) ? text.substr(0, bytes) : kReplacement;
    text.remove_prefix(bytes);
  }
  return out;
}

std::string escape(std::string_view text) {
  std::string out;
  for (const char c : clean(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string exact(double value) {
  if (std::isnan(value)) return "";
  std::array<char, 40> out{};
  const auto end = std::to_chars(out.data(), out.data() + out.size(), value);
  return {out.data(), end.ptr};
}

std::string plain(double value, int digits) {
  return with_true_minus(fixed(value, std::clamp(digits, 0, 12)));
}

std::string rounded(double value, int digits) {
  if (std::isnan(value)) return "\xE2\x80\x93";  // en dash
  if (std::isinf(value)) return std::string(value < 0 ? kMinus : "") + "\xE2\x88\x9E";
  if (std::abs(value) >= 1e9) {
    const int exponent = static_cast<int>(std::floor(std::log10(std::abs(value))));
    return scientific(value / std::pow(10.0, exponent), digits, exponent);
  }
  return plain(value, digits);
}

std::string scientific(double mantissa, int mantissa_digits, int exponent) {
  constexpr std::array<std::string_view, 10> kRaised{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out = plain(mantissa, mantissa_digits);
  if (out.ends_with('1') && (out.size() == 1 || out == std::string(kMinus) + "1")) {
    out += "0";  // 10^n needs no 1 in front
  } else {
    out += "×10";
  }
  for (const char c : std::to_string(exponent)) {
    out += c == '-' ? "⁻" : kRaised.at(static_cast<std::size_t>(c - '0'));
  }
  return out;
}

std::string short_text(double value) {
  if (!std::isfinite(value)) return rounded(value, 0);
  std::array<char, 40> out{};
  const auto end = std::to_chars(out.data(), out.data() + out.size(), value, std::chars_format::general, 4);
  return {out.data(), end.ptr};
}

std::string px(double value) {
  std::string out = fixed(value, 1);
  if (out.ends_with(".0")) out.resize(out.size() - 2);
  return out == "-0" ? "0" : out;
}

double text_width_px(std::string_view text, double font_px) {
  double width = 0.0;
  while (!text.empty()) {
    const Decoded next = decode(text).value_or(Decoded{0xFFFD, 1});
    width += advance(next.code);
    text.remove_prefix(next.bytes);
  }
  return width * font_px;
}

std::vector<std::string> wrap(const std::string& text, double width_px, double font_px) {
  std::vector<std::string> lines{""};
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t space = std::min(text.find_first_of(" \t\r\n", begin), text.size());
    const std::string word = text.substr(begin, space - begin);
    begin = space + 1;
    if (word.empty()) continue;
    std::string& last = lines.back();
    const std::string longer = last.empty() ? word : last + " " + word;
    if (last.empty() || text_width_px(longer, font_px) <= width_px) {
      last = longer;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

}  // namespace skylight::service::report
