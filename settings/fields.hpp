// One description of a configuration struct serves reading, the JSON Schema and printing.
//
//   struct Gate { double alpha_m = 0.3; int window = 12; };
//   inline void describe(settings::Fields& fields, Gate& gate) {   // in Gate's namespace, beside the struct
//     fields.about("When a detection is believed.");
//     fields.field("alpha", gate.alpha_m, {.above = 0, .max = 100, .unit = "m", .help = "Gate ..."});
//     fields.field("window", gate.window, {.min = 2, .max = 1000, .help = "..."});
//     fields.check(gate.window > gate.alpha_m, "window", "must be greater than alpha");
//   }
//   Gate gate = settings::read<Gate>(settings::parse(text, "room.json"));
//
// A struct starts with its defaults; a key that is absent leaves them. Unknown keys, wrong types, ranges
// and NaN are refused with file, line, key path, value and bound; nothing is repaired silently.
//
// Fields may be bool, integers, double, std::string, described structs, and of these std::optional (the key
// may be absent), std::vector and std::map<std::string, T> (which replace the default, they are not merged
// with it) and std::array; enumerations by choice(), std::variant of described structs by variant(). A struct
// may contain itself through a vector or map. describe() runs in all three modes: it must not depend on the
// values, other than in check().
#pragma once

#include <array>
#include <concepts>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "settings/document.hpp"
#include "settings/rules.hpp"
#include "settings/values.hpp"

namespace skylight::settings {

class Fields {
 public:
  /// One key. Keys are snake_case, units at their end where the unit is not told by the rules alone.
  template <class T>
  void field(std::string_view key, T& value, const Rules& rules = {});

  /// A list whose entries start as `prototype` where field()'s start as T's defaults.
  template <class T>
  void list(std::string_view key, std::vector<T>& value, const T& prototype, const Rules& rules = {});

  /// A key that takes one of several names.
  template <class E>
  void choice(std::string_view key, E& value, std::initializer_list<Choice<std::type_identity_t<E>>> choices,
              const Rules& rules = {});

  /// The keys of one of several structs, chosen by the key `key`; names are given in the variant's order. At
  /// most one per describe(). Without rules.required, an absent `key` means the alternative that `value`
  /// holds by default.
  template <class... Ts, std::size_t N>
  void variant(std::string_view key, std::variant<Ts...>& value, const Alternative (&alternatives)[N],
               const Rules& rules = {});

  /// Exactly one of these optional keys must be given. The schema says so too.
  void exactly_one_of(std::initializer_list<std::string_view> keys);

  /// Refuses a contradiction between values, at the line of `path` (relative to this object: "window",
  /// "robots[2].appearance"; empty: the object itself). Call it after the fields that it looks at.
  void check(bool ok, std::string_view path, std::string_view message);

  /// What the struct is for: one or two sentences for the schema.
  void about(std::string_view help);

  // For read(), schema() and write(), which make these.
  Fields(detail::Reading& reading, const Node& object);
  explicit Fields(detail::Schema& schema);
  explicit Fields(detail::Json& out);
  Fields(const Fields&) = delete;
  Fields& operator=(const Fields&) = delete;
  /// Reading: refuses keys that no field took, then what check() found. Schema: completes the definition.
  void finish();
  detail::Json& definition();

 private:
  const Node* take(std::string_view key, const Rules& rules);
  void finish_definition();
  void add_property(std::string_view key, const Rules& rules, detail::Json& property);
  /// All three modes for a key that takes one of the names; `current` is the default and becomes what was
  /// read.
  void choose(std::string_view key, const std::vector<std::string_view>& names, std::size_t& current,
              const Rules& rules);
  /// Reading: refuses at once an object without the key, whose other keys could not be told otherwise.
  void need(std::string_view key, const std::vector<std::string_view>& names);
  void add_branch(std::string_view key, const Alternative& alternative, bool needs_key, Fields& fields);

