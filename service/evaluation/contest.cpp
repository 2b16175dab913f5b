#include "service/evaluation/contest.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>

namespace skylight::service {
namespace {

// A robot's look: the number of the first robot with its appearance, its own where it has none.
std::vector<std::size_t> looks(const std::vector<SimulatedRobot>& robots) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    std::size_t first = i;
    for (std::size_t k = 0; k < i && first == i; ++k) {
      if (robots[i].appearance && robots[k].appearance == robots[i].appearance) first = k;
    }
    out.push_back(first);
  }
  return out;
}

const RobotReport* report_of(const std::vector<RobotReport>& reports, const std::string& id) {
  const auto at =
      std::find_if(reports.begin(), reports.end(), [&](const RobotReport& r) { return r.id == id; });
  return at == reports.end() ? nullptr : &*at;
}

double largest_error(const KindScore& score) {
  double largest = 0.0;
  bool any = false;
  for (const RobotMetrics& robot : score.robots) {
    const ErrorSummary errors = robot.score().position_error_m;
    any = any || errors.count > 0;
    largest = std::max(largest, errors.max);
  }
  return any ? largest : std::numeric_limits<double>::infinity();
}

}  // namespace

void RunScore::merge(const RunScore& other) {
  seeds.insert(seeds.end(), other.seeds.begin(), other.seeds.end());
  milliseconds.insert(milliseconds.end(), other.milliseconds.begin(), other.milliseconds.end());
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const KindScore& from = other.kinds[k];
    for (std::size_t i = 0; i < robots.size(); ++i) kinds[k].robots[i].merge(from.robots[i]);
    kinds[k].identity.merge(from.identity);
    if (from.worst_error_m > kinds[k].worst_error_m) {
      kinds[k].worst_error_m = from.worst_error_m;
      kinds[k].worst_seed = from.worst_seed;
    }
  }
}

const KindScore* RunScore::kind(PoseKind kind) const {
  const auto at = std::find_if(kinds.begin(), kinds.end(), [&](const auto& k) { return k.kind == kind; });
  return at == kinds.end() ? nullptr : &*at;
}

Contestant::Contestant(const SimulatorFrames& simulator, Tracker tracker, std::string detector,
                       const std::vector<PoseKind>& kinds, Duration horizon)
    : horizon_(horizon), tracker_(std::move(tracker)), labels_(looks(simulator.robots())) {
  const SimulatedCamera& camera = simulator.cameras().front();
  run_ = {.scenario = simulator.name(),
          .seeds = {simulator.seed()},
          .frame_rate_hz = camera.frame_rate_hz,
          .width_px = camera.model.intrinsics().width_px,
          .height_px = camera.model.intrinsics().height_px,
          .exposure_s = camera.exposure_s,
          .detector = std::move(detector),
          .robots = {},
          .kinds = {},
          .milliseconds = {}};
  const std::vector<RobotSpec> registered = tracker_.robots();
  for (const SimulatedRobot& robot : simulator.robots()) {
    const bool known = std::any_of(registered.begin(), registered.end(),
                                   [&](const RobotSpec& spec) { return spec.id == robot.id; });
    run_.robots.push_back({robot.id, known});
  }
  for (const PoseKind kind : kinds)
    run_.kinds.push_back(
        {.kind = kind, .robots = std::vector<RobotMetrics>(run_.robots.size()), .identity = {}});
}

void Contestant::process(const Frame& frame, const std::vector<Truth>& truth) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<RobotReport> reports = tracker_.process(frame);
  run_.milliseconds.push_back(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());

  std::vector<const RobotReport*> by_label(truth.size());
  Poses measured(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    by_label[i] = report_of(reports, truth[i].id);
    if (by_label[i] != nullptr && by_label[i]->measured) measured[i] = by_label[i]->measured->pose;
  }
  const auto label_of = labels_.update(truth, measured);
  for (KindScore& kind : run_.kinds) {
    Poses poses(truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const RobotReport* mine = label_of[i] ? by_label[*label_of[i]] : nullptr;
      poses[i] = score(kind, i, frame, truth[i], mine);
    }
    kind.identity.add(truth, poses);
  }
  if (run_.kind(PoseKind::predicted) != nullptr) past_.emplace_back(frame.captured, tracker_.views());
  while (past_.size() > 1 && past_[1].first <= frame.captured - horizon_) past_.pop_front();
}

std::optional<Estimate> Contestant::estimate_of(PoseKind kind, const std::string& id, const Frame& frame,
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

std::optional<Pose2> Contestant::score(KindScore& into, std::size_t robot, const Frame& frame,
                                       const Truth& truth, const RobotReport* report) const {
  if (!truth.present) return std::nullopt;  // no place to be right or wrong about
  const auto estimate = report == nullptr ? std::nullopt : estimate_of(into.kind, report->id, frame, report);
  ScoredFrame scored{.captured = frame.captured,
                     .truth = truth.pose,
                     .in_view = truth.in_view,
                     .estimate = {},
                     .covariance = {},
                     .state = report != nullptr ? report->state : TrackState::searching,
                     .measured = report != nullptr && report->measured.has_value()};
  if (estimate) {
    scored.estimate = estimate->pose;
    scored.covariance = estimate->covariance;
  }
  into.robots[robot].add(scored);
  return scored.estimate;
}

RunScore Contestant::result() const {
  RunScore out = run_;
  for (KindScore& kind : out.kinds) {
    kind.worst_seed = out.seeds.front();
    kind.worst_error_m = largest_error(kind);
  }
  return out;
}

}  // namespace skylight::service
