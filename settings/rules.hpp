// What is allowed of one value, and how it is described to people.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace skylight::settings {

/// Number rules hold for each number of a list, string rules for each string of it. The views must be
/// literals.
struct Rules {
  std::optional<double> min{};        ///< smallest allowed number
  std::optional<double> above{};      ///< numbers must be greater than this
  std::optional<double> max{};        ///< largest allowed number
  std::optional<double> below{};      ///< numbers must be less than this
  std::string_view unit{};            ///< "m", "rad/s"; told in errors and descriptions
  std::size_t min_items = 0;          ///< of a list or map
  std::size_t max_items = 1'000'000;  ///< of a list or map
  std::size_t min_length = 0;         ///< of a string, characters
  std::size_t max_length = 4096;      ///< of a string, characters
  std::string_view pattern{};         ///< ECMAScript expression for the whole string, written ^...$
  std::string_view pattern_words{};   ///< the pattern in words, for errors: "letters, digits, _ and -"
  std::string_view key_pattern{};     ///< the same for the keys of a map
  std::string_view key_pattern_words{};
  bool required = false;    ///< the key must be there (there is no default)
  std::string_view help{};  ///< one or two sentences
};

/// One value of an enumeration.
template <class E>
struct Choice {
  std::string_view name;
  E value;
};

/// One alternative of a variant: what the discriminator key says for it.
struct Alternative {
  std::string_view name;
  std::string_view help{};
};

}  // namespace skylight::settings
