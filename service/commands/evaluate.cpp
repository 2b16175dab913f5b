#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <fstream>
#include <map>

#include "service/assembly.hpp"
#include "service/commands/commands.hpp"
#include "service/wire.hpp"
#include "tracker/metrics.hpp"

namespace skylight::service {
namespace {

struct EvaluateFlags {
  ConfigFlags config;
  std::vector<std::string> scenarios;
  std::vector<std::string> detectors{"orb"};
  std::vector<std::string> kinds{"measured", "filtered"};
  std::string filter = "window";
  double horizon_s = 0.0;
  std::optional<std::uint64_t> seed;
  std::string json;
};

/// With labels that are known from the start (each robot its own appearance): a pose on its own robot is
/// right, one elsewhere is wrong, one elsewhere that stands on another robot is a switch.
class IdentityTally {
 public:
  void add(const std::vector<Truth>& truth, const std::vector<std::optional<Pose2>>& poses) {
    at_.resize(truth.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      truths_ += truth[i].in_view ? 1 : 0;
      if (!poses[i]) continue;
      ++poses_;
      const std::size_t at = nearest(truth, *poses[i]);
      right_ += at == i ? 1 : 0;
      if (at < truth.size()) {
        switches_ += (at_[i] < truth.size() && at_[i] != at) || (at_[i] == truth.size() && at != i) ? 1 : 0;
        at_[i] = at;
      }
    }
  }

  Json json() const {
    const double idf1 = truths_ + poses_ > 0
                            ? 2.0 * static_cast<double>(right_) / static_cast<double>(truths_ + poses_)
                            : 1.0;
    const auto misses = static_cast<double>(truths_) - static_cast<double>(right_);
    const auto wrong = static_cast<double>(poses_ - right_);
    const double mota =
        truths_ > 0 ? 1.0 - (misses + wrong + static_cast<double>(switches_)) / static_cast<double>(truths_)
                    : 1.0;
    return {{"id_switches", switches_}, {"idf1", idf1}, {"mota", mota}};
  }

 private:
  static std::size_t nearest(const std::vector<Truth>& truth, const Pose2& pose) {
    std::size_t best = truth.size();
    double least = RobotMetrics::kUsableError;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double apart = (truth[i].pose.position() - pose.position()).norm();
      if (apart < least) {
        least = apart;
        best = i;
      }
    }
    return best;
  }

  std::vector<std::size_t> at_;  ///< on which robot each label stood last; their number: on none yet
  std::size_t truths_ = 0;
  std::size_t poses_ = 0;
  std::size_t right_ = 0;
  std::size_t switches_ = 0;
};

/// One detector's tracker over one scenario, scored by each kind.
class Contestant {
 public:
  Contestant(const Assembly& assembly, std::string detector, std::vector<PoseKind> kinds, Duration horizon)
      : detector_(std::move(detector)),
        kinds_(std::move(kinds)),
        horizon_(horizon),
        tracker_(make_tracker(assembly)),
        scores_(kinds_.size()) {}

  void process(const Frame& frame, const std::vector<Truth>& truth) {
    const auto begin = std::chrono::steady_clock::now();
    const std::vector<RobotReport> reports = tracker_.process(frame);
    milliseconds_.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    const std::vector<RobotView> views = tracker_.views();
    for (std::size_t k = 0; k < kinds_.size(); ++k) {
      std::vector<std::optional<Pose2>> poses(truth.size());
      for (std::size_t i = 0; i < truth.size(); ++i)
        poses[i] = score(scores_[k].robots[truth[i].id], kinds_[k], frame, truth[i], reports, views);
      scores_[k].identity.add(truth, poses);
    }
    if (std::find(kinds_.begin(), kinds_.end(), PoseKind::predicted) != kinds_.end())
      past_.push_back({frame.captured, views});
    while (past_.size() > 1 && past_[1].first <= frame.captured - horizon_) past_.pop_front();
  }

  std::size_t frames() const { return milliseconds_.size(); }
  const std::string& detector() const { return detector_; }
  std::size_t kind_count() const { return kinds_.size(); }
  PoseKind kind(std::size_t k) const { return kinds_[k]; }

