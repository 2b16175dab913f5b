#include "settings/values.hpp"

#include <algorithm>
#include <cmath>
#include <regex>

#include <nlohmann/json.hpp>

#include "settings/text.hpp"

namespace skylight::settings::detail {
namespace {

template <class T>
const T* scalar(const Node& node) {
  return node.kind == Node::Kind::scalar ? std::get_if<T>(&node.scalar) : nullptr;
}

std::string found(const Node& node) {
  if (node.kind == Node::Kind::array) return "a list";
  if (node.kind == Node::Kind::object) return "an object";
  if (const auto* flag = scalar<bool>(node)) return *flag ? "true" : "false";
  if (const auto* number = scalar<std::int64_t>(node)) return "the number " + std::to_string(*number);
  if (const auto* number = scalar<std::uint64_t>(node)) return "the number " + std::to_string(*number);
  if (const auto* number = scalar<double>(node)) return "the number " + number_text(*number);
  if (const auto* text = scalar<std::string>(node)) return "the string \"" + printable(*text, 40) + "\"";
  return "null";
}

std::string with_unit(const Rules& rules) {
  return rules.unit.empty() ? std::string() : " " + std::string(rules.unit);
}

/// What the reader enforces of a number: the rules, and the limits of the type.
struct Bounds {
  std::string low_text;  ///< empty: none
  std::string high_text;

