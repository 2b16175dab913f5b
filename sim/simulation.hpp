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
#include <opencv2/core/mat.hpp>

#include "sim/scenario/scenario.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Where a robot truly was at the exposure's midpoint: base_link on the floor.
struct RobotTruth {
  std::string id;
  Pose2 pose;
  Velocity2 velocity;
  bool in_view = false;  ///< the middle of its top plate lies in the camera's picture
};

struct Shot {
  Frame frame;                    ///< frame.camera: index into the scenario's cameras
  std::vector<RobotTruth> truth;  ///< in the order of the scenario's robots
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

  /// The artwork of the robot with this index in the scenario. Throws std::out_of_range.
  RobotPicture picture(std::size_t robot) const;

  /// Runs the world to the next exposure of any camera, in the order of their midpoints, and draws it. None
  /// once an exposure would end after the scenario's duration.
  std::optional<Shot> next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::sim
