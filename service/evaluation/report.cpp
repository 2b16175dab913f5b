#include "service/evaluation/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace skylight::service {
namespace {

Json time_json(std::vector<double> sorted) {
  std::sort(sorted.begin(), sorted.end());
  double sum = 0.0;
  for (const double ms : sorted) sum += ms;
  return {{"mean", sorted.empty() ? 0.0 : sum / static_cast<double>(sorted.size())},
          {"p50", percentile(sorted, 0.5)},
          {"p99", percentile(sorted, 0.99)}};
}

Json robot_json(const std::string& id, const RobotScore& s) {
  const ErrorSummary& p = s.position_error_m;
  const ErrorSummary& y = s.yaw_error_rad;
  return {{"id", id},
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
          {"confident_wrong", s.confident_wrong},
          {"find",
           {{"count", s.finds},
            {"never", s.never_found},
            {"mean_s", s.finds > 0 ? Json(s.find_mean_s) : Json(nullptr)},
            {"worst_s", s.finds > 0 ? Json(s.find_worst_s) : Json(nullptr)}}},
          {"hidden",
           {{"frames", s.hidden},
            {"wrong", s.hidden_wrong},
            {"told", s.hidden_told},
            {"nees_frames", s.hidden_nees_frames},
            {"nees_mean", s.hidden_nees_mean}}}};
}

Json robots_json(const RunScore& run, const KindScore& kind) {
  Json robots = Json::array();
  for (std::size_t i = 0; i < run.robots.size(); ++i) {
    robots.push_back(robot_json(run.robots[i].id, kind.robots[i].score()));
    robots.back()["registered"] = run.robots[i].registered;
  }
  return robots;
}

Json all_json(const KindScore& kind) {
  RobotMetrics all;
  for (const RobotMetrics& robot : kind.robots) all.merge(robot);
  return robot_json("all", all.score());
}

// Where there was no pose there is no error either: a dash, no nought that would look like perfection.
std::string figure(const char* format, const Json& value, double factor, bool any) {
  char text[40] = "-";
  if (any) std::snprintf(text, sizeof text, format, value.get<double>() * factor);
  return text;
}

void print_row(const Json& entry, const Json& robot) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  const Json& p = robot["position_error_m"];
  const Json& y = robot["yaw_error_rad"];
  const bool any = robot["availability"].get<double>() > 0.0;
  const auto text = [](const Json& value) { return value.get<std::string>(); };
  std::printf("%-10s %-10s %-10s |", text(entry["detector"]).c_str(), text(entry["kind"]).c_str(),
              text(robot["id"]).c_str());
  for (const char* key : {"mean", "p95", "p99", "max"})
    std::printf(" %8s", figure("%.3f", p[key], 1e3, any).c_str());
  std::printf(" | %8s %8s |", figure("%.4f", y["mean"], kDegrees, any).c_str(),
              figure("%.4f", y["p99"], kDegrees, any).c_str());
  std::printf(" %6.2f %% %6.2f %% %6zu |", 100 * robot["measured"].get<double>(),
              100 * robot["usable"].get<double>(), robot["confident_wrong"].get<std::size_t>());
  std::printf(" %6s %4s %% | %7.2f\n", figure("%.2f", robot["nees_mean"], 1.0, any).c_str(),
              figure("%.0f", robot["ellipse_95"], 100.0, any).c_str(),
              entry["tracker_ms"]["mean"].get<double>());
}

void print_head(const Json& entry) {
  std::string head = entry["name"].get<std::string>();
  if (entry.contains("seeds")) {
    head += ", " + std::to_string(entry["seeds"].size()) + " seeds from " +
            std::to_string(entry["seeds"].front().get<std::uint64_t>()) + " pooled";
  } else {
    head += ", seed " + std::to_string(entry["seed"].get<std::uint64_t>());
  }
  std::printf("\n%s: %d x %d px, %g frames/s, exposure %g ms, %zu frames\n", head.c_str(),
              entry["resolution"][0].get<int>(), entry["resolution"][1].get<int>(),
              entry["frame_rate"].get<double>(), entry["exposure_s"].get<double>() * 1e3,
              entry["frames"].get<std::size_t>());
  std::printf("%-10s %-10s %-10s | %8s %8s %8s %8s | %8s %8s | %8s %8s %6s | %6s %6s | %7s\n", "detector",
              "kind", "robot", "mean mm", "p95 mm", "p99 mm", "max mm", "yaw deg", "p99 deg", "measured",
              "usable", "wrong", "NEES", "95 %", "ms");
}

