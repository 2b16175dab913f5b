// Small questions about text that came off the wire.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace skylight::http {

/// Bytes of the UTF-8 character that `text` begins with, 1 to 4; 0 where it is none (overlong forms,
/// surrogates and values above U+10FFFF are none) or `text` is empty.
std::size_t utf8_length(std::string_view text);
bool is_utf8(std::string_view text);

/// Control characters of ASCII: below 0x20, and 0x7F.
bool has_control(std::string_view text);

/// A header's name by RFC 9110: one or more token characters.
bool is_token(std::string_view text);

std::string lower_case(std::string_view text);
bool equal_ignoring_case(std::string_view a, std::string_view b);
/// Without spaces and tabs at the ends.
std::string_view trim(std::string_view text);

}  // namespace skylight::http
