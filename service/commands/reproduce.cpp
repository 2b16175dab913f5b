#include <chrono>
#include <cstdio>
#include <ctime>

#include <unistd.h>

#include "service/commands/commands.hpp"
#include "service/report/report.hpp"
#include "service/reproduce/experiments.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

struct ReproduceFlags {
  std::string out = "reproduced";
  std::string data;
  bool quick = false;
  int seeds = 10;
  std::size_t threads = 0;
};

// A line on a terminal that follows the work; elsewhere a line for each stage.
class StageLine {
 public:
  void show(const std::string& stage, const reproduce::Progress& progress) {
    if (isatty(STDERR_FILENO) == 1) {
      std::fprintf(stderr, "\r\033[K%s: %zu of %zu runs (%.0f %%)", stage.c_str(), progress.done,
                   progress.total, 100.0 * progress.share);
      if (progress.done == progress.total) std::fputs("\n", stderr);
    } else if (stage != stage_) {
      std::fprintf(stderr, "%s: %zu runs, %zu of them there already\n", stage.c_str(), progress.total,
                   progress.reused);
    }
    stage_ = stage;
  }

 private:
  std::string stage_;
};

std::optional<fs::path> mrclam_folder(const ReproduceFlags& flags) {
  const bool told = !flags.data.empty();
  const fs::path folder = fs::path(told ? flags.data : "../shared/data") / "trajectories" / "mrclam6";
  if (fs::is_directory(folder)) return folder;
  if (told) throw UsageError("--data is '" + flags.data + "': there is no trajectories/mrclam6 in it");
  std::fputs("no trajectories/mrclam6 (see --data): the report goes without real robots\n", stderr);
  return std::nullopt;
}

// The aims' table, for the terminal.
void print_summary(const report::Document& document) {
  for (const report::Section& section : document.sections) {
    for (const report::Block& block : section.blocks) {
      const auto* table = std::get_if<report::Table>(&block);
      if (table == nullptr || table->id != "aims") continue;
      for (const report::Row& row : table->rows) {
        const auto cell = [](const report::Cell& c) {
          if (!c.number) return c.text;
          char text[40];
          std::snprintf(text, sizeof text, "%.*f", c.digits, *c.number);
          return std::string(text);
        };
        std::printf("%-84s paper %8s  aim %9s  ours %9s  %s\n", cell(row.cells[0]).c_str(),
                    cell(row.cells[1]).c_str(), cell(row.cells[2]).c_str(), cell(row.cells[3]).c_str(),
                    row.cells[3].emphasis == report::Emphasis::good ? "kept" : "missed");
      }
    }
  }
}

// Said now, not after an hour.
void make_folder(const ReproduceFlags& flags) {
  std::error_code error;
  fs::create_directories(flags.out, error);
  if (error || !fs::is_directory(flags.out))
    throw UsageError("--out is '" + flags.out +
                     "', which cannot be made: " + (error ? error.message() : "it is no folder"));
}

int run_reproduce(const ReproduceFlags& flags) {
  const auto begin = std::chrono::steady_clock::now();
  make_folder(flags);
  reproduce::Plan plan = flags.quick ? reproduce::quick_plan() : reproduce::full_plan(flags.seeds);
  plan.mrclam = mrclam_folder(flags);
  StageLine line;
  const auto gathered = reproduce::gather(
      plan,
      {.folder = fs::path(flags.out) / "observed",
       .threads = flags.threads,
       .progress = [&](const std::string& stage, const reproduce::Progress& p) { line.show(stage, p); }});
  std::string command = "skylight reproduce";
  if (flags.quick) command.append(" --quick");
  if (!flags.quick && flags.seeds != 10) command.append(" --seeds ").append(std::to_string(flags.seeds));
  const report::Document document =
      reproduce::document(gathered, {{"Command", command}, {"Version", SKYLIGHT_VERSION}});
  report::write(document, flags.out);
  print_summary(document);
  const double minutes =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / 60.0;
  // Beside other work the clock tells little: the processor's time, shared by the cores, is what it takes.
  std::printf("took %.1f minutes by the clock, %.1f of processor time\n", minutes,
              static_cast<double>(std::clock()) / CLOCKS_PER_SEC / 60.0);
  std::printf("report: %s\n", (fs::path(flags.out) / "report.html").string().c_str());
  return 0;
}

}  // namespace

void add_reproduce(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ReproduceFlags>();
  CLI::App* command = app.add_subcommand(
      "reproduce",
      "The paper's experiments, and Skylight's figures beside them: one report. What is interrupted "
      "goes on where it stopped");
  command->add_option("--out", flags->out, "Folder of the report; detections are kept in it (reproduced)");
  command->add_flag("--quick", flags->quick, "A first look: a few routes, cut short");
  command->add_option("--seeds", flags->seeds, "Runs of each route, seeds 1, 2, ... (the paper's 10)")
      ->check(CLI::Range(1, 1000));
  command->add_option("--data", flags->data, "Folder of the real data (../shared/data, where it is there)");
  command->add_option("--threads", flags->threads, "Runs at the same time (the machine's cores)")
      ->check(CLI::Range(1, 256));
  command->callback([flags, &run] { run = [flags] { return run_reproduce(*flags); }; });
}

}  // namespace skylight::service
