// The JSON that describes values, and the JSON of values.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "settings/text.hpp"
#include "settings/values.hpp"

namespace skylight::settings::detail {
namespace {

/// A bound as people write it: 12, not 12.0.
Json number_json(double value) {
  constexpr double kExact = 0x1p53;
  if (std::trunc(value) == value && std::abs(value) < kExact) return static_cast<std::int64_t>(value);
  return value;
}

void add_bounds(Json& out, const Rules& rules) {
  if (rules.min) out["minimum"] = number_json(*rules.min);
  if (rules.above) out["exclusiveMinimum"] = number_json(*rules.above);
  if (rules.max) out["maximum"] = number_json(*rules.max);
  if (rules.below) out["exclusiveMaximum"] = number_json(*rules.below);
}

/// "window_size" as "Window size".
std::string title_of(std::string_view key) {
  std::string title(key);
  std::replace(title.begin(), title.end(), '_', ' ');
  if (!title.empty()) title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
  return title;
}

}  // namespace

JsonBox::JsonBox() : json_(std::make_unique<Json>()) {}
JsonBox::JsonBox(JsonBox&&) noexcept = default;
JsonBox::~JsonBox() = default;

std::pair<std::string, bool> Schema::name(std::type_index type, std::string_view full_name) {
  if (const auto known = names.find(type); known != names.end()) return {known->second, false};
  const std::size_t scope = full_name.rfind("::");
  std::string wanted(scope == std::string_view::npos ? full_name : full_name.substr(scope + 2));
  std::string free = wanted;
  const auto taken = [&] {
    return std::any_of(names.begin(), names.end(), [&](const auto& each) { return each.second == free; });
  };
  for (int i = 2; taken(); ++i) free = wanted + std::to_string(i);
  names.emplace(type, free);
  return {free, true};
}

void Schema::define(const std::string& name, Json& definition) {
  definitions.get()[name] = std::move(definition);
}

void boolean_schema(Json& out) {
  out["type"] = "boolean";
}

void signed_schema(Json& out, const Rules& rules, std::int64_t low, std::int64_t high) {
  out["type"] = "integer";
  if (!rules.min && !rules.above) out["minimum"] = low;
  if (!rules.max && !rules.below) out["maximum"] = high;
  add_bounds(out, rules);
}

void unsigned_schema(Json& out, const Rules& rules, std::uint64_t high) {
  out["type"] = "integer";
  if (!rules.min && !rules.above) out["minimum"] = 0;
  if (!rules.max && !rules.below) out["maximum"] = high;
  add_bounds(out, rules);
}

void number_schema(Json& out, const Rules& rules) {
  out["type"] = "number";
  add_bounds(out, rules);
}

void string_schema(Json& out, const Rules& rules) {
  out["type"] = "string";
  if (rules.min_length > 0) out["minLength"] = rules.min_length;
  out["maxLength"] = rules.max_length;
  if (!rules.pattern.empty()) out["pattern"] = rules.pattern;
}

void choice_schema(Json& out, const std::vector<std::string_view>& names) {
  out["enum"] = names;
}

Json& list_schema(Json& out, std::size_t min_items, std::size_t max_items) {
  out["type"] = "array";
  if (min_items > 0) out["minItems"] = min_items;
  if (max_items < Rules{}.max_items) out["maxItems"] = max_items;
  return out["items"];
}

Json& map_schema(Json& out, const Rules& rules) {
  out["type"] = "object";
  if (rules.min_items > 0) out["minProperties"] = rules.min_items;
  if (rules.max_items < Rules{}.max_items) out["maxProperties"] = rules.max_items;
  if (!rules.key_pattern.empty()) out["propertyNames"]["pattern"] = rules.key_pattern;
  return out["additionalProperties"];
}

void reference_schema(Json& out, const std::string& name) {
  out["$ref"] = "#/$defs/" + name;
}

void annotate(Json& property, std::string_view key, const Rules& rules) {
  Json annotated = {{"title", title_of(key)}};
  std::string description(rules.help);
  if (!rules.unit.empty())
    description += std::string(description.empty() ? "" : " ") + "Unit: " + std::string(rules.unit) + ".";
  if (!description.empty()) annotated["description"] = description;
  annotated.update(property);
  property = std::move(annotated);
}

void set_default(Json& property, Json& value, const Json* plain) {
  if (plain != nullptr && *plain == value) return;
  property["default"] = std::move(value);
}

std::string root_schema(Schema& schema, Json& root, const std::string& title) {
  Json text = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", title}};
  text.update(root);
  if (!schema.definitions.get().is_null()) text["$defs"] = std::move(schema.definitions.get());
  return dump(text);
}

Json& member(Json& object, std::string_view key) {
  return object[std::string(key)];
}

Json& append(Json& array) {
  return array.emplace_back();
}

void become_array(Json& out) {
  out = Json::array();
}
void become_object(Json& out) {
  out = Json::object();
}
void write_boolean(Json& out, bool value) {
  out = value;
}
void write_signed(Json& out, std::int64_t value) {
  out = value;
}
void write_unsigned(Json& out, std::uint64_t value) {
  out = value;
}
void write_string(Json& out, std::string_view value) {
  out = value;
}

void write_number(Json& out, double value) {
  if (!std::isfinite(value)) throw std::invalid_argument("a number to be written as JSON is not finite");
  out = number_json(value);
}

std::string dump(const Json& json) {
  return json.dump(2) + "\n";
}

}  // namespace skylight::settings::detail
