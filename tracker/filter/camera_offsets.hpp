// What lies between the cameras that see one robot.
//
// Each is wrong by its calibration: by b_c ~ N(0, C_c) (Observation::correlated), the same in every frame
// near one place, so no filter averages it away, and two cameras shake a pose that takes turns between them.
// Here each camera's offset from the track's own place is followed,
//
//   z_c = p + o_c + noise,   o_c ~ N(what is published, C_published + C_c) when it begins to see the robot,
//
// by a Kalman filter of its own beside the track's (their cross-covariance is left out; one camera, the
// reference, ties p down: its offset is held). The offsets walk as the robot moves, for a calibration's error
// is another one some metres on. Published is the mean of what the cameras say, weighted by their inverse
// covariances (Gauss-Markov: the best linear unbiased one),
//
//   p + s,  s = sum W_c o_c,  W_c = (sum C_k^-1)^-1 C_c^-1,  with covariance sum W_c (C_c + spread_c) W_c^T,
//
// where the weights glide (time constant kGlide): a camera that begins or ceases to see the robot moves the
// pose by what is between them, but never at once. The covariance is that of the weights as they are.
#pragma once

#include <array>
#include <span>

#include "tracker/filter/filter.hpp"
#include "tracker/filter/imm.hpp"

namespace skylight::motion {

/// One camera's part.
struct CameraPart {
  std::size_t camera = 0;
  Time seen{};                                       ///< its last accepted observation; none yet: 1970
  Time heard{};                                      ///< its last observation
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< x, y, yaw against the track's own place
  Covariance3 spread = Covariance3::Zero();          ///< of the offset; zero: the reference's
  Covariance3 correlated = Covariance3::Zero();      ///< what its calibration leaves unknown there
  Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();  ///< in what is published; they sum to 1
  int refused = 0;                                   ///< observations in a row
  Eigen::Vector3d said = Eigen::Vector3d::Zero();    ///< the last refused one against the track's place
};

class CameraOffsets {
 public:
  static constexpr std::size_t kMost =
      6;  ///< cameras at once: another takes the place of the one unseen longest
  static constexpr double kAlone = 0.25;  ///< s without a camera's observation until it counts as gone
  static constexpr double kGlide = 0.3;   ///< s
  static constexpr double kForget = 3.0;  ///< s until what was known of one that is gone is forgotten
  static constexpr double kReach = 2.0;   ///< m over which a calibration's error becomes another one

  /// The track begins with this observation.
  void begin(const Observation& observation);
  /// Weights glide over a time.
  void carry(Time from, Time to);
  /// Its camera has its part from now on, with what it says of its calibration, the robot being at `place`.
  CameraPart& meet(const Observation& observation, const Eigen::Vector2d& place);
  /// A measurement of the track's own place.
  static LinearMeasurement corrected(const CameraPart& part, LinearMeasurement measured);
  /// What was measured (as it came, noise scaled) was accepted; `predicted`: the track's own place before.
  void accepted(CameraPart& part, const LinearMeasurement& measured, const Gaussian6& predicted, Time at);
  static void refused(CameraPart& part, const LinearMeasurement& measured, const Gaussian6& predicted);

  /// Of the published place from the track's own: x, y, yaw.
  Eigen::Vector3d shift() const;
  /// What the calibrations leave unknown of the published place.
  Covariance3 correlated() const;
  /// Cameras that make up the published place, more than a hundredth of it.
  CameraSet contributing() const;
  bool is_reference(std::size_t camera) const { return camera == parts_[reference_].camera; }
  /// What it says from now on is of a camera that was not known so far; what it said stays, of nobody.
  void forget_camera(std::size_t camera);
  /// Where each camera that is still seeing sees the robot, against what all others that do say together.
  std::vector<CameraOpinion> opinions(Time now) const;
  std::span<const CameraPart> parts() const { return {parts_.data(), count_}; }

 private:
  void take_over(CameraPart& part);
  CameraPart& part_of(std::size_t camera);
  void choose_reference(Time now);
  void forget(Time now);
  bool present(const CameraPart& part, Time now) const;

  std::array<CameraPart, kMost> parts_;
  std::size_t count_ = 0;
  std::size_t reference_ = 0;
  Eigen::Vector2d place_ = Eigen::Vector2d::Zero();  ///< up to which the offsets have walked
};

}  // namespace skylight::motion
