// All that `skylight reproduce` does: which experiments, their runs, and the report from them.
//
//   plan -> runs (kept in <out>/observed, rendered and detected once) -> replays through filters -> report
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "service/report/document.hpp"
#include "service/reproduce/mrclam.hpp"
#include "service/reproduce/paper_frames.hpp"
#include "service/reproduce/scores.hpp"
#include "service/reproduce/skylight_frames.hpp"

namespace skylight::service::reproduce {

/// A change to the room, and what it takes out of the errors.
struct Ablation {
  std::string name;
  std::vector<std::string> changes;  ///< over the scenarios
};

struct Plan {
  bool quick = false;
  PaperPlan paper;
  ResolutionPlan resolution;
  SkylightPlan routes;
  SkylightPlan occlusion;
  SkylightPlan ablated;  ///< the routes of each ablation; its own changes are empty
  std::vector<Ablation> ablations;
  std::optional<std::filesystem::path> mrclam;  ///< the data set's folder, where it is there
};

/// All of it with so many seeds of each route (the paper's ten), or a first look in two minutes.
Plan full_plan(int seeds = 10);
Plan quick_plan();

struct Gathered {
  Plan plan;
  Runs paper;
  std::vector<ResolutionPoint> resolution;
  Runs routes;
  Runs occlusion;
  std::vector<Runs> ablations;  ///< as the plan's
  std::optional<MrclamResults> mrclam;
};

struct GatherOptions {
  std::filesystem::path folder;  ///< the runs are kept there
  std::size_t threads = 0;       ///< 0: as many as the machine has cores
  /// Called as jobs are done, one call at a time: what is at work, and how much of it is done, 0 to 1.
  std::function<void(const std::string& stage, const Progress& progress)> progress;
};

/// Runs what is not there yet. Throws as run_jobs(), paper_jobs() and run_mrclam().
Gathered gather(const Plan& plan, const GatherOptions& options);

/// The report; `facts` (command, version, machine) go before its own.
report::Document document(const Gathered& gathered, std::vector<report::Fact> facts);

/// Its parts, as they stand in the report. What is wanted and what came out: the first of them is the
/// summary.
std::vector<report::Section> paper_sections(const Gathered& gathered);
std::vector<report::Section> skylight_sections(const Gathered& gathered);

/// The pointers to runs that `keep` keeps.
std::vector<const ObservedRun*> chosen(const Runs& runs, const std::function<bool(const ObservedRun&)>& keep);
std::vector<const ObservedRun*> linear_runs(const Runs& runs);
std::vector<const ObservedRun*> curved_runs(const Runs& runs);

}  // namespace skylight::service::reproduce
