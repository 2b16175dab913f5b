// The simulator: a scenario run step by step, giving what its cameras see and, with each frame, the truth.
//
//   sim::Simulation simulation(sim::load_scenario("sim/scenarios/straight.json"));
//   while (auto shot = simulation.next()) use(shot->frame, shot->truth);
//
// It runs as fast as it is asked to; whoever wants real time waits between the calls.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>

#include "sim/scenario/event.hpp"
#include "sim/scenario/scenario.hpp"
#include "sim/world/director.hpp"
#include "sim/world/odometry.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Where a robot truly was when this camera saw it: base_link on the floor.
struct RobotTruth {
  std::string id;
  Time at{};   ///< the exposure's midpoint; under a rolling shutter that of the row that sees it
  Pose2 pose;  ///< meaningless while it is not present
  Velocity2 velocity;
  bool present = true;   ///< stands on the floor; false while it is carried away
  bool in_view = false;  ///< present, and the middle of its top plate lies in the camera's picture
  double visible = 0.0;  ///< share of its top plate that this camera sees, 0 to 1
  std::vector<std::string> touches;  ///< what it touches: ids of robots, things, people; "wall"
};

struct Shot {
  Frame frame;       ///< frame.camera: index into the scenario's cameras; captured by the camera's own clock
  Time delivered{};  ///< when the program gets it, true time
  std::vector<RobotTruth> truth;  ///< in the order of Simulation::robots()
};

/// The artwork on a robot as its owner has it: a file at its print resolution, not what any camera sees.
/// Seen from above, image up is the robot's forward (+x of base_link), image left its left (+y): the pixel
/// with centre (c, r) of a w x h image lies at x = ((h - 1) / 2 - r) * metres_per_pixel - reference_point_m.x
/// and y = ((w - 1) / 2 - c) * metres_per_pixel - reference_point_m.y of the robot frame.
struct RobotPicture {
  cv::Mat image;  ///< CV_8UC4 (BGRA); alpha 0: not part of the picture (the lidar stands there)
  double metres_per_pixel = 0.001;
  double surface_height_m = 0.0;                ///< of the picture above the floor
  Eigen::Vector2d reference_point_m{0.0, 0.0};  ///< base_link seen from the image's centre, robot axes
};

class Simulation {
 public:
  /// Throws std::invalid_argument where the scenario is none (see validate()) or a picture cannot be read.
  explicit Simulation(const Scenario& scenario);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  const Scenario& scenario() const;
  /// Its robots with their copies, in the order of everything that is said by index.
  const std::vector<RobotSpec>& robots() const;

  /// The artwork of a robot. Throws std::out_of_range.
  RobotPicture picture(std::size_t robot) const;

  /// Runs the world to the next exposure of any camera, in the order of their midpoints, and draws it (frames
  /// that are lost on the way, or not taken, are passed over). None once an exposure would end after the
  /// scenario's duration.
  std::optional<Shot> next();

  /// True time up to which the world has run.
  Time now() const;

  /// Where a camera truly hangs as of the frame that next() gave last, bumps included; columns of the
  /// rotation: image right, image down, away. Throws std::out_of_range.
  Eigen::Isometry3d map_from_camera(std::size_t camera) const;

  /// Does something to the room at the world's next step, as an event would. Throws std::invalid_argument
  /// with key path and reason where the scenario has no such robot, camera or thing.
  void act(const Action& action);

  /// What came since the last call.
  std::vector<OdometryReport> take_odometry();
  std::vector<Happening> take_happenings();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::sim