  Json time_json() const {
    std::vector<double> sorted = milliseconds_;
    std::sort(sorted.begin(), sorted.end());
    double sum = 0.0;
    for (const double ms : sorted) sum += ms;
    return {{"mean", sorted.empty() ? 0.0 : sum / static_cast<double>(sorted.size())},
            {"p50", percentile(sorted, 0.5)},
            {"p99", percentile(sorted, 0.99)}};
  }

  Json robots_json(std::size_t k) const {
    Json robots = Json::array();
    for (const auto& [id, metrics] : scores_[k].robots) {
      const RobotScore s = metrics.score();
      const ErrorSummary& p = s.position_error_m;
      const ErrorSummary& y = s.yaw_error_rad;
      robots.push_back({{"id", id},
                        {"frames", s.frames},
                        {"availability", s.availability},
                        {"position_error_m",
                         {{"mean", p.mean},
                          {"std", p.std},
                          {"min", p.min},
                          {"p50", p.p50},
                          {"p95", p.p95},
                          {"p99", p.p99},
                          {"max", p.max}}},
                        {"yaw_error_rad", {{"mean", y.mean}, {"p95", y.p95}, {"p99", y.p99}, {"max", y.max}}},
                        {"nees_mean", s.nees_mean},
                        {"ellipse_95", s.ellipse_95},
                        {"measured", s.measured},
                        {"usable", s.usable},
                        {"confident_wrong", s.confident_wrong}});
    }
    return robots;
  }

  Json identity_json(std::size_t k) const { return scores_[k].identity.json(); }

 private:
  struct Score {
    std::map<std::string, RobotMetrics> robots;
    IdentityTally identity;
  };

  std::optional<Estimate> estimate_of(PoseKind kind, const std::string& id, const Frame& frame,
                                      const RobotReport* report) const {
    if (kind == PoseKind::predicted) {
      if (past_.empty() || past_.front().first > frame.captured - horizon_) return std::nullopt;
      const auto& views = past_.front().second;
      const auto view =
          std::find_if(views.begin(), views.end(), [&](const RobotView& v) { return v.id == id; });
      return view == views.end() ? std::nullopt : view->filter->predict(frame.captured);
    }
    if (report == nullptr) return std::nullopt;
    if (kind == PoseKind::filtered) return report->filtered;
    if (!report->measured) return std::nullopt;
    return Estimate{
        .at = frame.captured, .pose = report->measured->pose, .covariance = report->measured->covariance};
  }

  std::optional<Pose2> score(RobotMetrics& metrics, PoseKind kind, const Frame& frame, const Truth& truth,
                             const std::vector<RobotReport>& reports, const std::vector<RobotView>&) const {
    const auto report =
        std::find_if(reports.begin(), reports.end(), [&](const RobotReport& r) { return r.id == truth.id; });
    const RobotReport* mine = report == reports.end() ? nullptr : &*report;
    const auto estimate = estimate_of(kind, truth.id, frame, mine);
    ScoredFrame scored{.captured = frame.captured,
                       .truth = truth.pose,
                       .in_view = truth.in_view,
                       .estimate = {},
                       .covariance = {},
                       .state = mine != nullptr ? mine->state : TrackState::searching,
                       .measured = mine != nullptr && mine->measured.has_value()};
    if (estimate) {
      scored.estimate = estimate->pose;
      scored.covariance = estimate->covariance;
    }
    metrics.add(scored);
    return scored.estimate;
  }

