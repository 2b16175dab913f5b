// The least squares behind robot.hpp: what a run asks of the geometry, one equation each. For robot.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "service/calibration/robot_run.hpp"

namespace skylight::calibration {

// Parameters of the fit. The places of standing and turning follow, two each.
inline constexpr Eigen::Index kHeight = 0;
inline constexpr Eigen::Index kAlong = 1;  ///< of the mounting, along the picture's own axes
inline constexpr Eigen::Index kAcross = 2;
inline constexpr Eigen::Index kHeading = 3;  ///< the picture's way up from the robot's forward direction
inline constexpr Eigen::Index kScale = 4;    ///< true way over the odometry's
inline constexpr Eigen::Index kRadius = 5;   ///< of the circle that is known
inline constexpr Eigen::Index kShared = 6;

// A picture's error that is the same in every look where it stands or, turning, the same seen from the robot:
// it is not in the residuals. Of its place and of its heading, standard deviations.
inline constexpr double kPlaceError_m = 2e-4;
inline constexpr double kHeadingError_rad = 5e-4;

enum class EquationKind : std::uint8_t {
  spot_x,  ///< while it stands or turns on the spot, base_link is at the stretch's place
  spot_y,
  sideways,  ///< between two looks it goes forward, not sideways (or as its odometry says)
  forward,   ///< between two looks it goes as far as its odometry says, but for the scale
  circle,    ///< base_link is as far from the circle's middle as was measured
  distance,  ///< the first and the last place are as far apart as was measured
  same_x,    ///< two cameras see one and the same place
  same_y,
  prior  ///< what is known of a parameter beforehand
};

struct Equation {
  EquationKind kind = EquationKind::prior;
  std::size_t stretch = 0;    ///< into the stretches
  std::size_t a = 0, b = 0;   ///< looks, into RobotRun::seen
  Eigen::Index p = 0, q = 0;  ///< parameters: a place's first, or the one that is known
  double said = 0.0;          ///< what it should come to: m, rad or 1
  double sigma = 1.0;         ///< standard deviation that weighs it
  double noise = 1.0;         ///< that of what differs from run to run, the cameras' error apart
  bool used = true;
};

/// Whether it is about what cameras saw.
inline bool is_of_looks(const Equation& equation) {
  return equation.kind <= EquationKind::circle;
}

/// What a run asks of the geometry, and what is known beforehand (as equations of the kind `prior`).
std::vector<Equation> equations_of(const RobotRun& run, const std::vector<Stretch>& stretches,
                                   const OdometryPath& odometry);

struct FittedRobot {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  std::vector<Equation> equations;
  Eigen::Vector2d place(Eigen::Index p) const { return x.segment<2>(p); }
};

/// Estimate, and its covariance with the cameras' uncertainty in it.
FittedRobot fit_equations(const RobotRun& run, const std::vector<Stretch>& stretches,
                          const OdometryPath& odometry);

/// What an equation is off by.
double residual(const Equation& equation, const FittedRobot& fit, const RobotRun& run);

/// The parameter at which a stretch's place begins.
inline Eigen::Index place_of(std::size_t stretch) {
  return kShared + 2 * static_cast<Eigen::Index>(stretch);
}

/// The stretch of driving that turns the most; none without.
std::optional<std::size_t> circle_of(const std::vector<Stretch>& stretches);
/// The first and the last place; none where there are less than two.
std::optional<std::array<std::size_t, 2>> ends_of(const RobotRun& run, const std::vector<Stretch>& stretches);

}  // namespace skylight::calibration
