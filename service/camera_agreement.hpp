// Whether cameras agree about where the robots are: what their calibrations allow, watched over time.
#pragma once

#include <optional>
#include <vector>

#include "tracker/tracker.hpp"

namespace skylight::service {

/// How one camera stands to the others that see the same robots.
struct CameraAgreement {
  double off_m = 0.0;    ///< of the robot for which it is furthest off, by what its calibration allows
  double sigmas = 0.0;   ///< that over what the calibrations allow
  int robots = 0;        ///< that it and another camera see
  bool refused = false;  ///< its observations of that robot are not believed
};

/// A camera that begins to disagree, or agrees again.
struct AgreementChange {
  std::size_t camera = 0;
  bool disagrees = false;
  CameraAgreement state;
};

/// A camera disagrees when some robot has been more than kSigmas off for kLasts, in every frame that tells;
/// it agrees again when no robot has been more than kCalm off for that long. Where nothing tells for longer
/// than kLasts, what was counted so far is forgotten. Of two cameras that contradict each other both do: only
/// a third one, or that one of them is not believed, tells which is wrong.
class CameraAgreements {
 public:
  static constexpr double kSigmas = 3.0;
  static constexpr double kCalm = 2.5;
  static constexpr Duration kLasts = std::chrono::seconds(1);

  explicit CameraAgreements(std::size_t cameras) : cameras_(cameras) {}

  /// After each frame. Returns what changed.
  std::vector<AgreementChange> see(Time captured, const std::vector<RobotView>& robots);

  /// None where no other camera sees a robot that this one sees.
  const std::optional<CameraAgreement>& of(std::size_t camera) const { return cameras_[camera].now; }
  bool disagrees(std::size_t camera) const { return cameras_[camera].disagrees; }

 private:
  struct Camera {
    std::optional<CameraAgreement> now;
    bool disagrees = false;
    Time told{};                ///< the newest frame in which there was a `now`
    std::optional<Time> since;  ///< that it is otherwise than `disagrees` says
  };

  std::vector<Camera> cameras_;
};

}  // namespace skylight::service
