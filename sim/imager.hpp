// One camera of a running scenario: when it takes frames, what comes of them, and what befalls it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sim/camera/delivery.hpp"
#include "sim/camera/exposure.hpp"
#include "sim/cast.hpp"
#include "sim/lighting.hpp"
#include "sim/render/render.hpp"
#include "sim/simulation.hpp"
#include "sim/world/stage.hpp"

namespace skylight::sim {

/// Times count from the scenario's start.
class Imager {
 public:
  /// The floor is shared by all cameras.
  Imager(const Scenario& scenario, std::size_t camera, const FloorTexture& floor);

  /// Middle of the next frame's exposure; under a rolling shutter of its middle row's.
  Duration next_middle() const;
  /// Time from there to the end (or beginning) of the exposure of any row.
  Duration reach() const;

  /// Where it truly hangs.
  const Eigen::Isometry3d& map_from_camera() const { return renderer_.camera().map_from_camera(); }

  // What befalls it.
  void bump(const BumpAction& action);
  void freeze(const FreezeAction& action, Duration at);
  void black_out(const BlackoutAction& action, Duration at);

  /// Takes the next frame. The stage must have run to its end. None where the frame is lost or not taken.
  std::optional<Shot> shoot(const Stage& stage, const Lighting& lighting, Cast& cast);

 private:
  void dress(const Stage& stage, Cast& cast, Duration middle);
  void draw(const Stage& stage, const Lighting& lighting, Duration middle, Frame& frame);
  RobotTruth truth_of(const Stage& stage, const Cast& cast, std::size_t robot, Duration middle) const;

  struct Interval {
    Duration from{};
    Duration until{};
    bool holds(Duration time) const { return from <= time && time < until; }
  };

  CameraSpec spec_;
  std::uint64_t seed_ = 0;
  std::size_t index_ = 0;
  Time start_{};  ///< of the scenario
  Renderer renderer_;
  ExposureControl exposure_;
  Delivery delivery_;
  std::uint64_t sequence_ = 0;
  std::optional<Duration> last_drawn_;
  Frame last_;  ///< what a frozen camera repeats
  std::vector<Interval> frozen_;
  std::vector<Interval> black_;
  std::vector<std::shared_ptr<const Look>> looks_;  ///< by actor, as the renderer has them
  std::vector<bool> present_;                       ///< and whether it was there, of those that never move
};

}  // namespace skylight::sim
