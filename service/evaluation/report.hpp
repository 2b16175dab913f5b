// What an evaluation came to, as JSON and as a table for people.
#pragma once

#include "service/evaluation/contest.hpp"
#include "service/evaluation/expectations.hpp"
#include "service/wire.hpp"

namespace skylight::service {

/// One entry for each kind of pose. Of several runs pooled: `seeds`, `worst_seed`, `worst_error_m` and `all`
/// (every robot's frames together) beside the robots.
Json to_json(const RunScore& run, const std::string& filter);
/// {scenario, figure, robot, kind, at_most, at_least, value, kept}; null where there is none.
Json to_json(const Judgement& judgement, const std::string& scenario);

/// Entries of one to_json(), under a line that names scenario and seeds.
void print_table(const Json& entries);

}  // namespace skylight::service
