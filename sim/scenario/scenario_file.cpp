#include "sim/scenario/scenario_file.hpp"

#include <utility>

#include "settings/fields.hpp"
#include "settings/text.hpp"
#include "sim/scenario/fields.hpp"
#include "sim/scenario/scenario_checks.hpp"

namespace skylight::sim {

using settings::Fields;

settings::Rules id_rules(std::string_view help, bool required) {
  return {.min_length = 1,
          .max_length = 64,
          .pattern = "^[A-Za-z0-9_-]+$",
          .pattern_words = "letters, digits, _ and -",
          .required = required,
          .help = help};
}

void describe(Fields& fields, Expectation& expectation) {
  fields.about("What a run must come to, so that the scenario is a test.");
  fields.choice(
      "figure", expectation.figure,
      {{"mean_error_m", Figure::mean_error_m},
       {"p95_error_m", Figure::p95_error_m},
       {"p99_error_m", Figure::p99_error_m},
       {"max_error_m", Figure::max_error_m},
       {"mean_yaw_error_deg", Figure::mean_yaw_error_deg},
       {"max_yaw_error_deg", Figure::max_yaw_error_deg},
       {"availability", Figure::availability},
       {"measured", Figure::measured},
       {"usable", Figure::usable},
       {"confident_wrong", Figure::confident_wrong},
       {"nees_mean", Figure::nees_mean},
       {"find_mean_s", Figure::find_mean_s},
       {"find_worst_s", Figure::find_worst_s},
       {"hidden_told", Figure::hidden_told},
       {"id_switches", Figure::id_switches},
       {"idf1", Figure::idf1},
       {"mota", Figure::mota}},
      {.required = true,
       .help = "What is measured; errors against the truth, shares of all frames from 1 s after "
               "the robot came into view; find_mean_s and find_worst_s: how long it took from when it "
               "came (back) into view until it was tracked; hidden_told: share of the frames in which "
               "it was hidden whose state said occluded."});
  fields.field("robot", expectation.robot, {.max_length = 64, .help = "Absent: each of them."});
  fields.field("kind", expectation.kind,
               {.pattern = "^(measured|filtered|smoothed|predicted)$",
                .pattern_words = "measured, filtered, smoothed or predicted",
                .help = "Of pose."});
  fields.field("at_most", expectation.at_most, {.help = "The figure must not be greater."});
  fields.field("at_least", expectation.at_least, {.help = "The figure must not be smaller."});
  fields.check(expectation.at_most || expectation.at_least, "", "needs at_most or at_least");
  fields.check(!expectation.at_most || !expectation.at_least || *expectation.at_least <= *expectation.at_most,
               "at_least", "must not be greater than at_most");
}

void describe(Fields& fields, SweepSpec& sweep) {
  fields.about("Runs the scenario once with each value in place of a key's.");
  fields.field("key", sweep.key,
               {.min_length = 1,
                .max_length = 200,
                .required = true,
                .help = "Key path, as in light.level or robots[0].program[1].speed_mps."});
  fields.field("values", sweep.values, {.max_items = 1000, .help = "Numbers."});
  fields.field("names", sweep.names, {.max_items = 1000, .help = "Words, for keys that take them."});
  fields.check(sweep.values.empty() != sweep.names.empty(), "", "needs either values or names");
}

void describe(Fields& fields, Scenario& scenario) {
  fields.about("A scenario of Skylight's simulator: a room, cameras, robots and what they do.");
  std::string ignored_schema_reference;
  fields.field("$schema", ignored_schema_reference, {.help = "For editors: where this schema lies."});
  fields.field("name", scenario.name, {.max_length = 100, .help = "Absent: the file's name."});
  fields.field("description", scenario.description,
               {.max_length = 400, .help = "One line: what the scenario is for."});
  fields.field("seed", scenario.seed, {.help = "Fixes floor and noise; the same seed gives the same bytes."});
  fields.field("start_unix_s", scenario.start_unix_s,
               {.min = 0, .max = 4e9, .unit = "s", .help = "Unix time of the start."});
  fields.field("duration_s", scenario.duration_s,
               {.min = 0, .max = 604800, .unit = "s", .help = "0: endless."});
  fields.field("repeats", scenario.repeats,
               {.min = 1, .max = 1000, .help = "Runs of skylight evaluate, with seed, seed + 1, ..."});
  fields.field("sweep", scenario.sweep,
               {.max_items = 4,
                .help = "Runs of skylight evaluate with other values; every value of one with every value of "
                        "the others."});
  fields.field("room", scenario.room);
  fields.field("light", scenario.light);
  fields.field("cameras", scenario.cameras,
               {.min_items = 1, .max_items = 16, .help = "What is seen from where."});
  fields.field("programs", scenario.programs,
               {.max_items = 200, .help = "Motion programs that robots can run by name."});
  fields.field("robots", scenario.robots, {.max_items = 500, .help = "Who drives about."});
  fields.field("objects", scenario.objects,
               {.max_items = 500, .help = "Obstacles, and things that hang between camera and robots."});
  fields.field("people", scenario.people, {.max_items = 20, .help = "Who walks through."});
  fields.field("events", scenario.events, {.max_items = 1000, .help = "What happens besides."});
  fields.field("expect", scenario.expect,
               {.max_items = 200, .help = "What skylight evaluate must find; else it ends with 1."});
  const auto problem = find_problem(scenario);
  fields.check(!problem, problem ? problem->path : "", problem ? problem->message : "");
}

namespace {

constexpr std::size_t kMostRuns = 10000;

/// A scenario with one value of each of its sweeps.
struct Variant {
  settings::Document document;
  Scenario scenario;
};

Scenario read_scenario(const settings::Document& document, const std::string& name) {
  auto scenario = settings::read<Scenario>(document);
  if (scenario.name.empty()) scenario.name = name;
  return scenario;
}

std::vector<std::string> values_of(const SweepSpec& sweep) {
  std::vector<std::string> values = sweep.names;
  for (const double value : sweep.values) values.push_back(settings::number_text(value));
  return values;
}

/// Every value of one sweep with every value of the others; the scenario itself where it sweeps nothing.
std::vector<Variant> variants_of(const settings::Document& document, const std::string& name) {
  const Scenario whole = read_scenario(document, name);
  std::size_t runs = static_cast<std::size_t>(whole.repeats);
  for (const SweepSpec& sweep : whole.sweep) runs *= values_of(sweep).size();
  if (runs > kMostRuns) {
    throw settings::Error(
        document.sources[0].name, 0, "sweep",
        "makes " + std::to_string(runs) + " runs, allowed up to " + std::to_string(kMostRuns));
  }
  std::vector<Variant> variants{{document, whole}};
  for (const SweepSpec& sweep : whole.sweep) {
    std::vector<Variant> next;
    for (const Variant& base : variants) {
      for (const std::string& value : values_of(sweep)) {
        Variant variant = base;
        settings::set(variant.document, sweep.key, value, "sweep");
        variant.scenario = read_scenario(variant.document, name);
        variant.scenario.name = base.scenario.name + " " + sweep.key + "=" + value;
        next.push_back(std::move(variant));
      }
    }
    variants = std::move(next);
  }
  return variants;
}

}  // namespace

Scenario load_scenario(const std::filesystem::path& file, const std::vector<std::string>& changes) {
  settings::Document document = settings::load(file);
  for (const std::string& change : changes) {
    settings::set(document, change, "changed " + change.substr(0, change.find('=')));
  }
  variants_of(document, file.stem().string());  // what is wrong in any of them is wrong in the file
  Scenario scenario = read_scenario(document, file.stem().string());
  scenario.folder = file.parent_path();
  return scenario;
}

Scenario parse_scenario(std::string_view text, const std::string& name) {
  const settings::Document document = settings::parse(text, name);
  variants_of(document, name);
  return read_scenario(document, name);
}

std::vector<Scenario> load_runs(const std::filesystem::path& file) {
  std::vector<Scenario> runs;
  for (const Variant& variant : variants_of(settings::load(file), file.stem().string())) {
    for (int i = 0; i < variant.scenario.repeats; ++i) {
      runs.push_back(variant.scenario);
      runs.back().folder = file.parent_path();
      runs.back().sweep.clear();
      runs.back().repeats = 1;
      runs.back().seed += static_cast<std::uint64_t>(i);
    }
  }
  return runs;
}

Action parse_action(std::string_view text, const std::string& name) {
  return settings::read<ActionSpec>(settings::parse(text, name)).action;
}

std::string scenario_schema() {
  return settings::schema<Scenario>("Skylight scenario");
}

std::string write_scenario(const Scenario& scenario) {
  return settings::write(scenario);
}

void validate(const Scenario& scenario) {
  try {
    parse_scenario(write_scenario(scenario), scenario.name);
  } catch (const settings::Error& error) {
    throw std::invalid_argument(error.key_path.empty() ? error.message
                                                       : error.key_path + ": " + error.message);
  }
}

}  // namespace skylight::sim
