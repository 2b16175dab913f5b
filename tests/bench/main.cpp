// Runs the benchmarks, then says how the tracker stands against the baseline on the same frames.
#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <unistd.h>

namespace {

// The console's report, and the CPU seconds of each benchmark: other work on the machine shows less in them.
class Reporter : public benchmark::ConsoleReporter {
 public:
  Reporter() : ConsoleReporter(isatty(STDOUT_FILENO) != 0 ? OO_ColorTabular : OO_Tabular) {}

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred || run.iterations == 0) continue;
      seconds_[run.run_name.str()].push_back(run.cpu_accumulated_time / static_cast<double>(run.iterations));
    }
    ConsoleReporter::ReportRuns(runs);
  }

  /// The median of the repetitions.
  std::optional<double> seconds(const std::string& name) const {
    const auto at = seconds_.find(name);
    if (at == seconds_.end()) return std::nullopt;
    std::vector<double> all = at->second;
    std::sort(all.begin(), all.end());
    return all[all.size() / 2];
  }

 private:
  std::map<std::string, std::vector<double>> seconds_;
};

void print_ratio(const char* what, double share, double aim) {
  std::printf("%-44s 1/%-8.1f 1/%-6.0f %s\n", what, 1.0 / share, aim, share * aim <= 1.0 ? "met" : "not met");
}

void print_ratios(const Reporter& reporter) {
  const auto one = reporter.seconds("tracked_frame/robots:1");
  const auto ten = reporter.seconds("tracked_frame/robots:10");
  const auto pipeline = reporter.seconds("homography_frame/features:500");
  if (!one || !ten || !pipeline) return;
  std::printf("\n%-44s %-10s %s\n", "CPU time of a frame : homography pipeline", "measured", "aim");
  print_ratio("1 robot", *one / *pipeline, 100);
  print_ratio("each further robot", (*ten - *one) / 9 / *pipeline, 150);
}

}  // namespace

int main(int argc, char** argv) {
#if !defined(NDEBUG) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  std::fprintf(
      stderr,
      "skylight_bench: warning: a debug or sanitizer build measures nothing; use the release preset\n");
  return 1;
#endif
  cv::setNumThreads(1);  // figures of one core, and of the same work for the tracker and the baseline
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  Reporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  print_ratios(reporter);
  return 0;
}
