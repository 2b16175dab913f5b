// A robot's own geometry between the tracker, which observes it, and calibration/robot, which finds it out.
#pragma once

#include <string>
#include <vector>

#include "service/calibration/robot.hpp"
#include "service/wire.hpp"
#include "tracker/tracker.hpp"

namespace skylight::service {

/// Where the tracker takes the robot's picture to be (of one without a picture, its tag).
calibration::RobotGeometry configured_geometry(const RobotSpec& spec);
/// Whether what was observed with one holds for the other.
bool same_geometry(const RobotSpec& a, const RobotSpec& b);

/// The robot with what the fit determines; the rest stays.
RobotSpec with_geometry(RobotSpec spec, const calibration::RobotFit& fit);

/// Adds what was observed of the robot, unless that says nothing of its picture (or tag).
class GeometryRun {
 public:
  GeometryRun(const RobotSpec& spec, std::vector<CameraModel> cameras,
              std::vector<CameraUncertainty> uncertainty, const calibration::RobotKnowledge& known);

  void add(const Observation& observation);
  void add(const BodyVelocity& odometry) { run_.odometry.push_back(odometry); }

  const calibration::RobotRun& run() const { return run_; }
  /// calibration::fit_robot(), with what was not added.
  calibration::RobotFit fit() const;

 private:
  bool by_tag_;
  calibration::RobotRun run_;
  std::size_t other_ = 0;     ///< looks at its tag, of a robot with a picture
  std::size_t unturned_ = 0;  ///< looks at a symmetric picture whose way up is not known yet
};

/// What to make of a figure: `agrees` within three standard deviations, `change` beyond, `open` without a
/// value.
std::string_view verdict(const calibration::GeometryFigure& figure);

/// One figure as people read it, with its key in the configuration.
struct NamedFigure {
  std::string name;  ///< in JSON
  std::string key;   ///< robots[]....; empty where there is none
  std::string unit;
  const calibration::GeometryFigure* figure = nullptr;
};
std::vector<NamedFigure> figures_of(const RobotSpec& spec, const calibration::RobotFit& fit);

/// What a height that is wrong by what was found costs, and where.
struct HeightCost {
  double error_m = 0.0;      ///< measured less configured; 0 without a measured height
  double per_metre_m = 0.0;  ///< by which the robot is off, for each metre from the point under the camera
  double edge_m = 0.0;       ///< from that point to the furthest middle of the picture's sides
  double at_edge_m = 0.0;
};
HeightCost height_cost(const calibration::RobotFit& fit, const CameraModel& camera);

/// Everything of it, as `--json` and the API tell it. `cameras`: their ids, in the run's order.
Json to_json(const RobotSpec& spec, const calibration::RobotFit& fit, const calibration::RobotRun& run,
             const std::vector<std::string>& cameras);

}  // namespace skylight::service
