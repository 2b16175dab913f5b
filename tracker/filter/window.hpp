// The paper's window filter: K. Kononov, R. Lavrenov, L. Gavrilova, T. Tsoy, "External RGB-D Camera Based
// Mobile Robot Localization in Gazebo Environment with Real-Time Filtering and Smoothing Techniques",
// section 4, Eqs. 1 to 3, Figs. 4 and 5.
//
// State: a buffer of W positions, a predicted position p, an average offset o, two counters.
//
//   count      `calibration_threshold` detections are let pass (the robot may be half in view).
//   calibrate  the next W go into the buffer, ungated: there is no prediction yet to gate by. Then
//              o = (sum of the W - 1 successive differences) / W   (Eq. 1),   p = the last of them.
//   track      at each frame the oldest position leaves the buffer, then
//              o = (sum of the W - 2 differences that remain + newest - last) / W   (Eq. 2), p += o (Eq. 3),
//              and p is pushed. The sum telescopes:  o = (z_k - p_{k-W+1}) / W, with z the detection.
//   gap        a detection further than `alpha` from p, or none: o stays what it last was, p += o, and the
//              buffer slides on all the same.
//
// As printed, Eq. 2 divides its last term alone by W. That reading runs away; Eq. 1 and Fig. 5 divide the
// whole sum, and so does this.
//
// What the paper leaves open, and what is taken here:
//  - the offset that carries on through a gap is the last one computed from an accepted position (or Eq.
//  1's);
//  - the gate measures from p as it stands before the frame (the paper: "current and previous coordinates");
//    exactly alpha is accepted;
//  - an accepted position sets the frame-loss counter back, as does a detection while counting or
//  calibrating;
//  - a missed frame while counting or calibrating decrements it too, and at 0 it all begins again: otherwise
//    a calibration could join the two ends of a long absence. Fewer misses than that leave the buffer as it
//    is;
//  - the detection of the very frame at which calibration is cancelled does not count for the next one.
//
// The character: a delayed integrator. On a straight line it lags by exactly one frame's motion, on turns it
// is underdamped; it is stable for every W. It counts frames, whatever time passed between them: frames that
// come irregularly (a jittering clock, dropped frames) bend its path, and every figure needs its frame rate.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "tracker/filter/filter.hpp"

namespace skylight {

/// Frame counts are in frames, whatever their rate: state the rate with every figure.
struct WindowFilterConfig {
  int window_size = 12;           ///< positions in the buffer, 2 to 1000
  double alpha = 0.3;             ///< gate: largest distance from the prediction, metres, > 0 to 100
  int calibration_threshold = 3;  ///< detections before calibration starts, 0 to 1000
  int frame_loss_threshold =
      30;  ///< frames without an accepted position until calibration is cancelled, 1 to 100000

  friend bool operator==(const WindowFilterConfig&, const WindowFilterConfig&) = default;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const WindowFilterConfig& config);

/// How much of the detections' white noise variance is left in the predicted position n accepted frames
/// after calibration, for n = 0, 1, ...; the last value is the limit. Computed from the closed form's
/// response to each input: 1 at n = 0, where the position is the last detection itself.
std::vector<double> window_noise_gains(int window_size);

/// States: `searching` (never tracked, or counting for the first time), `calibrating`, `tracking` (this
/// frame's position was accepted, or completed the calibration), `predicting` (a gap), `lost` (calibration
/// was cancelled after tracking, until the next one has begun).
///
/// The paper filters x and y only. What else an estimate carries:
///  - yaw: the last accepted observation's, turned on through gaps at the yaw rate;
///  - velocity: the offset over the mean interval of the window's frames; yaw rate: slope of the line
///    through the window's accepted yaws (modulo the turns under which the robot looks the same);
///  - covariance: of position, the noise that the recursion leaves of the window's observation covariances,
///    plus its bias: the second moment of (detection - p) over the window's accepted frames, less what noise
///    alone would make of it (lag and the swing on turns show here); of yaw, the observation's. With the time
///    since the last accepted position it grows by the offset's own variance and by a random walk of velocity
///    that makes a robot's velocity another one after about a second. What the last accepted observation says
///    of its camera's calibration (`correlated`) is added to what is published and to nothing else: the
///    window does not average it away.
/// An observation that is not finite counts as none.
class WindowFilter final : public Filter {
 public:
  /// Throws std::invalid_argument with check()'s message.
  explicit WindowFilter(const WindowFilterConfig& config = {});

  FilterStep update(Time captured, const std::optional<Observation>& observation) override;
  /// The position goes on at the estimate's velocity, the yaw at its yaw rate.
  std::optional<Estimate> predict(Time at) const override;
  void reset() override;
  std::unique_ptr<Filter> clone() const override { return std::make_unique<WindowFilter>(*this); }

  // The paper's filter knows neither odometry nor a smoother.
  bool odometry(const BodyVelocity&) override { return false; }
  Duration smoothing_lag() const override { return {}; }
  std::optional<Estimate> smoothed(Time) const override { return std::nullopt; }
  std::vector<Estimate> smoothed_from(Time) const override { return {}; }

  const WindowFilterConfig& config() const { return config_; }

 private:
  enum class Phase : std::uint8_t { counting, calibrating, running };

  /// An accepted frame of the window, for what the paper does not filter.
  struct Accepted {
    std::uint64_t frame = 0;
    Time captured{};
    Covariance3 covariance;
    double yaw = 0.0;                      ///< unwrapped: continuous from one to the next
    std::optional<Eigen::Vector2d> error;  ///< detection - p; none while calibrating
  };

  void begin_again();
  void collect(const Eigen::Vector2d& detected);
  bool track(const std::optional<Observation>& observation);
  void count_loss();
  void remember(const Observation& observation);
  void judge_noise();
  void judge_yaw();
  TrackState state(bool accepted) const;
  double frame_interval() const;
  Covariance3 covariance_at(Time at) const;

  WindowFilterConfig config_;
  std::vector<double> noise_gains_;

  // The paper's state.
  Phase phase_ = Phase::counting;
  bool ever_tracked_ = false;
  int detections_ = 0;   ///< while counting
  int losses_left_ = 0;  ///< the frame-loss counter
  std::deque<Eigen::Vector2d> buffer_;
  Eigen::Vector2d predicted_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d offset_ = Eigen::Vector2d::Zero();

  // What the estimate needs beside it.
  std::uint64_t frame_ = 0;
  std::deque<Time> frame_times_;   ///< of the last window_size + 1 frames
  std::deque<Accepted> accepted_;  ///< of the last window_size frames
  std::size_t accepted_since_calibration_ = 0;
  Covariance3 covariance_ = Covariance3::Identity();  ///< at the last accepted frame
  Covariance3 correlated_ = Covariance3::Zero();      ///< of the last accepted observation
  CameraSet camera_ = 0;                              ///< whose that was
  Eigen::Matrix2d offset_covariance_ = Eigen::Matrix2d::Zero();
  double yaw_ = 0.0;  ///< at the last accepted frame, unwrapped
  double yaw_rate_ = 0.0;
  Time last_accepted_{};
  FilterStep last_;
};

}  // namespace skylight
