// A robot's own geometry from watching it move: how high its picture (or tag) lies, and where that lies in
// base_link.
//
// The ray through a pixel meets the plane at height h instead of h0 at C + (p - C) (C_z - h) / (C_z - h0),
// with C the camera's place and p the point on the plane at h0: similar triangles, whatever the lens. A wrong
// height is a wrong scale about the point under the camera. So
//   - a height shows only against a length that something else knows: a distance measured by tape, a circle's
//     radius, odometry that was itself calibrated, or a second camera that sees the same place;
//   - turning on the spot leaves base_link where it is: the picture's middle goes round it, which tells
//     where it lies along the picture's own axes;
//   - a robot that cannot move sideways tells by driving straight which way it faces against its picture;
//     on a circle that and the reference point's way forward show as one.
// Least squares over all of it. The cameras' own uncertainty is not estimated here but carried through: a
// parameter's error K r_c with K the gain of the fit and r_c what the camera's error does to the residuals.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tracker/camera.hpp"
#include "tracker/camera_uncertainty.hpp"

namespace skylight::calibration {

/// What is found out. `mounting`: the middle of the picture or tag in base_link, and its way up from the
/// robot's forward direction, counter-clockwise.
struct RobotGeometry {
  double surface_height_m = 0.0;
  Pose2 mounting{};
};

/// One look: the middle of the picture or tag in `map`, as it seems at the height that was taken for it.
struct SeenRobot {
  Time captured{};
  std::size_t camera = 0;
  Pose2 pose{};
};
/// The same from what a tracker tells of base_link.
SeenRobot seen_robot(const Observation& observation, const RobotGeometry& assumed);

/// A length that was measured otherwise, and its standard deviation.
struct KnownLength {
  double length_m = 0.0;   ///< 0.1 to 1000
  double sigma_m = 0.001;  ///< 1e-5 to 1
};

struct RobotKnowledge {
  std::optional<KnownLength> distance;  ///< of base_link, between the first and the last place of standing
  std::optional<KnownLength> radius;    ///< of base_link's way, on the longest circle
  /// By which share the odometry's way may be wrong, standard deviation, 1e-5 to 0.5. An uncalibrated wheel:
  /// some thousandths, which is too much to tell a height.
  double odometry_scale_sigma = 0.005;
  bool holonomic = false;  ///< may move sideways: then only odometry tells which way it faces
};

struct RobotRun {
  std::vector<SeenRobot> seen;         ///< in the order of time
  std::vector<BodyVelocity> odometry;  ///< in the order of time, by a clock of up to 2 s off; may be empty
  std::vector<CameraModel> cameras;
  std::vector<CameraUncertainty> uncertainty;  ///< in the order of `cameras`; empty: known exactly
  RobotGeometry assumed;
  RobotKnowledge known;
};

/// One figure of the geometry.
struct GeometryFigure {
  double assumed = 0.0;
  std::optional<double> value;  ///< none where the run does not determine it
  double sigma = 0.0;           ///< standard deviation, also of what is not determined well enough
  std::string missing;  ///< which manoeuvre or measure would determine it; empty where there is a value
  /// |value - assumed| in standard deviations; none without a value.
  std::optional<double> sigmas_off() const;
};

enum class StretchKind : std::uint8_t { stand, spin, drive };
std::string_view to_string(StretchKind kind);

/// A part of the run during which the robot did one thing in one camera's picture.
struct Stretch {
  StretchKind kind = StretchKind::stand;
  std::size_t camera = 0;
  std::size_t first = 0, last = 0;  ///< into RobotRun::seen, both included; other cameras' looks lie between
  double turned_rad = 0.0;          ///< counter-clockwise
  double driven_m = 0.0;
  std::size_t used = 0;     ///< residuals
  std::size_t dropped = 0;  ///< of them, those far off the others
  double rms_m = 0.0;       ///< of those used: the spot's place, or the way sideways between two looks
};

/// Why looks were not used.
struct LeftOut {
  std::string reason;
  std::size_t count = 0;
};

struct RobotFit {
  GeometryFigure surface_height_m;
  GeometryFigure mounting_x_m;
  GeometryFigure mounting_y_m;
  GeometryFigure mounting_yaw;
  /// True way over the odometry's; a value where there is odometry, and a height.
  GeometryFigure odometry_scale;
  std::vector<Stretch> stretches;  ///< in the order of time, one camera after the other
  std::vector<LeftOut> left_out;
  std::vector<std::string> remarks;  ///< what to distrust
  // What the run covered.
  double spun_rad = 0.0;         ///< on the spot, both ways together
  double driven_m = 0.0;         ///< along stretches of driving
  double circled_rad = 0.0;      ///< the most that one stretch of driving turns
  double circle_radius_m = 0.0;  ///< of that stretch, 0 without
  double span_m = 0.0;           ///< between the first and the last place of standing or turning
  std::size_t places = 0;        ///< of standing and turning

  /// The measured geometry, with what was assumed where something is not determined.
  RobotGeometry geometry() const;
};

/// Empty, or what is wrong, naming field, value and range.
std::string check(const RobotKnowledge& known);

/// Throws std::invalid_argument with check()'s message, or for a look of a camera that is not there. A run
/// that tells nothing gives figures without values.
RobotFit fit_robot(const RobotRun& run);

/// How far a height that is wrong by `error_m` puts the robot off, at the way `from_nadir_m` from the point
/// under a camera that hangs `camera_height_m` high; metres.
double shift_by_height(double error_m, double from_nadir_m, double camera_height_m, double surface_height_m);

}  // namespace skylight::calibration