  std::string detector_;
  std::vector<PoseKind> kinds_;
  Duration horizon_;
  Tracker tracker_;
  std::vector<Score> scores_;
  std::vector<double> milliseconds_;
  std::deque<std::pair<Time, std::vector<RobotView>>> past_;  ///< from the horizon on
};

std::vector<PoseKind> kinds_of(const EvaluateFlags& flags) {
  std::vector<PoseKind> kinds;
  for (const std::string& name : flags.kinds) {
    const auto kind = pose_kind_from_string(name);
    if (!kind) throw UsageError("--kind is '" + name + "', allowed: measured, filtered, predicted");
    if (*kind == PoseKind::smoothed)
      throw UsageError(
          "--kind is 'smoothed': the window filter has no smoother, allowed: measured, filtered, predicted");
    if (*kind == PoseKind::predicted && !(flags.horizon_s > 0))
      throw UsageError("--kind predicted needs --horizon");
    kinds.push_back(*kind);
  }
  return kinds;
}

Assembly assemble_for(const EvaluateFlags& flags, const std::string& scenario, const std::string& detector) {
  std::vector<Override> more{{"source.type=simulator", "evaluate"},
                             {"source.scenario=" + scenario, "evaluate"},
                             {"tracker.detector=" + detector, "--detector"},
                             {"tracker.filter.type=" + flags.filter, "--filter"}};
  if (flags.seed) more.push_back({"source.seed=" + std::to_string(*flags.seed), "--seed"});
  Assembly assembly = assemble(flags.config.load(more));
  if (assembly.simulator->duration_s() <= 0.0)
    throw UsageError(scenario + ": this scenario never ends; evaluate needs one with a duration_s");
  return assembly;
}

Json evaluate_scenario(const EvaluateFlags& flags, const std::string& scenario) {
  const std::vector<PoseKind> kinds = kinds_of(flags);
  std::vector<Contestant> contestants;
  Assembly first = assemble_for(flags, scenario, flags.detectors.front());
  contestants.emplace_back(first, flags.detectors.front(), kinds, from_seconds(flags.horizon_s));
  for (std::size_t i = 1; i < flags.detectors.size(); ++i) {
    contestants.emplace_back(assemble_for(flags, scenario, flags.detectors[i]), flags.detectors[i], kinds,
                             from_seconds(flags.horizon_s));
  }
  const SimulatorFrames& simulator = *first.simulator;
  const double rate = simulator.cameras().front().frame_rate_hz;
  {
    double total = 0.0;
    for (const SimulatedCamera& camera : simulator.cameras())
      total += simulator.duration_s() * camera.frame_rate_hz;
    Progress progress(simulator.name(), static_cast<std::size_t>(total));
    while (const auto frame = first.source->next()) {
      for (Contestant& contestant : contestants) contestant.process(*frame, simulator.truth());
      progress.step();
    }
  }
  const Intrinsics& camera = simulator.cameras().front().model.intrinsics();
  Json out = Json::array();
  for (const Contestant& contestant : contestants) {
    for (std::size_t k = 0; k < contestant.kind_count(); ++k) {
      out.push_back({{"name", simulator.name()},
                     {"seed", simulator.seed()},
                     {"frame_rate", rate},
                     {"resolution", {camera.width_px, camera.height_px}},
                     {"exposure_s", simulator.cameras().front().exposure_s},
                     {"frames", contestant.frames()},
                     {"detector", contestant.detector()},
                     {"filter", flags.filter},
                     {"kind", to_string(contestant.kind(k))},
                     {"tracker_ms", contestant.time_json()},
                     {"robots", contestant.robots_json(k)},
                     {"identity", contestant.identity_json(k)}});
    }
  }
  return out;
}

// Where there was no pose there is no error either: a dash, no nought that would look like perfection.
std::string figure(const char* format, const Json& value, double factor, bool any) {
  char text[40] = "-";
  if (any) std::snprintf(text, sizeof text, format, value.get<double>() * factor);
  return text;
}

void print_row(const Json& scenario, const Json& robot) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  const Json& p = robot["position_error_m"];
  const Json& y = robot["yaw_error_rad"];
  const bool any = robot["availability"].get<double>() > 0.0;
  const auto text = [](const Json& value) { return value.get<std::string>(); };
  std::printf("%-10s %-10s %-10s |", text(scenario["detector"]).c_str(), text(scenario["kind"]).c_str(),
              text(robot["id"]).c_str());
  for (const char* key : {"mean", "p95", "p99", "max"})
    std::printf(" %8s", figure("%.3f", p[key], 1e3, any).c_str());
  std::printf(" | %8s %8s |", figure("%.4f", y["mean"], kDegrees, any).c_str(),
              figure("%.4f", y["p99"], kDegrees, any).c_str());
  std::printf(" %6.2f %% %6.2f %% %6zu |", 100 * robot["measured"].get<double>(),
              100 * robot["usable"].get<double>(), robot["confident_wrong"].get<std::size_t>());
  std::printf(" %6s %4s %% | %7.2f\n", figure("%.2f", robot["nees_mean"], 1.0, any).c_str(),
              figure("%.0f", robot["ellipse_95"], 100.0, any).c_str(),
              scenario["tracker_ms"]["mean"].get<double>());
}

