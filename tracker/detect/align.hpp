// From a rough pose to a pose at a fraction of a pixel, by aligning the picture itself.
//
// Inverse compositional Gauss-Newton (Baker and Matthews 2004, section 3.2) over x, y and yaw on the
// robot's plane, with gain and bias per channel (the light), and robust weights (what covers the robot
// must not drag it). The eight unknowns of a homography shrink to three: the floor is known.
#pragma once

#include <optional>
#include <vector>

#include "tracker/camera.hpp"
#include "tracker/detect/patch.hpp"

namespace skylight {

/// Where a robot's picture lies: base_link on the floor, and the height of the picture above it.
struct Placement {
  Pose2 pose;
  double surface_height_m = 0.0;
};

struct AlignResult {
  Pose2 pose{};  ///< of base_link
  Covariance3 covariance =
      Covariance3::Identity();  ///< from the residuals, their correlation by the smoothing taken into account
  /// agreeing * correlation, 0 to 1: 1 is the picture itself; noise, blur and shadows cost some hundredths,
  /// a covered part costs its share, another picture stays below one half.
  double score = 0.0;
  double agreeing = 0.0;        ///< share of the picture that agrees with the frame
  double correlation = 0.0;     ///< of what agrees, all channels
  double residual_sigma = 0.0;  ///< of what agrees, grey levels of the frame
  int iterations = 0;
};

struct AlignConfig {
  int max_iterations = 25;      ///< per level, 1 to 200
  double converged_px = 0.003;  ///< a step below this ends the iteration, > 0
  double blur_px = 0.7;         ///< of the fine level: noise against detail, 0 to 5
  double coarse_blur_px = 2.5;  ///< of the coarse level, which reaches further
};

/// How the prior and the frame are taken.
enum class AlignMode : std::uint8_t {
  fine,     ///< the prior is good to a pixel or so; what covers the robot is left out
  smeared,  ///< the same where a quick turn smears the picture; what covers the robot drags it more
  coarse,   ///< as smeared, and reaches about three times as far (some 4 px): the coarse level goes first
};

/// Aligns one appearance; keeps the patches that it prepared, one per scale met. Not thread-safe.
class Aligner {
 public:
  explicit Aligner(std::shared_ptr<const Appearance> appearance, const AlignConfig& config = {});

  const Appearance& appearance() const { return *appearance_; }

  /// Aligns from `prior`. None where the picture leaves the frame or the evidence gives no estimate (flat,
  /// turned to nothing, walked away by more than the picture's own radius). Whether a result is good enough
  /// is the caller's: see score.
  std::optional<AlignResult> align(const Frame& frame, const CameraModel& camera, const Placement& prior,
                                   AlignMode mode);

 private:
  const Patch& patch_for(const PatchScale& scale);

  std::shared_ptr<const Appearance> appearance_;
  AlignConfig config_;
  std::vector<Patch> patches_;
};

}  // namespace skylight
