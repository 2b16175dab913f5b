// What check_schema.py judges: a schema, the defaults, and texts with our reader's verdict.
#pragma once

#include <initializer_list>
#include <string>

#include <nlohmann/json.hpp>

#include "settings/fields.hpp"

namespace skylight::test {

/// Empty where T reads the text.
template <class T>
std::string refusal(const std::string& text) {
  try {
    settings::read<T>(settings::parse(text, "sample"));
  } catch (const settings::Error& error) {
    return error.what();
  }
  return {};
}

template <class T>
nlohmann::json samples(const char* title, std::initializer_list<const char*> texts) {
  nlohmann::json cases = nlohmann::json::array();
  cases.push_back({{"text", settings::write(T{})}, {"refusal", refusal<T>(settings::write(T{}))}});
  for (const char* text : texts) cases.push_back({{"text", text}, {"refusal", refusal<T>(text)}});
  return {{"schema", nlohmann::json::parse(settings::schema<T>(title))}, {"cases", cases}};
}

}  // namespace skylight::test
