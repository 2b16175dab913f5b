// The built-in simulator as a frame source. Its .cpp is the one file of the service that touches sim.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "service/sources/source.hpp"
#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"

namespace skylight::service {

struct SimulatedCamera {
  std::string id;
  CameraModel model;  ///< the true calibration
  double frame_rate_hz = 0.0;
  double exposure_s = 0.0;
};

struct SimulatedRobot {
  std::string id;
  std::shared_ptr<const Appearance> appearance;  ///< its artwork, as its owner would register it
};

/// Where a robot truly was when a frame was exposed.
struct Truth {
  std::string id;
  Pose2 pose;
  Velocity2 velocity;
  bool in_view = false;
};

/// A scenario's file: `name_or_path` as a path if it ends in .json, else `<name>.json` in the scenarios that
/// come with Skylight. Throws SourceError where there is none.
std::filesystem::path find_scenario(const std::string& name_or_path);

class SimulatorFrames final : public FrameSource {
 public:
  /// Throws SourceError or settings::Error (both std::runtime_error) with what is wrong in the scenario.
  SimulatorFrames(const std::string& name_or_path, std::optional<std::uint64_t> seed);
  ~SimulatorFrames() override;

  const std::string& name() const;
  std::uint64_t seed() const;
  double duration_s() const;  ///< 0: endless
  const std::vector<SimulatedCamera>& cameras() const;
  const std::vector<SimulatedRobot>& robots() const;

  std::optional<Frame> next() override;
  /// Of the frame that next() gave last, in the order of robots().
  const std::vector<Truth>& truth() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::service