void print_table(const Json& scenarios) {
  std::string last;
  for (const Json& s : scenarios) {
    const std::string head =
        s["name"].get<std::string>() + ", seed " + std::to_string(s["seed"].get<std::uint64_t>());
    if (head != last) {
      std::printf("\n%s: %d x %d px, %g frames/s, exposure %g ms, %zu frames\n", head.c_str(),
                  s["resolution"][0].get<int>(), s["resolution"][1].get<int>(), s["frame_rate"].get<double>(),
                  s["exposure_s"].get<double>() * 1e3, s["frames"].get<std::size_t>());
      std::printf("%-10s %-10s %-10s | %8s %8s %8s %8s | %8s %8s | %8s %8s %6s | %6s %6s | %7s\n", "detector",
                  "kind", "robot", "mean mm", "p95 mm", "p99 mm", "max mm", "yaw deg", "p99 deg", "measured",
                  "usable", "wrong", "NEES", "95 %", "ms");
      last = head;
    }
    for (const Json& robot : s["robots"]) print_row(s, robot);
    const Json& identity = s["identity"];
    if (s["robots"].size() > 1) {
      std::printf("%-10s %-10s identity   | %zu switches, IDF1 %.4f, MOTA %.4f\n",
                  s["detector"].get<std::string>().c_str(), s["kind"].get<std::string>().c_str(),
                  identity["id_switches"].get<std::size_t>(), identity["idf1"].get<double>(),
                  identity["mota"].get<double>());
    }
  }
}

int evaluate(const EvaluateFlags& flags) {
  Json scenarios = Json::array();
  for (const std::string& scenario : flags.scenarios) {
    for (Json& entry : evaluate_scenario(flags, scenario)) scenarios.push_back(std::move(entry));
  }
  const Json report{{"scenarios", scenarios}};
  if (flags.json == "-") {
    std::printf("%s\n", report.dump(2).c_str());
    return 0;
  }
  print_table(scenarios);
  if (!flags.json.empty()) {
    std::ofstream out(flags.json);
    out << report.dump(2) << "\n";
    out.flush();
    if (!out) throw std::runtime_error(flags.json + ": cannot be written");
  }
  return 0;
}

}  // namespace

void add_evaluate(CLI::App& app, Run& run) {
  auto flags = std::make_shared<EvaluateFlags>();
  CLI::App* command = app.add_subcommand(
      "evaluate", "Simulator and tracker in lockstep: accuracy, availability and identity against truth");
  command->add_option("scenarios", flags->scenarios, "Scenarios: names, or .json files")->required();
  flags->config.add_to(*command, false);
  command
      ->add_option("--detector", flags->detectors,
                   "orb, homography; several are scored on the same frames (orb)")
      ->delimiter(',')
      ->check(CLI::IsMember({"orb", "homography"}));
  command->add_option("--filter", flags->filter, "window")->check(CLI::IsMember({"window"}));
  command
      ->add_option("--kind", flags->kinds,
                   "What is scored: measured, filtered, predicted (measured,filtered)")
      ->delimiter(',');
  command->add_option("--horizon", flags->horizon_s, "With --kind predicted: how far ahead, seconds")
      ->check(CLI::Range(0.001, 60.0));
  command->add_option("--seed", flags->seed, "Instead of the scenario's")->check(CLI::NonNegativeNumber);
  command->add_option("--json", flags->json, "Report to this file; - prints it instead of the table");
  command->callback([flags, &run] { run = [flags] { return evaluate(*flags); }; });
}

}  // namespace skylight::service
