#include <algorithm>
#include <cstdio>
#include <iostream>

#include "service/commands/commands.hpp"
#include "service/recorder.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

struct SimulateFlags {
  std::string scenario;
  std::string out;
  std::string format = "png";
  double duration_s = 0.0;
  std::optional<std::uint64_t> seed;
  bool schema = false;
};

RecordingFormat format_of(const SimulateFlags& flags) {
  if (flags.format == "video") return RecordingFormat::video;
  return flags.format == "mp4" ? RecordingFormat::mp4 : RecordingFormat::png;
}

int simulate(const SimulateFlags& flags) {
  if (flags.schema) {
    std::cout << scenario_schema() << std::flush;
    return 0;
  }
  if (flags.scenario.empty()) throw UsageError("which scenario? A name, or a .json file");
  ScenarioRun run = scenario_run(flags.scenario, flags.seed);
  if (flags.duration_s > 0) run.cut(flags.duration_s);
  if (!(run.duration_s() > 0))
    throw UsageError(flags.scenario + ": this scenario never ends; say --duration");
  SimulatorFrames simulator(run);
  const fs::path folder = flags.out.empty() ? fs::path(simulator.name()) : fs::path(flags.out);
  Recorder recorder(folder, simulator, format_of(flags));

  double total = 0.0;
  for (const SimulatedCamera& camera : simulator.cameras()) total += run.duration_s() * camera.frame_rate_hz;
  std::size_t frames = 0;
  {
    Progress progress(simulator.name(), static_cast<std::size_t>(total));
    while (const auto frame = simulator.next()) {
      recorder.write(*frame, simulator.truth());
      recorder.write(simulator.take_odometry());
      recorder.write(simulator.take_happenings());
      ++frames;
      progress.step();
    }
  }
  recorder.write(simulator.take_odometry());
  recorder.write(simulator.take_happenings());
  recorder.finish(simulator);
  std::printf("%zu frames in %s; track them with: skylight track %s --config %s\n", frames, folder.c_str(),
              (folder / simulator.cameras().front().id).c_str(), (folder / "config.json").c_str());
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, Run& run) {
  auto flags = std::make_shared<SimulateFlags>();
  CLI::App* command = app.add_subcommand(
      "simulate", "Runs a scenario as fast as it can: frames, depth, truth and odometry on disk");
  command->add_option("scenario", flags->scenario, "Scenario: a name, or a .json file");
  command->add_option("--out", flags->out, "Folder to write to (the scenario's name)");
  command
      ->add_option("--format", flags->format,
                   "png; video: one lossless file per camera (FFV1); mp4: one lossy file, to look at (png)")
      ->check(CLI::IsMember({"png", "video", "mp4"}));
  command->add_option("--duration", flags->duration_s, "Stop after so many seconds of the scenario")
      ->check(CLI::Range(0.001, 86400.0));
  command->add_option("--seed", flags->seed, "Instead of the scenario's")->check(CLI::NonNegativeNumber);
  command->add_flag("--schema", flags->schema, "Print the JSON Schema of scenario files and leave");
  command->callback([flags, &run] { run = [flags] { return simulate(*flags); }; });
}

}  // namespace skylight::service
