#include "service/evaluation/expectations.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace skylight::service {
namespace {

bool is_common(const std::string& figure) {
  return figure == "id_switches" || figure == "idf1" || figure == "mota";
}

// None where there was no pose: nobody who says nothing exchanges anybody.
std::optional<double> common_figure(const std::string& figure, const IdentityTally& identity) {
  if (identity.poses() == 0) return std::nullopt;
  if (figure == "id_switches") return static_cast<double>(identity.switches());
  return figure == "idf1" ? identity.idf1() : identity.mota();
}

// How far a value is inside its bounds; negative outside, least of all where there is none.
double margin(const Expected& expected, const std::optional<double>& value) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!value || std::isnan(*value)) return -kInfinity;
  double least = kInfinity;
  if (expected.at_most) least = std::min(least, *expected.at_most - *value);
  if (expected.at_least) least = std::min(least, *value - *expected.at_least);
  return least;
}

Judgement judge_one(const Expected& expected, const RunScore& run) {
  const KindScore* scored = run.kind(expected.kind);
  if (scored == nullptr)
    throw std::invalid_argument("expected of " + std::string(skylight::to_string(expected.kind)) +
                                " poses, which were not scored");
  Judgement worst{.expected = expected, .robot = {}, .value = {}, .kept = false};
  if (is_common(expected.figure)) {
    worst.value = common_figure(expected.figure, scored->identity);
    worst.kept = margin(expected, worst.value) >= 0.0;
    return worst;
  }
  bool any = false;
  for (std::size_t i = 0; i < run.robots.size(); ++i) {
    const ScoredRobot& robot = run.robots[i];
    if (expected.robot.empty() ? !robot.registered : robot.id != expected.robot) continue;
    const auto value = robot_figure(expected.figure, scored->robots[i].score());
    if (!any || margin(expected, value) < margin(expected, worst.value)) {
      worst.robot = robot.id;
      worst.value = value;
    }
    any = true;
  }
  if (!any && !expected.robot.empty())
    throw std::invalid_argument("expected of robot '" + expected.robot + "', which is not there");
  worst.kept = any && margin(expected, worst.value) >= 0.0;
  return worst;
}

std::string none_of(const std::string& figure) {
  if (figure == "hidden_told") return "none: it was never hidden";
  return "none: no pose";
}

std::string number(double value) {
  char out[40];
  std::snprintf(out, sizeof out, "%.6g", value);
  return out;
}

}  // namespace

std::optional<double> robot_figure(const std::string& figure, const RobotScore& score) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  const ErrorSummary& p = score.position_error_m;
  const ErrorSummary& yaw = score.yaw_error_rad;
  // Counted also before the others begin to count; but none of no poses is no merit.
  if (figure == "confident_wrong" && (score.confident_wrong > 0 || p.count > 0))
    return static_cast<double>(score.confident_wrong);
  if (score.frames == 0) return std::nullopt;
  if (figure == "find_mean_s" || figure == "find_worst_s") {
    if (score.never_found > 0) return std::numeric_limits<double>::infinity();
    if (score.finds == 0) return std::nullopt;
    return figure == "find_mean_s" ? score.find_mean_s : score.find_worst_s;
  }
  if (figure == "hidden_told") {
    if (score.hidden == 0) return std::nullopt;
    return static_cast<double>(score.hidden_told) / static_cast<double>(score.hidden);
  }
  if (figure == "availability") return score.availability;
  if (figure == "measured") return score.measured;
  if (figure == "usable") return score.usable;
  if (figure == "nees_mean") return score.nees_frames > 0 ? std::optional(score.nees_mean) : std::nullopt;
  if (p.count == 0) return std::nullopt;
  if (figure == "mean_error_m") return p.mean;
  if (figure == "p95_error_m") return p.p95;
  if (figure == "p99_error_m") return p.p99;
  if (figure == "max_error_m") return p.max;
  if (figure == "mean_yaw_error_deg") return yaw.mean * kDegrees;
  if (figure == "max_yaw_error_deg") return yaw.max * kDegrees;
  return std::nullopt;
}

std::vector<Judgement> judge(const std::vector<Expected>& expected, const RunScore& run) {
  std::vector<Judgement> out;
  for (const Expected& each : expected) out.push_back(judge_one(each, run));
  return out;
}

std::string judgement_line(const Judgement& judgement) {
  const Expected& expected = judgement.expected;
  std::string line = judgement.kept ? "kept    " : "FAILED  ";
  line += expected.figure;
  if (!judgement.robot.empty()) line += " of " + judgement.robot;
  line += " (" + std::string(skylight::to_string(expected.kind)) +
          "): " + (judgement.value ? number(*judgement.value) : none_of(expected.figure)) + ",";
  if (expected.at_least) line += " at least " + number(*expected.at_least);
  if (expected.at_least && expected.at_most) line += " and";
  if (expected.at_most) line += " at most " + number(*expected.at_most);
  return line;
}

}  // namespace skylight::service
