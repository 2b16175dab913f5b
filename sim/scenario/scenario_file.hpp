// Scenario files: JSON with comments, each key described once for reading, the schema and the checks.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

/// Reads a scenario file. Picture files in it are relative to its folder. Throws settings::Error, whose
/// what() names the file, the line, the key path and what is allowed.
Scenario load_scenario(const std::filesystem::path& file);

/// The same from a text; `name` is how errors call it, and the scenario's name where the text gives none.
/// Picture files are relative to the working directory.
Scenario parse_scenario(std::string_view text, const std::string& name);

/// The JSON Schema of scenario files, as published in sim/scenario.schema.json.
std::string scenario_schema();

/// The scenario as a file that reads back the same.
std::string write_scenario(const Scenario& scenario);

}  // namespace skylight::sim
