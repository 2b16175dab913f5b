// A robot on a straight line at constant speed, frame by frame, as a snapshot made by hand.
#pragma once

#include "service/snapshot.hpp"
#include "tests/service/fakes.hpp"
#include "tracker/filter/filters.hpp"

namespace skylight::service::test {

/// Frames 100 ms apart from kStart on; in frame i the robot is seen at x = 0.01 i, y = 2, yaw 0.5. The
/// window filter (8 frames) lags such a line by one frame's motion once it has settled; the motion filter
/// does not.
struct Line {
  static constexpr Duration kInterval = std::chrono::milliseconds(100);
  static constexpr double kStep = 0.01;  ///< metres per frame: 0.1 m/s

  static Time at(double frame) { return kStart + from_seconds(frame * to_seconds(kInterval)); }

  static FilterSpec window() {
    return WindowFilterConfig{.window_size = 8, .calibration_threshold = 0, .frame_loss_threshold = 5};
  }

  /// Its heading is not where it goes: a robot that can.
  static FilterSpec motion() { return MotionFilterConfig{.holonomic = true}; }

  /// Frames 0 to count - 1; those in `unseen` show no robot.
  explicit Line(int count, const std::vector<int>& unseen = {}, const FilterSpec& spec = window()) {
    const std::unique_ptr<Filter> filter = make_filter(spec);
    PoseHistory history({.max_age = std::chrono::hours(1)});
    const auto appearance =
        skylight::test::appearance_of({.image = skylight::test::corner_picture(3), .pose = Pose2{}}, "anna");
    robot.spec = std::make_shared<const RobotSpec>(RobotSpec{.id = "anna", .appearance = appearance});
    robot.view.id = "anna";
    for (int i = 0; i < count; ++i) {
      std::optional<Observation> seen;
      if (std::find(unseen.begin(), unseen.end(), i) == unseen.end()) {
        seen = Observation{.captured = at(i),
                           .pose = {kStep * i, 2.0, 0.5},
                           .covariance = Covariance3::Identity() * 1e-6,
                           .source = PoseSource::align,
                           .score = 0.9};
        robot.view.last_measured = seen;
      }
      const FilterStep step = filter->update(at(i), seen);
      robot.view.state = step.state;
      robot.view.reason = seen ? "" : "covered";
      history.append({.captured = at(i), .state = step.state, .measured = seen, .filtered = step.estimate});
      settle(history, *filter);
    }
    robot.view.history = history.view();
    robot.view.filter = filter->clone();
    snapshot.source = SourceState::running;
    snapshot.cameras.push_back(
        {.id = "ceiling", .model = std::make_shared<const CameraModel>(small_room().camera()), .image = {}});
    newest = at(count - 1);
    snapshot.captured = newest;
  }

  /// As the tracker does it: now and then, those that the lag has passed.
  static void settle(PoseHistory& history, const Filter& filter) {
    const Duration lag = filter.smoothing_lag();
    const HistoryView now = history.view();
    if (lag <= Duration::zero() || now.settled() == now.size()) return;
    const Time first = now[now.settled()].captured;
    if (now.newest().captured - first < lag + lag / 2 - kInterval) return;
    history.settle(filter.smoothed_from(first), now.newest().captured - lag);
  }

  RobotSnapshot robot;
  Snapshot snapshot;
  Time newest;
};

}  // namespace skylight::service::test