// Over all robots that are tracked: how long they were looked for, and what was said while they were hidden.
void print_finding(const Json& entry, const std::string& left) {
  std::array<std::size_t, 5> sum{};  // found, never, hidden, wrong, told
  double seconds = 0.0;
  double worst = 0.0;
  double nees = 0.0;
  std::size_t nees_frames = 0;
  for (const Json& robot : entry["robots"]) {
    if (!robot["registered"].get<bool>()) continue;
    const Json& find = robot["find"];
    const Json& hidden = robot["hidden"];
    const auto count = find["count"].get<std::size_t>();
    sum[0] += count;
    sum[1] += find["never"].get<std::size_t>();
    sum[2] += hidden["frames"].get<std::size_t>();
    sum[3] += hidden["wrong"].get<std::size_t>();
    sum[4] += hidden["told"].get<std::size_t>();
    nees_frames += hidden["nees_frames"].get<std::size_t>();
    nees += hidden["nees_frames"].get<double>() * hidden["nees_mean"].get<double>();
    if (count == 0) continue;
    seconds += static_cast<double>(count) * find["mean_s"].get<double>();
    worst = std::max(worst, find["worst_s"].get<double>());
  }
  std::printf("%sin view (again) %zu times, found after %s s on average, %.3f s at worst, %zu times not\n",
              left.c_str(), sum[0] + sum[1],
              sum[0] > 0 ? figure("%.3f", seconds / static_cast<double>(sum[0]), 1.0, true).c_str() : "-",
              worst, sum[1]);
  if (sum[2] == 0) return;
  const double mean = nees_frames > 0 ? nees / static_cast<double>(nees_frames) : 0.0;
  std::printf("%shidden in %zu frames: %zu poses off by more than 0.1 m, NEES %s; %zu told as occluded\n",
              left.c_str(), sum[2], sum[3], figure("%.2f", mean, 1.0, nees_frames > 0).c_str(), sum[4]);
}

void print_beneath(const Json& entry) {
  const std::string left =
      entry["detector"].get<std::string>() + " " + entry["kind"].get<std::string>() + ": ";
  if (entry["robots"].size() > 1) {
    const Json& identity = entry["identity"];
    std::printf("%s%zu switches, IDF1 %.4f, MOTA %.4f\n", left.c_str(),
                identity["id_switches"].get<std::size_t>(), identity["idf1"].get<double>(),
                identity["mota"].get<double>());
  }
  print_finding(entry, left);
  if (!entry.contains("worst_seed")) return;
  const Json& error = entry["worst_error_m"];
  std::printf("%sworst with seed %llu (%s)\n", left.c_str(),
              static_cast<unsigned long long>(entry["worst_seed"].get<std::uint64_t>()),
              error.is_null() ? "no pose" : figure("max %.3f mm", error, 1e3, true).c_str());
}

}  // namespace

Json to_json(const RunScore& run, const std::string& filter) {
  Json out = Json::array();
  for (const KindScore& kind : run.kinds) {
    Json entry{{"name", run.scenario},
               {"seed", run.seeds.front()},
               {"frame_rate", run.frame_rate_hz},
               {"resolution", {run.width_px, run.height_px}},
               {"exposure_s", run.exposure_s},
               {"frames", run.milliseconds.size()},
               {"detector", run.detector},
               {"filter", filter},
               {"kind", skylight::to_string(kind.kind)},
               {"tracker_ms", time_json(run.milliseconds)},
               {"robots", robots_json(run, kind)},
               {"identity",
                {{"id_switches", kind.identity.switches()},
                 {"idf1", kind.identity.idf1()},
                 {"mota", kind.identity.mota()}}}};
    if (run.seeds.size() > 1) {
      entry["seeds"] = run.seeds;
      entry["worst_seed"] = kind.worst_seed;
      entry["worst_error_m"] = std::isfinite(kind.worst_error_m) ? Json(kind.worst_error_m) : Json(nullptr);
      entry["all"] = all_json(kind);
    }
    out.push_back(std::move(entry));
  }
  return out;
}

Json to_json(const Judgement& judgement, const std::string& scenario) {
  const auto optional = [](const std::optional<double>& value) {
    return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
  };
  return {{"scenario", scenario},
          {"figure", judgement.expected.figure},
          {"robot", judgement.robot.empty() ? Json(nullptr) : Json(judgement.robot)},
          {"kind", skylight::to_string(judgement.expected.kind)},
          {"at_most", optional(judgement.expected.at_most)},
          {"at_least", optional(judgement.expected.at_least)},
          {"value", optional(judgement.value)},
          {"kept", judgement.kept}};
}

void print_table(const Json& entries) {
  bool first = true;
  for (const Json& entry : entries) {
    if (first) print_head(entry);
    first = false;
    for (const Json& robot : entry["robots"]) print_row(entry, robot);
    if (entry.contains("all") && entry["robots"].size() > 1) print_row(entry, entry["all"]);
    print_beneath(entry);
  }
}

}  // namespace skylight::service
