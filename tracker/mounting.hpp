// Where a robot's picture is mounted, when that is known better than from the picture's reference point.
//
// Detectors find base_link where the appearance has it (`Picture::reference_point_m`, forward up the
// picture). Robots that share an appearance are not built alike to the millimetre: each may have its own
// place and way up.
#pragma once

#include "tracker/appearance.hpp"

namespace skylight {

class Mounting {
 public:
  /// As the appearance has it.
  Mounting() = default;
  /// `picture`: its middle in base_link, and its way up from the robot's forward direction,
  /// counter-clockwise.
  Mounting(const Appearance& appearance, const Pose2& picture);

  /// The appearance's base_link where the robot's stands at `base`, both in `map`.
  Pose2 appearance_at(const Pose2& base) const;
  /// The robot's base_link where the appearance's stands at `appearance`.
  Pose2 base_at(const Pose2& appearance) const;
  /// An observation of the appearance's base_link as one of the robot's.
  Observation of_base(Observation observation) const;

 private:
  Pose2 appearance_from_base_{};
};

}  // namespace skylight
