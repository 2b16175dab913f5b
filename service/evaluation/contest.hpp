// Trackers over runs of a scenario, in lockstep with the simulator, scored against its truth.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "service/evaluation/identity.hpp"
#include "service/odometry_inbox.hpp"
#include "tracker/metrics.hpp"
#include "tracker/tracker.hpp"

namespace skylight::service {

/// One kind of pose over the frames of one or more runs.
struct KindScore {
  PoseKind kind = PoseKind::filtered;
  std::vector<RobotMetrics> robots;  ///< in the order of RunScore::robots
  IdentityTally identity;
  std::uint64_t worst_seed = 0;  ///< of several runs: the one with the largest position error, or without any
  double worst_error_m = 0.0;    ///< that error; infinite where the run had no pose at all
};

struct ScoredRobot {
  std::string id;
  bool registered = true;  ///< the tracker knows what it looks like
};

/// What one detector came to in one run, or in several of them pooled.
struct RunScore {
  std::string scenario;
  std::vector<std::uint64_t> seeds;
  double frame_rate_hz = 0.0;
  int width_px = 0;
  int height_px = 0;
  double exposure_s = 0.0;
  std::string detector;
  std::vector<ScoredRobot> robots;
  std::vector<KindScore> kinds;
  std::vector<double> milliseconds;  ///< the tracker's, per frame

  /// Pools a run of the same scenario with another seed.
  void merge(const RunScore& other);
  const KindScore* kind(PoseKind kind) const;
};

/// One detector's tracker over one run, scored by each kind.
class Contestant {
 public:
  /// `horizon`: how far ahead `predicted` is.
  Contestant(const SimulatorFrames& simulator, Tracker tracker, std::string detector,
             const std::vector<PoseKind>& kinds, Duration horizon);

  void process(const Frame& frame, const std::vector<Truth>& truth);
  /// What robots sent before the next frame, and when it came (true time, as the cameras' clocks should have
  /// it). Their own clocks are estimated, as the service does.
  void hear(const std::vector<Odometry>& odometry, Time received);
  /// Once the run is over.
  RunScore result();

 private:
  using Labels = std::vector<std::optional<std::size_t>>;

  /// A frame whose smoothed poses are not final yet.
  struct Waiting {
    Time captured{};
    std::vector<Truth> truth;
    std::vector<RobotReport> reports;
    Labels labels;
  };

  void score_frame(KindScore& kind, const Waiting& frame);
  void score_smoothed(bool all);
  std::optional<Estimate> estimate_of(PoseKind kind, Time captured, const RobotReport& report) const;
  std::optional<Pose2> score(KindScore& into, std::size_t robot, const Waiting& frame) const;
  std::vector<Truth> seen_by_any(std::size_t camera, std::vector<Truth> truth);

  Duration horizon_;
  Tracker tracker_;
  std::unique_ptr<OdometryInbox> inbox_ = std::make_unique<OdometryInbox>();
  LabelBinding labels_;
  RunScore run_;
  std::deque<std::pair<Time, std::vector<RobotView>>> past_;  ///< from the horizon on, for `predicted`
  std::deque<Waiting> waiting_;                               ///< for `smoothed`
  std::vector<std::map<std::size_t, double>>
      visible_;                     ///< by robot and camera, in each camera's newest frame
  std::vector<RobotView> settled_;  ///< as the histories stood when they were last looked at
};

}  // namespace skylight::service