  detail::Reading* reading_ = nullptr;
  detail::Schema* schema_ = nullptr;
  detail::Json* out_ = nullptr;
  const Node* object_ = nullptr;  ///< what is being read
  std::vector<std::string> known_;
  std::optional<Error> deferred_;
  detail::JsonBox definition_;  ///< of the schema; alternatives wait in it under "branches" until finish()
};

/// The document as a T: its defaults, with what the document says. Throws Error.
template <class T>
T read(const Document& document);

/// The JSON Schema (2020-12) of T's documents, as JSON text.
template <class T>
std::string schema(const std::string& title);

/// The values as JSON text that read<T>() takes back. Numbers must be finite.
template <class T>
std::string write(const T& value);

namespace detail {

template <class T, template <class...> class Template>
inline constexpr bool kIs = false;
template <template <class...> class Template, class... Ts>
inline constexpr bool kIs<Template<Ts...>, Template> = true;
template <class T>
inline constexpr std::size_t kArraySize = 0;
template <class T, std::size_t N>
inline constexpr std::size_t kArraySize<std::array<T, N>> = N;
template <class T>
inline constexpr bool kIsStruct =
    !std::is_arithmetic_v<T> && !std::same_as<T, std::string> && !kIs<T, std::optional> &&
    !kIs<T, std::vector> && !kIs<T, std::map> && kArraySize<T> == 0;

template <class T>
void read_value(Reading& reading, const Node& node, const Rules& rules, T& value);

template <class T>
void read_list(Reading& reading, const Node& node, const Rules& rules, const T& prototype,
               std::vector<T>& value) {
  expect_list(reading, node, rules);
  value.clear();
  for (std::size_t i = 0; i < node.children.size(); ++i) {
    const PathStep step(reading, i);
    value.push_back(prototype);
    read_value(reading, node.children[i], rules, value.back());
  }
}

template <class T>
void read_value(Reading& reading, const Node& node, const Rules& rules, T& value) {
  if constexpr (std::same_as<T, bool>) {
    value = read_boolean(reading, node);
  } else if constexpr (std::signed_integral<T>) {
    using Limits = std::numeric_limits<T>;
    value = static_cast<T>(read_signed(reading, node, rules, Limits::min(), Limits::max()));
  } else if constexpr (std::unsigned_integral<T>) {
    value = static_cast<T>(read_unsigned(reading, node, rules, std::numeric_limits<T>::max()));
  } else if constexpr (std::same_as<T, double>) {
    value = read_number(reading, node, rules);
  } else if constexpr (std::same_as<T, std::string>) {
    value = read_string(reading, node, rules);
  } else if constexpr (kIs<T, std::optional>) {
    if (!value) value.emplace();
    read_value(reading, node, rules, *value);
  } else if constexpr (kIs<T, std::vector>) {
    read_list(reading, node, rules, typename T::value_type{}, value);
  } else if constexpr (kIs<T, std::map>) {
    expect_map(reading, node, rules);
    value.clear();
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      const PathStep step(reading, node.keys[i]);
      read_value(reading, node.children[i], rules, value[node.keys[i]]);
    }
  } else if constexpr (kArraySize<T> > 0) {
    expect_exactly(reading, node, value.size());
    for (std::size_t i = 0; i < value.size(); ++i) {
      const PathStep step(reading, i);
      read_value(reading, node.children[i], rules, value[i]);
    }
  } else {
    expect_object(reading, node);
    Fields fields(reading, node);
    describe(fields, value);
    fields.finish();
  }
}

template <class T>
void write_value(Json& out, const T& value) {
  if constexpr (std::same_as<T, bool>) {
    write_boolean(out, value);
  } else if constexpr (std::signed_integral<T>) {
    write_signed(out, value);
  } else if constexpr (std::unsigned_integral<T>) {
    write_unsigned(out, value);
  } else if constexpr (std::same_as<T, double>) {
    write_number(out, value);
  } else if constexpr (std::same_as<T, std::string>) {
    write_string(out, value);
  } else if constexpr (kIs<T, std::optional>) {
    if (value) write_value(out, *value);
  } else if constexpr (kIs<T, std::vector> || kArraySize<T> > 0) {
    become_array(out);
    for (const auto& element : value) write_value(append(out), element);
  } else if constexpr (kIs<T, std::map>) {
    become_object(out);
    for (const auto& [key, element] : value) write_value(member(out, key), element);
  } else {
    become_object(out);
    Fields fields(out);
    T copy = value;  // describe() takes what it can also read into
    describe(fields, copy);
  }
}

/// The schema of T's values; a struct is defined once and referred to by name.
template <class T>
void value_schema(Schema& schema, Json& out, const Rules& rules) {
  if constexpr (std::same_as<T, bool>) {
    boolean_schema(out);
  } else if constexpr (std::signed_integral<T>) {
    signed_schema(out, rules, std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
  } else if constexpr (std::unsigned_integral<T>) {
    unsigned_schema(out, rules, std::numeric_limits<T>::max());
  } else if constexpr (std::same_as<T, double>) {
    number_schema(out, rules);
  } else if constexpr (std::same_as<T, std::string>) {
    string_schema(out, rules);
  } else if constexpr (kIs<T, std::optional>) {
    value_schema<typename T::value_type>(schema, out, rules);
  } else if constexpr (kIs<T, std::vector>) {
    value_schema<typename T::value_type>(schema, list_schema(out, rules.min_items, rules.max_items), rules);
  } else if constexpr (kArraySize<T> > 0) {
    value_schema<typename T::value_type>(schema, list_schema(out, kArraySize<T>, kArraySize<T>), rules);
  } else if constexpr (kIs<T, std::map>) {
    value_schema<typename T::mapped_type>(schema, map_schema(out, rules), rules);
  } else {
    const auto [name, is_new] = schema.name(typeid(T), type_name<T>());
    reference_schema(out, name);
    if (!is_new) return;
    Fields fields(schema);
    T value{};
    describe(fields, value);
    fields.finish();
    schema.define(name, fields.definition());
  }
}

/// Tells the default, unless it is an absent option, or a struct that is as its type makes it.
template <class T>
void default_schema(Json& property, const T& value) {
  if constexpr (kIs<T, std::optional>) {
    if (value) default_schema(property, *value);
  } else {
    JsonBox given;
    write_value(given.get(), value);
    JsonBox plain;
    if constexpr (kIsStruct<T>) write_value(plain.get(), T{});
    set_default(property, given.get(), kIsStruct<T> ? &plain.get() : nullptr);
  }
}

}  // namespace detail

template <class T>
void Fields::field(std::string_view key, T& value, const Rules& rules) {
  if (reading_ != nullptr) {
    if (const Node* node = take(key, rules)) {
      const detail::PathStep step(*reading_, key);
      detail::read_value(*reading_, *node, rules, value);
    }
  } else if (schema_ != nullptr) {
    detail::JsonBox box;  // filled apart: describing a struct may move the other properties
    detail::value_schema<T>(*schema_, box.get(), rules);
    if (!rules.required) detail::default_schema(box.get(), value);
    add_property(key, rules, box.get());
  } else {
    if constexpr (detail::kIs<T, std::optional>) {
      if (!value) return;
    }
    detail::write_value(detail::member(*out_, key), value);
  }
}

template <class T>
void Fields::list(std::string_view key, std::vector<T>& value, const T& prototype, const Rules& rules) {
  if (reading_ == nullptr) {
    field(key, value, rules);
  } else if (const Node* node = take(key, rules)) {
    const detail::PathStep step(*reading_, key);
    detail::read_list(*reading_, *node, rules, prototype, value);
  }
}

template <class E>
void Fields::choice(std::string_view key, E& value,
                    std::initializer_list<Choice<std::type_identity_t<E>>> choices, const Rules& rules) {
  std::vector<std::string_view> names;
  std::size_t current = 0;
  for (const auto& each : choices) {
    if (each.value == value) current = names.size();
    names.push_back(each.name);
  }
  choose(key, names, current, rules);
  value = choices.begin()[current].value;
}

template <class... Ts, std::size_t N>
void Fields::variant(std::string_view key, std::variant<Ts...>& value, const Alternative (&alternatives)[N],
                     const Rules& rules) {
  static_assert(N == sizeof...(Ts), "one name for each alternative of the variant");
  if (schema_ != nullptr) {
    const auto describe_one = [&]<std::size_t I>(std::integral_constant<std::size_t, I>) {
      Fields fields(*schema_);
      std::variant_alternative_t<I, std::variant<Ts...>> alternative{};
      if (value.index() == I) alternative = std::get<I>(value);
      describe(fields, alternative);
      add_branch(key, alternatives[I], rules.required || value.index() != I, fields);
    };
    [&]<std::size_t... Is>(std::index_sequence<Is...>) {
      (describe_one(std::integral_constant<std::size_t, Is>{}), ...);
    }
    (std::make_index_sequence<N>{});
    return;
  }
  std::vector<std::string_view> names;
  for (const Alternative& each : alternatives) names.push_back(each.name);
  std::size_t current = value.index();
  if (rules.required) need(key, names);
  choose(key, names, current, rules);
  [&]<std::size_t... Is>(std::index_sequence<Is...>) {
    ((current == Is && value.index() != Is ? void(value.template emplace<Is>()) : void()), ...);
  }
  (std::make_index_sequence<N>{});
  std::visit([&](auto& alternative) { describe(*this, alternative); }, value);
}

template <class T>
T read(const Document& document) {
  detail::Reading reading{&document, {}};
  T value{};
  detail::read_value(reading, document.root, {}, value);
  return value;
}

template <class T>
std::string schema(const std::string& title) {
  detail::Schema schema;
  detail::JsonBox root;
  detail::value_schema<T>(schema, root.get(), {});
  return detail::root_schema(schema, root.get(), title);
}

template <class T>
std::string write(const T& value) {
  detail::JsonBox out;
  detail::write_value(out.get(), value);
  return detail::dump(out.get());
}

}  // namespace skylight::settings
