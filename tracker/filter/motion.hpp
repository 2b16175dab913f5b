// The default filter: a robot on a floor, by interacting multiple models (imm.hpp) over body motion
// (body_motion.hpp).
//
//   models    standing, steady (an arc at constant speed), adjusting, manoeuvring, and sideways (slipping,
//             pushed, carried); see motion_config.cpp
//   gate      an observation further than `gate` (squared Mahalanobis) from every model is refused; after
//             `reacquire_observations` refused ones that agree among themselves they are believed and the
//             track begins again there
//   gap       the last frames before a gap may be of a robot that was half covered already. Once it lasts,
//             the last `entry_s` before it are judged again, with noise that grows up to `entry_bias_m` as
//             the gap comes near and does not average away, and the track is carried on from that. When the
//             robot is seen again, the branch that foresaw it better goes on.
//   late      every frame and odometry reading is an event; an event that comes late is put where it belongs
//             and what followed is run again from the snapshot before it. The result is that of delivery in
//             order, to the bit.
//   claims    a detector that claims to be better than its observations agree with each other is believed
//   less
//             (NoiseJudge)
//   bias      a detector's slow error is not averaged away: it is a random walk of what is observed, and its
//             variance is added to what is published.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "tracker/filter/camera_offsets.hpp"
#include "tracker/filter/filter.hpp"
#include "tracker/filter/measurements.hpp"
#include "tracker/filter/motion_config.hpp"

namespace skylight {

namespace motion {
/// A gap is one from here on; a single frame that is missing at 30 Hz is none.
inline constexpr double kGapAfter = 0.09;  // s
}  // namespace motion

/// States: `searching` (never seen), `calibrating` (the first observations), `tracking` (this frame's
/// observation was accepted), `predicting` (none, or refused), `lost` (until seen again). Estimates exist
/// while tracking and predicting.
///
/// Calibration (Observation::correlated) is the same in every frame: it is added to all that is published and
/// never filtered away. Of several cameras each has its own: see camera_offsets.hpp.
///
/// Input that is not finite, or a covariance that is not positive definite,
/// counts as no observation.
class MotionFilter final : public Filter {
 public:
  /// Throws std::invalid_argument with check()'s message.
  explicit MotionFilter(const MotionFilterConfig& config = {});

  /// Frames may come late, up to smoothing_lag_s behind the newest (older ones are ignored); the step that is
  /// returned tells of the newest instant, but `accepted` of this observation. A second frame of the same
  /// instant (another camera) counts beside the first.
  FilterStep update(Time captured, const std::optional<Observation>& observation) override;
  /// True where it was taken in: not outside the lag, finite, and not gated out as slip.
  bool odometry(const BodyVelocity& velocity) override;
  std::optional<Estimate> predict(Time at) const override;
  Duration smoothing_lag() const override { return from_seconds(config_.smoothing_lag_s); }
  std::optional<Estimate> smoothed(Time at) const override;
  std::vector<Estimate> smoothed_from(Time from) const override;
  std::vector<CameraOpinion> opinions() const override;
  void forget_camera(std::size_t camera) override;
  void reset() override;
  /// An independent copy; cheap: what happened is shared.
  std::unique_ptr<Filter> clone() const override { return std::make_unique<MotionFilter>(*this); }

  const MotionFilterConfig& config() const { return config_; }
  /// Of the models, in the order of motion::Model; none while there is no track.
  std::optional<std::array<double, motion::kModels>> model_probabilities() const;

 private:
  enum class Phase : std::uint8_t { searching, calibrating, running, lost };

  struct Event {
    Time at{};
    std::optional<Observation> observation;
    std::optional<BodyVelocity> velocity;  ///< odometry; else it is a frame
  };

  /// Refused observations that agree among themselves.
  struct Candidate {
    int count = 0;
    Observation last;
  };

  /// All that is known after an event: a function of the events up to it.
  struct Track {
    Phase phase = Phase::searching;
    motion::Mixture main;
    std::shared_ptr<const motion::Mixture> gap;  ///< the other branch, while a gap lasts
    Time last_accepted{};
    std::optional<Time> last_odometry;
    int accepted_count = 0;
    int turns = 1;           ///< the heading is known modulo 2 pi / turns
    bool accepted = false;   ///< this event's observation or reading
    bool restarted = false;  ///< the track begins at this event
    bool took_gap = false;   ///< `main` goes on from the gap's branch
    double turned = 0.0;     ///< rad by which this event corrected the heading
    Candidate candidate;
    motion::NoiseJudge noise;
    motion::NoiseScale scale;  ///< by which the detector's claims are multiplied here

    motion::CameraOffsets cameras;
    /// Of this event's camera, as its observation was used.
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    Covariance3 spread = Covariance3::Zero();
  };

  struct Record {
    Event event;
    Track after;
  };
  using Records = std::vector<std::shared_ptr<const Record>>;

  /// Puts an event where it belongs and runs from there; its place, or none where it is too old.
  std::optional<std::size_t> take(Event event);
  Time smoothed_since() const;
  void forget_old();
  Track run(const Event& event, std::size_t before) const;
  const motion::ModelBank& bank_for(Time last_accepted, Time to) const;
  void carry(Track& track, Time from, Time to) const;
  void see(Track& track, const Observation& observation) const;
  void see_tracked(Track& track, const Observation& observation) const;
  void turn_to(Track& track, double ahead, double period) const;
  void refuse(Track& track, const Observation& observation) const;
  void miss(Track& track, Time at, std::size_t before) const;
  void take_velocity(Track& track, const BodyVelocity& velocity) const;
  void begin(Track& track, const Observation& observation) const;
  std::shared_ptr<const motion::Mixture> judged_again(Time last_accepted, Time at, std::size_t before) const;

  struct Stretch {
    std::size_t first = 0;
    std::size_t last = 0;
  };
  std::optional<Stretch> stretch(Time at) const;
  template <typename Each>
  void look_back(const Stretch& events, Time at, const Each& each) const;
  static motion::LinearMeasurement pose_as_used(const Record& record);
  motion::LinearMeasurement measurement(std::size_t i) const;
  FilterStep step(bool accepted) const;
  Estimate publish(Time at, const motion::Gaussian6& state, const Track& track) const;

  MotionFilterConfig config_;
  motion::ModelBank bank_;
  motion::ModelBank ahead_;
  Records records_;  ///< in order of time
};

}  // namespace skylight
