// The paper's own pipeline in our room: what it sees along its 13 routes, frame by frame.
//
// The room. The scenarios paper/*: 6 x 6 m, a TurtleBot3 Waffle Pi, one RGB-D camera in the ceiling over the
// middle. The paper's camera is Gazebo's RGB-D camera, a Kinect: 60 degrees (1.047 rad) wide at 640 x 480, so
// 46.8 degrees high. It sees the whole floor from 3 m / tan(23.4 degrees) = kCameraHeight, and there ours
// hangs. Its picture is cut to the square of the floor (barrel distortion lets it see a little more). All
// picture effects, noise and exposure (8 ms) keep their defaults. The floor is of one colour, as that of
// Gazebo's empty room, which the paper used.
//
// The resolution is the one thing that the paper does not tell and that decides everything: find_object_2d's
// 500 features are for the whole picture. It accepts 97 % of its positions with the same detector, so the
// default is the smallest resolution at which at least 97 % are found; see resolution_curve().
//
// Each frame is looked at once (features, matches, homography) and carried to the floor in several ways:
//
//   vertical       straight down from the point that the depth gives; taken for base_link. The paper, before.
//   ray            the ray from the camera through the point goes on to the floor; taken for base_scan. The
//                  paper, after its two improvements.
//   vertical_scan  straight down, taken for base_scan: what the first improvement is worth by itself.
//
// An observation always tells where base_link is, so that any filter takes it: where the point is taken for
// base_scan, it is carried there by the detected heading. What the paper judges is the point itself: see
// point_of(), which gives it back.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "service/reproduce/jobs.hpp"
#include "service/reproduce/observed_run.hpp"
#include "service/sources/simulator.hpp"
#include "tracker/detect/homography.hpp"

namespace skylight::service::reproduce {

/// base_scan in base_link, m: scan_joint of turtlebot3_description/urdf/turtlebot3_waffle_pi.urdf.xacro
/// (ROBOTIS-GIT/turtlebot3), origin -0.064 0 0.121. The middle of the simulated Waffle's plate, and so of its
/// picture, lies right below it.
inline constexpr double kBaseScanX = -0.064;

inline constexpr double kCameraHeight = 6.93;  ///< m above the floor
/// Between camera and the robot's picture, m: the plate's height is that of sim/scenario/robot_model.cpp.
inline constexpr double kPictureDepth = kCameraHeight - 0.104;

struct PaperSetup {
  double px_per_metre = 280.0;  ///< on the floor below the camera, 20 to 600
  double frame_rate_hz = 10.0;  ///< the paper's, design section 6
  std::string floor = "plain";  ///< material, as in a scenario
};

struct PaperVariant {
  std::string_view name;
  FloorDrop drop = FloorDrop::vertical;
  double reference_x_m = 0.0;  ///< which point of the robot the detected point is taken for, in base_link
};

/// As listed above: what ObservedRun::variants of a paper_run() names.
const std::vector<PaperVariant>& paper_variants();

/// PaperVariant::reference_x_m of that name; 0 of a variant that is not the paper's.
double reference_of(std::string_view variant);

/// The detected point of an observation, where `reference_x_m` is the variant's: with a true pose where that
/// point truly is.
Eigen::Vector2d point_of(const Pose2& pose, double reference_x_m);

/// line-1 to line-8, circle-1, circle-2, chaotic-1 to chaotic-3.
const std::vector<std::string>& paper_routes();
bool is_linear(const std::string& route);

/// Length of the robot's plate in the picture, px.
double robot_length_px(double px_per_metre);

/// Which runs are made.
struct PaperPlan {
  PaperPlan();  // in the .cpp: seen through, it makes g++ 12 warn of uninitialised strings

  PaperSetup setup;
  std::vector<std::string> routes = paper_routes();
  int seeds = 10;          ///< of each route: 1, 2, ...
  double at_most_s = 0.0;  ///< a run is cut off there; 0: whole routes
};

/// A few routes, one seed, their first 15 s: for a first look.
PaperPlan quick_paper_plan();

/// What the pipeline sees of a scenario's first robot by its first camera. Throws as SimulatorFrames.
ObservedRun paper_run(const ScenarioRun& scenario, const std::string& route);

/// One job for each seed and route: all routes once, then again. Throws SourceError or settings::Error.
std::vector<Job> paper_jobs(const PaperPlan& plan);

struct ResolutionPoint {
  double px_per_metre = 0.0;
  double robot_px = 0.0;
  std::string floor;
  std::size_t frames = 0;
  std::size_t found = 0;
};

/// How the share found depends on the resolution: one seed per route, one frame a second.
struct ResolutionPlan {
  std::vector<double> px_per_metre{75, 150, 210, 240, 260, 270, 280, 300};
  std::vector<std::string> floors{"plain", "speckle"};
  std::vector<std::string> routes{"line-1", "line-7", "circle-1", "chaotic-1"};
  double at_most_s = 0.0;
};
ResolutionPlan quick_resolution_plan();

/// Floor by floor, in the order of the plan. Throws as run_jobs() and paper_jobs().
std::vector<ResolutionPoint> resolution_curve(const ResolutionPlan& plan, const JobOptions& options);

}  // namespace skylight::service::reproduce
