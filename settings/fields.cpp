#include "settings/fields.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "settings/text.hpp"

namespace skylight::settings {

using detail::Json;

Fields::Fields(detail::Reading& reading, const Node& object) : reading_(&reading), object_(&object) {}

Fields::Fields(detail::Schema& schema) : schema_(&schema) {
  definition_.get() = {{"type", "object"}, {"properties", Json::object()}, {"required", Json::array()}};
}

Fields::Fields(Json& out) : out_(&out) {}

Json& Fields::definition() {
  return definition_.get();
}

void Fields::about(std::string_view help) {
  if (schema_ != nullptr) definition()["description"] = help;
}

const Node* Fields::take(std::string_view key, const Rules& rules) {
  known_.emplace_back(key);
  const Node* node = object_->find(key);
  if (node == nullptr && rules.required) {
    const std::string help = rules.help.empty() ? "" : ": " + std::string(rules.help);
    check(false, key, "is missing" + help);
  }
  return node;
}

void Fields::need(std::string_view key, const std::vector<std::string_view>& names) {
  if (reading_ == nullptr || object_->find(key) != nullptr) return;
  const detail::PathStep step(*reading_, key);
  reading_->fail(*object_, "is missing: one of " + join(names));
}

void Fields::add_property(std::string_view key, const Rules& rules, Json& property) {
  detail::annotate(property, key, rules);
  definition()["properties"][std::string(key)] = std::move(property);
  if (rules.required) definition()["required"].push_back(key);
}

void Fields::choose(std::string_view key, const std::vector<std::string_view>& names, std::size_t& current,
                    const Rules& rules) {
  if (reading_ != nullptr) {
    if (const Node* node = take(key, rules)) {
      const detail::PathStep step(*reading_, key);
      current = detail::read_choice(*reading_, *node, names);
    }
  } else if (schema_ != nullptr) {
    Json property;
    detail::choice_schema(property, names);
    if (!rules.required) property["default"] = names[current];
    add_property(key, rules, property);
  } else {
    detail::write_string(detail::member(*out_, key), names[current]);
  }
}

void Fields::add_branch(std::string_view key, const Alternative& alternative, bool needs_key,
                        Fields& fields) {
  Json& branch = fields.definition();
  branch["title"] = alternative.name;
  if (!alternative.help.empty()) branch["description"] = alternative.help;
  Json properties = {{std::string(key), {{"const", alternative.name}}}};
  properties.update(branch["properties"]);
  branch["properties"] = std::move(properties);
  if (needs_key) branch["required"].push_back(key);
  definition()["branches"].push_back(std::move(branch));
}

void Fields::exactly_one_of(std::initializer_list<std::string_view> keys) {
  if (schema_ != nullptr) {
    Json one_of = Json::array();
    for (const std::string_view key : keys) one_of.push_back({{"required", {key}}});
    definition()["allOf"].push_back({{"oneOf", one_of}});
  }
  if (reading_ == nullptr) return;
  std::vector<std::string_view> given;
  for (const std::string_view key : keys) {
    if (object_->find(key) != nullptr) given.push_back(key);
  }
  const std::string all = join(std::vector<std::string_view>(keys));
  if (given.empty()) check(false, "", "needs one of " + all);
  if (given.size() > 1) {
    check(false, given[1], "contradicts " + std::string(given[0]) + ": give only one of " + all);
  }
}

void Fields::check(bool ok, std::string_view path, std::string_view message) {
  if (ok || reading_ == nullptr || deferred_) return;
  // Kept until the unknown keys are known: a slip in a key is the likelier cause of what is missing.
  std::string full = reading_->path;
  if (!path.empty()) full += (full.empty() || path.front() == '[' ? "" : ".") + std::string(path);
  const Node& node = nearest_node(*object_, path);
  deferred_.emplace(reading_->document->sources[node.source].name, node.line, full, std::string(message));
}

void Fields::finish() {
  if (schema_ != nullptr) {
    finish_definition();
    return;
  }
  for (std::size_t i = 0; reading_ != nullptr && i < object_->keys.size(); ++i) {
    const std::string& key = object_->keys[i];
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    const std::vector<std::string_view> known(known_.begin(), known_.end());
    const std::string_view meant = nearest(key, known);
    const detail::PathStep step(*reading_, key);
    reading_->fail(object_->children[i],
                   "unknown key, " + (meant.empty() ? "known are " + join(known, " and ")
                                                    : "did you mean \"" + std::string(meant) + "\"?"));
  }
  if (deferred_) throw Error(*deferred_);
}

void Fields::finish_definition() {
  const auto close = [](Json& object) {
    if (object["required"].empty()) object.erase("required");
    object["additionalProperties"] = false;
  };
  Json& whole = definition();
  if (!whole.contains("branches")) {
    close(whole);
    return;
  }
  Json one_of = Json::array();
  for (Json& branch :
       whole["branches"]) {  // each with the keys that all have: additionalProperties sees only its own
    for (const auto& [key, property] : whole["properties"].items()) branch["properties"][key] = property;
    for (const Json& key : whole["required"]) branch["required"].push_back(key);
    close(branch);
    one_of.push_back(std::move(branch));
  }
  for (const char* key : {"branches", "properties", "required"}) whole.erase(key);
  whole["oneOf"] = std::move(one_of);
}

}  // namespace skylight::settings
