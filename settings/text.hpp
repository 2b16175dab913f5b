// Small text helpers of the error messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace skylight::settings {

/// The text on one line: control characters and what is no UTF-8 are escaped, and it is cut after `limit`
/// bytes.
std::string printable(std::string_view text, std::size_t limit = std::string_view::npos);

bool is_utf8(std::string_view text);

/// Count of characters of a UTF-8 text.
std::size_t characters(std::string_view text);

/// `.key`, or `["k e y"]` where the key is no plain word; without the dot at the start of a path.
std::string path_step(std::string_view key, bool first);

/// The candidate that `word` is most likely a slip of; empty where none is near.
std::string_view nearest(std::string_view word, const std::vector<std::string_view>& candidates);

/// "a, b or c" of the words.
std::string join(const std::vector<std::string_view>& words, std::string_view last = " or ");

/// A number as short as it reads back.
std::string number_text(double value);

}  // namespace skylight::settings
