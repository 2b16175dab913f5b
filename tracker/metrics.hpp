// How good a robot's poses are, against truth: what `skylight evaluate` prints per robot.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tracker/types.hpp"

namespace skylight {

/// One frame of one robot: what was said of it, and what was true.
struct ScoredFrame {
  Time captured{};
  Pose2 truth;                            ///< at `captured`
  bool in_view = true;                    ///< the robot stands in some camera's picture
  double visible = 1.0;                   ///< share of its top that some camera sees, 0 to 1
  std::optional<Pose2> estimate;          ///< of the kind that is scored; none where there was none
  std::optional<Covariance3> covariance;  ///< of the estimate; none where there is none
  TrackState state = TrackState::searching;
  bool measured = false;  ///< the frame gave an observation of this robot
};

/// Of position errors (metres) or yaw errors (radians, absolute). All 0 where nothing was counted.
struct ErrorSummary {
  std::size_t count = 0;
  double mean = 0.0;
  double std = 0.0;  ///< about the mean, over these frames (divided by their number)
  double min = 0.0;
  /// Percentiles: of n sorted errors that at rank (n - 1) q, linear between the two beside it (Hyndman and
  /// Fan 1996, type 7; as numpy's default).
  double p50 = 0.0;
  double p95 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

/// Linear interpolation between order statistics, as above; `sorted` rising, 0 <= q <= 1. 0 where empty.
double percentile(const std::vector<double>& sorted, double q);

/// All but confident_wrong is of the counted frames: those from 1 s after the robot first came into view,
/// also where it is hidden or has left again: where it is remains the question.
struct RobotScore {
  std::size_t frames = 0;
  ErrorSummary position_error_m;  ///< distance on the floor; over the counted frames with a pose
  ErrorSummary yaw_error_rad;     ///< absolute, 0 to pi
  double availability = 0.0;      ///< share with a pose, whatever its error
  double measured = 0.0;          ///< share with an observation
  double usable = 0.0;            ///< share with a position error below 0.1 m
  /// Poses in state `tracking` that are off by more than 0.1 m (or are not finite), over every frame given,
  /// the first second and the time before the robot came into view included.
  std::size_t confident_wrong = 0;
  /// Mean of e^T P^-1 e, e = (x, y, yaw) error, P the covariance; 3 where covariances are honest. Over the
  /// counted frames with a pose and a covariance that can be inverted; 0 where there are none.
  double nees_mean = 0.0;
  double ellipse_95 = 0.0;      ///< share of those with the true position inside the 95 % ellipse
  std::size_t nees_frames = 0;  ///< how many those were
  /// From when it came into view, or back into it (half of its top is seen, where less was before, or it was
  /// carried elsewhere), until a pose in state `tracking` was within 0.1 m. Seconds.
  std::size_t finds = 0;
  double find_mean_s = 0.0;
  double find_worst_s = 0.0;
  std::size_t never_found = 0;  ///< times that it was not found before it went out of view again, or the end
  /// While it stood in the picture and less than half of its top was seen: frames, poses off by more than 0.1
  /// m, and frames whose state said `occluded`.
  std::size_t hidden = 0;
  std::size_t hidden_wrong = 0;
  std::size_t hidden_told = 0;
  double hidden_nees_mean = 0.0;  ///< as nees_mean, over those of the counted frames in which it was hidden
  std::size_t hidden_nees_frames = 0;
  std::size_t bad_covariances =
      0;  ///< with a pose, and a covariance not finite, not symmetric or not positive
};

/// Gathers the frames of one robot, in order of time. Keeps two numbers per counted frame.
class RobotMetrics {
 public:
  static constexpr double kUsableError = 0.1;  ///< m
  static constexpr Duration kGrace = std::chrono::seconds(1);
  static constexpr double kHidden = 0.5;   ///< share of its top of which less is seen
  static constexpr double kCarried = 0.3;  ///< m from frame to frame: no robot drives that fast
  /// 95 % quantile of chi-squared with two degrees of freedom: -2 ln 0.05.
  static constexpr double kEllipse95 = 5.991464547107979;

  void add(const ScoredFrame& frame);
  /// It is carried about at the time of a frame: nothing to be right or wrong about.
  void away();

  /// Pools another run's frames with these (each run counts from its own coming into view).
  void merge(const RobotMetrics& other);

  RobotScore score() const;

 private:
  void judge_finding(const ScoredFrame& frame, bool has_pose, bool wrong);
  void judge_covariance(const Eigen::Vector3d& error, const Covariance3& covariance, bool hidden);

  std::optional<Time> came_into_view_;
  std::optional<Pose2> last_truth_;  ///< where it was in the frame before; none: carried about, or no frame
  bool was_visible_ = false;
  std::optional<Time> waiting_since_;  ///< to be found
  std::vector<double> find_times_;
  std::size_t never_found_ = 0;
  std::size_t hidden_ = 0;
  std::size_t hidden_wrong_ = 0;
  std::size_t hidden_told_ = 0;
  double hidden_nees_sum_ = 0.0;
  std::size_t hidden_nees_frames_ = 0;
  std::size_t frames_ = 0;
  std::size_t measured_ = 0;
  std::size_t usable_ = 0;
  std::size_t confident_wrong_ = 0;
  std::vector<double> position_errors_;
  std::vector<double> yaw_errors_;
  double nees_sum_ = 0.0;
  std::size_t nees_frames_ = 0;
  std::size_t inside_ellipse_ = 0;
  std::size_t bad_covariances_ = 0;
};

}  // namespace skylight
