#include <algorithm>
#include <cstdio>
#include <fstream>

#include "service/assembly.hpp"
#include "service/commands/commands.hpp"
#include "service/evaluation/camera_error.hpp"
#include "service/evaluation/cameras_apart.hpp"
#include "service/evaluation/report.hpp"

namespace skylight::service {
namespace {

struct EvaluateFlags {
  ConfigFlags config;
  std::vector<std::string> scenarios;
  std::vector<std::string> detectors{"orb"};
  std::vector<std::string> kinds{"measured", "filtered"};
  std::string filter = "motion";
  bool odometry = false;
  double calibration_error_mm = 0.0;
  bool cameras_apart = false;
  double horizon_s = 0.0;
  double duration_s = 0.0;
  std::optional<std::uint64_t> seed;
  std::optional<int> repeats;
  std::string json;
};

/// Of one run.
struct Scored {
  std::vector<RunScore> detectors;
  std::optional<CamerasScore> cameras{};
};

/// Everything that comes out, in the order in which it came.
struct Outcome {
  Json scenarios = Json::array();
  Json pooled = Json::array();
  Json expectations = Json::array();
  std::size_t failed = 0;
};

void check_kind(const EvaluateFlags& flags, PoseKind kind, const std::string& who) {
  if (kind == PoseKind::smoothed && flags.filter == "window")
    throw UsageError(
        who + " 'smoothed': the window filter has no smoother, allowed: measured, filtered, predicted");
  if (kind == PoseKind::predicted && !(flags.horizon_s > 0))
    throw UsageError(who == "--kind is" ? "--kind predicted needs --horizon"
                                        : who + " 'predicted', which needs --horizon");
}

std::vector<PoseKind> asked_kinds(const EvaluateFlags& flags) {
  std::vector<PoseKind> kinds;
  for (const std::string& name : flags.kinds) {
    const auto kind = pose_kind_from_string(name);
    if (!kind) throw UsageError("--kind is '" + name + "', allowed: measured, filtered, smoothed, predicted");
    check_kind(flags, *kind, "--kind is");
    kinds.push_back(*kind);
  }
  return kinds;
}

// What was asked for, and what the scenario's expectations speak of.
std::vector<PoseKind> kinds_for(const EvaluateFlags& flags, const ScenarioRun& run) {
  std::vector<PoseKind> kinds = asked_kinds(flags);
  for (const Expected& expected : run.expected()) {
    check_kind(flags, expected.kind, run.name() + ": the kind of an expectation is");
    if (std::find(kinds.begin(), kinds.end(), expected.kind) == kinds.end()) kinds.push_back(expected.kind);
  }
  return kinds;
}

// All that can be wrong with the words on the command line is said before the first run begins.
std::vector<std::vector<ScenarioRun>> runs_of(const EvaluateFlags& flags, const std::string& scenario) {
  auto variants = scenario_runs(scenario, flags.seed, flags.repeats);
  for (auto& runs : variants) {
    for (ScenarioRun& run : runs) {
      if (flags.duration_s > 0.0) run.cut(flags.duration_s);
      if (run.duration_s() <= 0.0)
        throw UsageError(scenario + ": this scenario never ends (it has no duration_s); say --duration");
      kinds_for(flags, run);
    }
  }
  return variants;
}

Config config_for(const EvaluateFlags& flags, const std::string& detector) {
  return flags.config.load({{"source.type=simulator", "evaluate"},
                            {"tracker.detector=" + detector, "--detector"},
                            {"tracker.filter.type=" + flags.filter, "--filter"}});
}

// Which of several copies is which nothing in a picture tells. A tracker that knows where each begins can be
// asked whether it keeps them apart, and needs no chance to find them all.
void tell_copies_apart(const SimulatorFrames& simulator, std::vector<RobotSpec>& robots) {
  for (RobotSpec& robot : robots) {
    for (const SimulatedRobot& simulated : simulator.robots()) {
      if (simulated.id == robot.id && simulated.copy && !robot.initial_pose)
        robot.initial_pose = simulated.start;
    }
  }
}

// Every detector over the same frames.
Scored score(const EvaluateFlags& flags, const ScenarioRun& run) {
  const std::vector<PoseKind> kinds = kinds_for(flags, run);
  const auto simulator = std::make_shared<SimulatorFrames>(run);
  std::vector<Contestant> contestants;
  std::shared_ptr<FrameSource> source;
  std::optional<CamerasApart> apart;
  for (const std::string& detector : flags.detectors) {
    Assembly assembly = assemble(config_for(flags, detector), simulator);
    tell_copies_apart(*simulator, assembly.robots);
    if (flags.calibration_error_mm > 0.0)
      use_wrong_cameras(
          assembly,
          {.room_m = simulator->room_m(), .rms_m = flags.calibration_error_mm / 1000.0, .seed = run.seed()});
    if (flags.cameras_apart && !apart) apart.emplace(*simulator, assembly);
    contestants.emplace_back(*simulator, make_tracker(assembly), detector, kinds,
                             from_seconds(flags.horizon_s));
    source = std::move(assembly.source);
  }
  double total = 0.0;
  for (const SimulatedCamera& camera : simulator->cameras()) total += run.duration_s() * camera.frame_rate_hz;
  Progress progress(run.name(), static_cast<std::size_t>(total));
  while (const auto frame = source->next()) {
    const std::vector<Odometry> odometry = simulator->take_odometry();
    for (Contestant& contestant : contestants) {
      if (flags.odometry) contestant.hear(odometry, simulator->now());
      contestant.process(*frame, simulator->truth());
    }
    if (apart) apart->process(*frame, simulator->truth());
    progress.step();
  }
  Scored scored;
  for (Contestant& contestant : contestants) scored.detectors.push_back(contestant.result());
  if (apart) scored.cameras = apart->result();
  return scored;
}

void append(Json& list, const Json& entries) {
  for (const Json& entry : entries) list.push_back(entry);
}

// Of one run, or of several pooled: printed, and as JSON.
Json entries_of(const EvaluateFlags& flags, const std::vector<RunScore>& scores,
                const std::optional<CamerasScore>& cameras) {
  Json entries = Json::array();
  for (const RunScore& run : scores) append(entries, to_json(run, flags.filter));
  if (flags.json != "-") {
    print_table(entries);
    if (cameras) print_cameras(*cameras);
  }
  if (cameras) entries.front()["cameras_apart"] = to_json(*cameras);
  return entries;
}

// The runs of one variant: each by itself, then all pooled, then what was expected of them.
void evaluate_variant(const EvaluateFlags& flags, const std::vector<ScenarioRun>& runs, Outcome& outcome) {
  const bool talks = flags.json != "-";
  std::vector<RunScore> pooled;
  std::optional<CamerasScore> cameras;
  for (const ScenarioRun& run : runs) {
    const Scored scored = score(flags, run);
    Json entries = entries_of(flags, scored.detectors, scored.cameras);
    append(outcome.scenarios, entries);
    for (std::size_t i = 0; i < scored.detectors.size(); ++i) {
      if (pooled.size() <= i) {
        pooled.push_back(scored.detectors[i]);
      } else {
        pooled[i].merge(scored.detectors[i]);
      }
    }
    if (cameras) {
      cameras->merge(*scored.cameras);
    } else {
      cameras = scored.cameras;
    }
  }
  if (runs.size() > 1) append(outcome.pooled, entries_of(flags, pooled, cameras));
  // A scenario expects something of Skylight, which is the detector that is named first.
  for (const Judgement& judgement : judge(runs.front().expected(), pooled.front())) {
    if (talks) std::printf("%s\n", judgement_line(judgement).c_str());
    outcome.expectations.push_back(to_json(judgement, runs.front().name()));
    outcome.failed += judgement.kept ? 0 : 1;
  }
  if (talks) std::fflush(stdout);
}

void write_report(const EvaluateFlags& flags, const Outcome& outcome) {
  const Json report{
      {"scenarios", outcome.scenarios}, {"pooled", outcome.pooled}, {"expectations", outcome.expectations}};
  if (flags.json == "-") {
    std::printf("%s\n", report.dump(2).c_str());
    return;
  }
  if (flags.json.empty()) return;
  std::ofstream out(flags.json);
  out << report.dump(2) << "\n";
  out.flush();
  if (!out) throw std::runtime_error(flags.json + ": cannot be written");
}

int evaluate(const EvaluateFlags& flags) {
  asked_kinds(flags);
  std::vector<std::vector<ScenarioRun>> variants;
  for (const std::string& scenario : flags.scenarios) {
    for (auto& runs : runs_of(flags, scenario)) variants.push_back(std::move(runs));
  }
  Outcome outcome;
  for (const std::vector<ScenarioRun>& runs : variants) evaluate_variant(flags, runs, outcome);
  write_report(flags, outcome);
  if (outcome.failed == 0) return 0;
  std::fprintf(stderr, "skylight: %zu of %zu expectations failed\n", outcome.failed,
               outcome.expectations.size());
  return 1;
}

}  // namespace

void add_evaluate(CLI::App& app, Run& run) {
  auto flags = std::make_shared<EvaluateFlags>();
  CLI::App* command = app.add_subcommand("evaluate",
                                         "Simulator and tracker in lockstep: accuracy, availability and "
                                         "identity against truth; exit code 1 where "
                                         "a scenario's expectation fails");
  command->add_option("scenarios", flags->scenarios, "Scenarios: names, or .json files")->required();
  flags->config.add_to(*command, false);
  command
      ->add_option("--detector", flags->detectors,
                   "orb, apriltag, homography; several are scored on the same frames (orb)")
      ->delimiter(',')
      ->check(CLI::IsMember({"orb", "apriltag", "homography"}));
  command->add_option("--filter", flags->filter, "motion, window: the paper's (motion)")
      ->check(CLI::IsMember({"motion", "window"}));
  command->add_flag("--odometry", flags->odometry,
                    "The robots tell of their wheels, where the scenario's do");
  command
      ->add_option("--kind", flags->kinds,
                   "What is scored: measured, filtered, smoothed, predicted (measured,filtered)")
      ->delimiter(',');
  command->add_option("--horizon", flags->horizon_s, "With --kind predicted: how far ahead, seconds")
      ->check(CLI::Range(0.001, 60.0));
  command
      ->add_option(
          "--calibration-error", flags->calibration_error_mm,
          "Cameras as a calibration leaves them: points of the room's floor off by so many mm RMS; a draw "
          "for each seed (0: as they are)")
      ->check(CLI::Range(0.0, 100.0));
  command->add_flag("--cameras-apart", flags->cameras_apart,
                    "Besides, trackers over one camera each, against the one over all where cameras overlap");
  command->add_option("--duration", flags->duration_s, "End each run after so many seconds of the scenario")
      ->check(CLI::Range(0.001, 86400.0));
  command->add_option("--seed", flags->seed, "Instead of the scenario's; repeats count up from it")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--repeats", flags->repeats, "Runs with seed, seed + 1, ... instead of the scenario's")
      ->check(CLI::Range(1, 1000));
  command->add_option("--json", flags->json, "Report to this file; - prints it instead of the table");
  command->callback([flags, &run] { run = [flags] { return evaluate(*flags); }; });
}

}  // namespace skylight::service
