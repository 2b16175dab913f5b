#include "service/evaluation/cameras_apart.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>

namespace skylight::service {
namespace {

constexpr Duration kLongestStep = std::chrono::milliseconds(200);  // between frames that follow each other

void append(std::vector<double>& to, const std::vector<double>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

double mean(const std::vector<double>& values) {
  if (values.empty()) return 0.0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double ratio(const CamerasScore::Camera& camera) {
  const double alone = mean(camera.alone_m);
  return alone > 0.0 ? mean(camera.together_m) / alone : 0.0;
}

std::vector<double> ratios(const CamerasScore& score) {
  std::vector<double> out;
  for (const CamerasScore::Camera& camera : score.cameras) {
    if (!camera.alone_m.empty()) out.push_back(ratio(camera));
  }
  return out;
}

}  // namespace

void CamerasScore::merge(const CamerasScore& other) {
  for (std::size_t i = 0; i < cameras.size() && i < other.cameras.size(); ++i) {
    append(cameras[i].alone_m, other.cameras[i].alone_m);
    append(cameras[i].together_m, other.cameras[i].together_m);
  }
  append(steps_m, other.steps_m);
  append(hand_over_m, other.hand_over_m);
}

double CamerasScore::worst_ratio() const {
  const std::vector<double> all = ratios(*this);
  return all.empty() ? 0.0 : *std::max_element(all.begin(), all.end());
}

double CamerasScore::mean_ratio() const {
  return mean(ratios(*this));
}

CamerasApart::CamerasApart(const SimulatorFrames& simulator, const Assembly& assembly)
    : together_(make_tracker(assembly)) {
  for (const SimulatedRobot& robot : simulator.robots()) robots_.push_back(robot.id);
  for (const NamedCamera& camera : assembly.cameras) {
    alone_.push_back(make_tracker(assembly));
    score_.cameras.push_back({.id = camera.id, .alone_m = {}, .together_m = {}});
  }
  in_view_.assign(alone_.size(), std::vector<bool>(robots_.size(), false));
  view_changed_.resize(robots_.size());
  last_.resize(robots_.size());
}

CamerasApart::Errors CamerasApart::errors(const Tracker& tracker, Time at, const std::vector<Truth>& truth) {
  const std::vector<RobotView> views = tracker.views();
  Errors out(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&](const RobotView& each) { return each.id == truth[i].id; });
    if (view == views.end() || !truth[i].present) continue;
    if (const auto estimate = view->filter->predict(at))
      out[i] = estimate->pose.position() - truth[i].pose.position();
  }
  return out;
}

// A frame that comes later than another camera's later one is tracked, but not judged: nobody would ask for
// its instant any more.
void CamerasApart::process(const Frame& frame, const std::vector<Truth>& truth) {
  together_.process(frame);
  alone_[frame.camera].process(frame);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (in_view_[frame.camera][i] != truth[i].in_view) view_changed_[i] = frame.captured;
    in_view_[frame.camera][i] = truth[i].in_view;
  }
  if (!first_) first_ = frame.captured;
  const bool late = newest_ && frame.captured <= *newest_;
  if (late || frame.captured - *first_ < kGrace) return;
  judge(frame, truth, errors(together_, frame.captured, truth));
  newest_ = frame.captured;
}

void CamerasApart::judge(const Frame& frame, const std::vector<Truth>& truth, const Errors& together) {
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!together[i] || !last_[i] || frame.captured - *newest_ > kLongestStep) continue;
    score_.steps_m.push_back((*together[i] - *last_[i]).norm());
    if (frame.captured - view_changed_[i] < std::chrono::seconds(1))
      score_.hand_over_m.push_back(score_.steps_m.back());
  }
  last_ = together;
  std::vector<Errors> alone;
  for (const Tracker& tracker : alone_) alone.push_back(errors(tracker, frame.captured, truth));
  for (std::size_t i = 0; i < truth.size(); ++i) {
    std::vector<std::size_t> seen_by;
    for (std::size_t c = 0; c < alone.size(); ++c) {
      if (in_view_[c][i] && alone[c][i]) seen_by.push_back(c);
    }
    if (seen_by.size() < 2 || !together[i]) continue;
    for (const std::size_t c : seen_by) {
      score_.cameras[c].alone_m.push_back(alone[c][i]->norm());
      score_.cameras[c].together_m.push_back(together[i]->norm());
    }
  }
}

Json to_json(const CamerasScore& score) {
  Json cameras = Json::array();
  for (const CamerasScore::Camera& camera : score.cameras) {
    cameras.push_back({{"id", camera.id},
                       {"frames", camera.alone_m.size()},
                       {"alone_m", mean(camera.alone_m)},
                       {"together_m", mean(camera.together_m)},
                       {"ratio", ratio(camera)}});
  }
  const auto spread = [](std::vector<double> steps) {
    std::sort(steps.begin(), steps.end());
    return Json{{"p99", percentile(steps, 0.99)}, {"max", steps.empty() ? 0.0 : steps.back()}};
  };
  return {{"cameras", cameras},
          {"worst_ratio", score.worst_ratio()},
          {"mean_ratio", score.mean_ratio()},
          {"step_m", spread(score.steps_m)},
          {"hand_over_m", spread(score.hand_over_m)}};
}

void print_cameras(const CamerasScore& score) {
  const Json all = to_json(score);
  std::printf("cameras, where two or more had the robot in view (mean mm):\n");
  for (const Json& camera : all["cameras"]) {
    std::printf("  %-10s alone %7.3f   all together %7.3f   ratio %5.2f   (%zu instants)\n",
                camera["id"].get<std::string>().c_str(), camera["alone_m"].get<double>() * 1e3,
                camera["together_m"].get<double>() * 1e3, camera["ratio"].get<double>(),
                camera["frames"].get<std::size_t>());
  }
  std::printf("  worst ratio %.2f, mean %.2f\n", score.worst_ratio(), score.mean_ratio());
  const auto steps = [&](const char* what, const char* key) {
    std::printf("  step of the error from frame to frame, %s: p99 %.3f, max %.3f mm\n", what,
                all[key]["p99"].get<double>() * 1e3, all[key]["max"].get<double>() * 1e3);
  };
  steps("everywhere", "step_m");
  steps("at hand-overs", "hand_over_m");
}

}  // namespace skylight::service
