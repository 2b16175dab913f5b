// Scenario files: JSON with comments, each key described once for reading, the schema and the checks.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scenario/scenario.hpp"

namespace skylight::sim {

/// Reads a scenario file. Picture files in it are relative to its folder. `changes` are put over what it
/// says, in their order, each `key.path=value`: "cameras[0].frame_rate_hz=10". Throws settings::Error, whose
/// what() names the file, the line (or the change), the key path and what is allowed.
Scenario load_scenario(const std::filesystem::path& file, const std::vector<std::string>& changes = {});

/// The same from a text; `name` is how errors call it, and the scenario's name where the text gives none.
/// Picture files are relative to the working directory.
Scenario parse_scenario(std::string_view text, const std::string& name);

/// The runs that a scenario file asks for: every combination of its sweep's values with each of its seeds;
/// one run where it asks for none. Their names tell what is varied: "dark light.level=0.2". Throws as above.
std::vector<Scenario> load_runs(const std::filesystem::path& file);

/// One action from a JSON text, as in an event without its name and time: {"do": "light", "level": 0.2}.
/// Throws settings::Error.
Action parse_action(std::string_view text, const std::string& name);

/// The JSON Schema of scenario files, as published in sim/scenario.schema.json.
std::string scenario_schema();

/// The scenario as a file that reads back the same.
std::string write_scenario(const Scenario& scenario);

}  // namespace skylight::sim
