#include "service/evaluation/contest.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>

namespace skylight::service {
namespace {

constexpr std::size_t kSettleEvery = 16;  // frames between looks at what has become final

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

template <typename Named>
const Named* by_id(const std::vector<Named>& all, const std::string& id) {
  const auto at = std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.id == id; });
  return at == all.end() ? nullptr : &*at;
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
  for (const HeardOdometry& heard : inbox_->take(frame.captured))
    tracker_.odometry(heard.robot, heard.velocity);
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<RobotReport> reports = tracker_.process(frame);
  run_.milliseconds.push_back(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());

  Poses measured(truth.size());
  std::vector<RobotReport> by_label(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const RobotReport* report = by_id(reports, truth[i].id);
    if (report == nullptr) continue;
    by_label[i] = *report;
    if (report->measured) measured[i] = report->measured->pose;
  }
  const Waiting now{.captured = frame.captured,
                    .truth = seen_by_any(frame.camera, truth),
                    .reports = std::move(by_label),
                    .labels = labels_.update(truth, measured)};
  for (KindScore& kind : run_.kinds) {
    if (kind.kind != PoseKind::smoothed) score_frame(kind, now);
  }
  if (run_.kind(PoseKind::smoothed) != nullptr) {
    waiting_.push_back(now);
    if (waiting_.size() % kSettleEvery == 0) score_smoothed(false);
  }
  if (run_.kind(PoseKind::predicted) != nullptr) past_.emplace_back(frame.captured, tracker_.views());
  while (past_.size() > 1 && past_[1].first <= frame.captured - horizon_) past_.pop_front();
}

// What one camera sees of a robot another may see better: the most that any saw in its newest frame.
std::vector<Truth> Contestant::seen_by_any(std::size_t camera, std::vector<Truth> truth) {
  visible_.resize(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    visible_[i][camera] = truth[i].visible;
    for (const auto& [which, share] : visible_[i]) truth[i].visible = std::max(truth[i].visible, share);
  }
  return truth;
}

void Contestant::hear(const std::vector<Odometry>& odometry, Time received) {
  std::map<std::string, std::vector<OdometryReading>> by_robot;
  for (const Odometry& said : odometry) {
    by_robot[said.robot].push_back(
        {.stamp = said.at,
         .velocity = {.forward = said.v_mps, .sideways = said.side_mps, .yaw_rate = said.w_radps}});
  }
  for (const auto& [robot, readings] : by_robot) inbox_->hear(robot, readings, received);
}

void Contestant::score_frame(KindScore& kind, const Waiting& frame) {
  Poses poses(frame.truth.size());
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = score(kind, i, frame);
  kind.identity.add(frame.truth, poses);
}

/// Those frames whose smoothed poses are final, or all that are left.
void Contestant::score_smoothed(bool all) {
  settled_ = tracker_.views();
  const auto final_before = [](const RobotView& view) {
    const HistoryView& history = view.history;
    return history.settled() < history.size() ? history[history.settled()].captured : Time::max();
  };
  Time until = Time::max();
  for (const RobotView& view : settled_) until = std::min(until, final_before(view));
  const auto kind = std::find_if(run_.kinds.begin(), run_.kinds.end(),
                                 [](const KindScore& k) { return k.kind == PoseKind::smoothed; });
  while (kind != run_.kinds.end() && !waiting_.empty() && (all || waiting_.front().captured < until)) {
    score_frame(*kind, waiting_.front());
    waiting_.pop_front();
  }
}

std::optional<Estimate> Contestant::estimate_of(PoseKind kind, Time captured,
                                                const RobotReport& report) const {
  if (kind == PoseKind::predicted) {
    if (past_.empty() || past_.front().first > captured - horizon_) return std::nullopt;
    const RobotView* view = by_id(past_.front().second, report.id);
    return view == nullptr ? std::nullopt : view->filter->predict(captured);
  }
  if (kind == PoseKind::smoothed) {
    const RobotView* view = by_id(settled_, report.id);
    if (view == nullptr) return std::nullopt;
    const HistoryAnswer found = view->history.pose(kind, captured);
    if (found.lookup == HistoryLookup::after_history) return view->filter->smoothed(captured);
    return found.pose ? std::optional(found.pose->estimate) : std::nullopt;
  }
  if (kind == PoseKind::filtered) return report.filtered;
  if (!report.measured) return std::nullopt;
  return Estimate{.at = captured,
                  .pose = report.measured->pose,
                  .covariance = report.measured->covariance + report.measured->correlated};
}

std::optional<Pose2> Contestant::score(KindScore& into, std::size_t robot, const Waiting& frame) const {
  const Truth& truth = frame.truth[robot];
  if (!truth.present) {  // no place to be right or wrong about
    into.robots[robot].away();
    return std::nullopt;
  }
  const auto label = frame.labels[robot];
  const RobotReport report = label ? frame.reports[*label] : RobotReport{};
  const auto estimate = report.id.empty() ? std::nullopt : estimate_of(into.kind, frame.captured, report);
  ScoredFrame scored{.captured = frame.captured,
                     .truth = truth.pose,
                     .in_view = truth.in_view,
                     .visible = truth.visible,
                     .estimate = {},
                     .covariance = {},
                     .state = report.state,
                     .measured = report.measured.has_value()};
  if (estimate) {
    scored.estimate = estimate->pose;
    scored.covariance = estimate->covariance;
  }
  into.robots[robot].add(scored);
  return scored.estimate;
}

RunScore Contestant::result() {
  score_smoothed(true);
  RunScore out = run_;
  for (KindScore& kind : out.kinds) {
    kind.worst_seed = out.seeds.front();
    kind.worst_error_m = largest_error(kind);
  }
  return out;
}

}  // namespace skylight::service