  std::string allowed() const {
    if (high_text.empty()) return low_text.starts_with("above") ? low_text : "at least " + low_text;
    if (low_text.empty()) return high_text.starts_with("below") ? high_text : "at most " + high_text;
    return low_text + (high_text.starts_with("below") ? " and " : " to ") + high_text;
  }
};

Bounds bounds_of(const Rules& rules, std::string low, std::string high) {
  Bounds bounds{std::move(low), std::move(high)};
  if (rules.min) bounds.low_text = number_text(*rules.min);
  if (rules.above) bounds.low_text = "above " + number_text(*rules.above);
  if (rules.max) bounds.high_text = number_text(*rules.max);
  if (rules.below) bounds.high_text = "below " + number_text(*rules.below);
  return bounds;
}

bool allows(const Rules& rules, double value) {
  return !(rules.min && value < *rules.min) && !(rules.max && value > *rules.max) &&
         !(rules.above && value <= *rules.above) && !(rules.below && value >= *rules.below);
}

[[noreturn]] void out_of_range(const Reading& reading, const Node& node, const Rules& rules,
                               const std::string& value, std::string low, std::string high) {
  const Bounds bounds = bounds_of(rules, std::move(low), std::move(high));
  reading.fail(node, value + " is out of range, allowed " + bounds.allowed() + with_unit(rules));
}

/// The number as text, checked to be whole; 3.0 is.
std::string expect_whole(const Reading& reading, const Node& node) {
  if (const auto* number = scalar<std::int64_t>(node)) return std::to_string(*number);
  if (const auto* number = scalar<std::uint64_t>(node)) return std::to_string(*number);
  const auto* number = scalar<double>(node);
  if (number == nullptr) reading.fail(node, "expected a whole number, found " + found(node));
  if (std::trunc(*number) != *number) reading.fail(node, number_text(*number) + " is no whole number");
  return number_text(*number);
}

/// ECMAScript, as JSON Schema's. Compiled at each use: configuration is read once.
bool matches(std::string_view text, std::string_view pattern) {
  return std::regex_search(text.begin(), text.end(), std::regex(pattern.begin(), pattern.end()));
}

std::string in_words(std::string_view pattern, std::string_view words) {
  return words.empty() ? "the pattern " + std::string(pattern) : std::string(words);
}

void check_count(const Reading& reading, const Node& node, const Rules& rules) {
  const std::size_t count = node.children.size();
  if (count >= rules.min_items && count <= rules.max_items) return;
  std::string allowed = std::to_string(rules.min_items) + " to " + std::to_string(rules.max_items);
  if (rules.max_items == Rules{}.max_items) allowed = "at least " + std::to_string(rules.min_items);
  reading.fail(node, std::to_string(count) + " entries, allowed " + allowed);
}

}  // namespace

void Reading::fail(const Node& node, const std::string& message) const {
  throw Error(document->sources[node.source].name, node.line, path, message);
}

PathStep::PathStep(Reading& reading, std::string_view key) : reading_(reading), length_(reading.path.size()) {
  reading.path += path_step(key, length_ == 0);
}

PathStep::PathStep(Reading& reading, std::size_t index) : reading_(reading), length_(reading.path.size()) {
  reading.path += "[" + std::to_string(index) + "]";
}

bool read_boolean(const Reading& reading, const Node& node) {
  const auto* value = scalar<bool>(node);
  if (value == nullptr) reading.fail(node, "expected true or false, found " + found(node));
  return *value;
}

std::int64_t read_signed(const Reading& reading, const Node& node, const Rules& rules, std::int64_t low,
                         std::int64_t high) {
  const std::string text = expect_whole(reading, node);
  const auto refuse = [&] {
    out_of_range(reading, node, rules, text, std::to_string(low), std::to_string(high));
  };
  std::int64_t value = 0;
  if (const auto* number = scalar<std::int64_t>(node)) {
    value = *number;
  } else if (const auto* real = scalar<double>(node); real != nullptr && std::abs(*real) < 0x1p63) {
    value = static_cast<std::int64_t>(*real);
  } else {
    refuse();
  }
  if (value < low || value > high || !allows(rules, static_cast<double>(value))) refuse();
  return value;
}

std::uint64_t read_unsigned(const Reading& reading, const Node& node, const Rules& rules,
                            std::uint64_t high) {
  const std::string text = expect_whole(reading, node);
  const auto refuse = [&] { out_of_range(reading, node, rules, text, "0", std::to_string(high)); };
  std::uint64_t value = 0;
  if (const auto* number = scalar<std::int64_t>(node)) {
    if (*number < 0) refuse();
    value = static_cast<std::uint64_t>(*number);
  } else if (const auto* big = scalar<std::uint64_t>(node)) {
    value = *big;
  } else if (const auto* real = scalar<double>(node); *real >= 0.0 && *real < 0x1p64) {
    value = static_cast<std::uint64_t>(*real);
  } else {
    refuse();
  }
  if (value > high || !allows(rules, static_cast<double>(value))) refuse();
  return value;
}

double read_number(const Reading& reading, const Node& node, const Rules& rules) {
  double value = 0.0;
  if (const auto* whole = scalar<std::int64_t>(node)) {
    value = static_cast<double>(*whole);
  } else if (const auto* big = scalar<std::uint64_t>(node)) {
    value = static_cast<double>(*big);
  } else if (const auto* real = scalar<double>(node)) {
    value = *real;
  } else {
    const std::string unit = rules.unit.empty() ? "" : " (" + std::string(rules.unit) + ")";
    reading.fail(node, "expected a number" + unit + ", found " + found(node));
  }
  if (!allows(rules, value)) out_of_range(reading, node, rules, number_text(value), "", "");
  return value;
}

std::string read_string(const Reading& reading, const Node& node, const Rules& rules) {
  const auto* text = scalar<std::string>(node);
  if (text == nullptr && node.source > 0 && node.kind == Node::Kind::scalar) {
    // A value that was set has no quotes to tell "7" from 7: here a string is wanted, so it is one.
    const std::string& given = reading.document->sources[node.source].text;
    text = given.empty() ? nullptr : &given;
  }
  if (text == nullptr) reading.fail(node, "expected a string, found " + found(node));
  const std::size_t length = characters(*text);
  if (length < rules.min_length || length > rules.max_length) {
    reading.fail(node, std::to_string(length) + " characters, allowed " + std::to_string(rules.min_length) +
                           " to " + std::to_string(rules.max_length));
  }
  if (!rules.pattern.empty() && !matches(*text, rules.pattern)) {
    reading.fail(node,
                 "\"" + printable(*text, 40) + "\" is not " + in_words(rules.pattern, rules.pattern_words));
  }
  return *text;
}

std::size_t read_choice(const Reading& reading, const Node& node,
                        const std::vector<std::string_view>& names) {
  const auto* text = scalar<std::string>(node);
  if (text == nullptr) reading.fail(node, "expected one of " + join(names) + ", found " + found(node));
  const auto at = std::find(names.begin(), names.end(), *text);
  if (at == names.end()) {
    const std::string_view meant = nearest(*text, names);
    const std::string hint = meant.empty() ? "" : ", did you mean \"" + std::string(meant) + "\"?";
    reading.fail(node, "\"" + printable(*text, 40) + "\" is not one of " + join(names) + hint);
  }
  return static_cast<std::size_t>(at - names.begin());
}

void expect_list(const Reading& reading, const Node& node, const Rules& rules) {
  if (node.kind != Node::Kind::array) reading.fail(node, "expected a list, found " + found(node));
  check_count(reading, node, rules);
}

void expect_map(const Reading& reading, const Node& node, const Rules& rules) {
  expect_object(reading, node);
  check_count(reading, node, rules);
  if (rules.key_pattern.empty()) return;
  constexpr std::size_t kLongestKey = 4096;  // std::regex recurses with the length of the text
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    if (node.keys[i].size() <= kLongestKey && matches(node.keys[i], rules.key_pattern)) continue;
    reading.fail(node.children[i], "the key \"" + printable(node.keys[i], 40) + "\" is not " +
                                       in_words(rules.key_pattern, rules.key_pattern_words));
  }
}

void expect_exactly(const Reading& reading, const Node& node, std::size_t count) {
  if (node.kind != Node::Kind::array) {
    reading.fail(node, "expected a list of " + std::to_string(count) + ", found " + found(node));
  }
  if (node.children.size() == count) return;
  reading.fail(node, std::to_string(node.children.size()) + " entries, needed are " + std::to_string(count));
}

void expect_object(const Reading& reading, const Node& node) {
  if (node.kind != Node::Kind::object) reading.fail(node, "expected an object, found " + found(node));
}

}  // namespace skylight::settings::detail
