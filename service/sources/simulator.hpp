// The built-in simulator as a frame source. Its .cpp is the one file of the service that touches sim.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/types.hpp>

#include "service/floor_tag.hpp"
#include "service/sources/source.hpp"
#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"
#include "tracker/detect/apriltag.hpp"

namespace skylight::service {

struct SimulatedCamera {
  std::string id;
  CameraModel model;  ///< the true calibration, as it hangs at the start
  double frame_rate_hz = 0.0;
  double exposure_s = 0.0;
};

struct SimulatedRobot {
  std::string id;
  /// Its artwork, as its owner would register it; robots with the same artwork share one, named after the
  /// first of them. Null where nothing on the robot tells it apart: no picture and no tag.
  std::shared_ptr<const Appearance> appearance;
  Pose2 start;                   ///< where the scenario puts it
  std::optional<TagSpec> tag{};  ///< what is stuck on its top; none where another robot's is the same
  bool copy = false;             ///< another robot shares its appearance
};

/// Where a robot truly was when a frame was exposed.
struct Truth {
  std::string id;
  Time at{};  ///< true time of the exposure of what the frame shows of it
  Pose2 pose;
  Velocity2 velocity;
  bool present = true;   ///< stands on the floor; its pose means nothing while it is carried away
  bool in_view = false;  ///< the middle of its top lies in this camera's picture
  double visible = 0.0;  ///< share of its top that this camera sees, 0 to 1
  std::vector<std::string> touches;
  /// Box around the whole robot in this camera's picture, cut at the picture's edge, pixels (outer edges: the
  /// box of the pixels 3 to 5 is [2.5, 5.5]); none where nothing of it lies in the picture.
  std::optional<cv::Rect2d> box_px;
};

/// What a robot's own odometry says.
struct Odometry {
  std::string robot;
  Time at{};   ///< by the robot's own clock
  Pose2 pose;  ///< in the frame in which it started at (0, 0, 0)
  double v_mps = 0.0;
  double side_mps = 0.0;  ///< to the left
  double w_radps = 0.0;
};

/// Something that took place in the room.
struct Happening {
  Time at{};           ///< true time
  std::string name;    ///< of the scenario's event; empty where it has none, or was asked for
  std::string action;  ///< as in a scenario file, a JSON object
};

/// A robot that is told how fast to go.
struct DriveCommand {
  std::string robot;
  double v_mps = 0.0;
  double side_mps = 0.0;
  double w_radps = 0.0;
  double for_s = 0.5;  ///< then its program goes on
};

/// A line of a scenario's `expect`. Figures by the scenario's own words; errors in metres and degrees.
struct Expected {
  std::string figure;
  std::string robot;  ///< empty: each of them, or all together
  PoseKind kind = PoseKind::filtered;
  std::optional<double> at_most;
  std::optional<double> at_least;
};

/// What a list of scenarios tells of one.
struct ScenarioSummary {
  std::string name;
  std::string description;
  std::size_t cameras = 0;
  std::size_t robots = 0;
  double duration_s = 0.0;  ///< 0: endless
};

/// One run of a scenario: values of its sweep and seed chosen.
class ScenarioRun {
 public:
  const std::string& name() const;  ///< with the values that are varied
  std::uint64_t seed() const;
  double duration_s() const;  ///< 0: endless
  const std::vector<Expected>& expected() const;
  /// Everything that decides what is drawn, defaults included: the scenario as JSON, and where it is cut off.
  std::string text() const;
  /// Ends it after so many seconds, > 0, if it would go on longer.
  void cut(double duration_s);

  struct Data;
  explicit ScenarioRun(Data data);
  const Data& data() const { return *data_; }

 private:
  std::shared_ptr<const Data> data_;
};

/// A scenario's file: `name_or_path` as a path if it ends in .json, else `<name>.json` in the scenarios that
/// come with Skylight. Throws SourceError where there is none.
std::filesystem::path find_scenario(const std::string& name_or_path);

/// The scenario as it stands in its file, without its sweep; `changes` are put over it, each
/// `key.path=value` ("cameras[0].frame_rate_hz=10"). Throws SourceError or settings::Error.
ScenarioRun scenario_run(const std::string& name_or_path, std::optional<std::uint64_t> seed,
                         const std::vector<std::string>& changes = {});

/// Every run that the file asks for: one list for each combination of its sweep's values, in it one run for
/// each seed. `seed` and `repeats` instead of the file's where they are given. Throws as above.
std::vector<std::vector<ScenarioRun>> scenario_runs(const std::string& name_or_path,
                                                    std::optional<std::uint64_t> seed,
                                                    std::optional<int> repeats);

/// The scenarios that come with Skylight, by name ("demo", "hard/fog"); files that cannot be read are left
/// out.
std::vector<ScenarioSummary> shipped_scenarios();

/// The JSON Schema of scenario files.
std::string scenario_schema();

class SimulatorFrames final : public FrameSource {
 public:
  /// Throws settings::Error or std::invalid_argument with what is wrong in the scenario.
  explicit SimulatorFrames(const ScenarioRun& run);
  SimulatorFrames(const std::string& name_or_path, std::optional<std::uint64_t> seed)
      : SimulatorFrames(scenario_run(name_or_path, seed)) {}
  ~SimulatorFrames() override;

  const std::string& name() const;
  std::uint64_t seed() const;
  double duration_s() const;       ///< 0: endless
  Eigen::Vector2d room_m() const;  ///< of the floor, along x and y; the origin of `map` is its middle
  const std::vector<SimulatedCamera>& cameras() const;
  const std::vector<SimulatedRobot>& robots() const;
  /// Those that lie on the room's floor.
  std::vector<FloorTag> floor_tags() const;

  std::optional<Frame> next() override;
  Time delivered() const override;
  /// Of the frame that next() gave last, in the order of robots().
  const std::vector<Truth>& truth() const;
  /// Where a camera truly hangs as of that frame: not as in cameras() once it was bumped. Throws
  /// std::out_of_range.
  Eigen::Isometry3d map_from_camera(std::size_t camera) const;

  /// Of the scenario, Unix time, true.
  Time start() const;
  /// Up to which the world has run.
  Time now() const;

  /// Does something at the world's next step: an action as in a scenario's events, JSON, called `name` in
  /// errors. Throws settings::Error or std::invalid_argument, both with the key path and what is allowed.
  void act(std::string_view json, const std::string& name);
  void drive(const DriveCommand& command);

  /// What came since the last call.
  std::vector<Odometry> take_odometry();
  std::vector<Happening> take_happenings();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::service
