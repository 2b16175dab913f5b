#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {
namespace {

// Measures from turtlebot3_description/urdf/turtlebot3_waffle_pi.urdf.xacro, whose base_link lies 0.010 m
// above the floor: body box 0.266 x 0.266 x 0.094 at (-0.064, 0, 0.047); wheels of radius 0.033 and width
// 0.018 at y =
// -+0.144; lidar cylinder of radius 0.055 and length 0.0315 at (-0.064 + 0.015, 0, 0.121 - 0.0065); camera
// box 0.015 x 0.030 x 0.027 at (0.078, 0, 0.097). Mass, speeds and wheel separation (0.287 m) from the
// e-manual.
constexpr double kBodyCentreX = -0.064;
constexpr double kBodyHalf = 0.133;
constexpr double kPlateTop = 0.104;
constexpr double kLidarX = -0.049;
constexpr double kLidarRadius = 0.055;

Solid box(const Eigen::Vector3d& min, const Eigen::Vector3d& max, const Color& top, const Color& side) {
  return {SolidKind::box, min, max, top, side, false};
}

std::vector<Solid> waffle_pi_solids() {
  const Color black{30, 30, 32};
  const Color grey{58, 58, 62};
  const double back = kBodyCentreX - kBodyHalf;
  const double front = kBodyCentreX + kBodyHalf;
  const Solid lidar_cap{SolidKind::cylinder,
                        {kLidarX - 0.035, -0.035, 0.128},
                        {kLidarX + 0.035, 0.035, 0.1405},
                        {70, 70, 76},
                        {26, 26, 28},
                        false};
  const Solid lidar_base{SolidKind::cylinder,
                         {kLidarX - kLidarRadius, -kLidarRadius, kPlateTop},
                         {kLidarX + kLidarRadius, kLidarRadius, 0.128},
                         {40, 40, 43},
                         {28, 28, 30},
                         false};
  Solid plate = box({back, -kBodyHalf, kPlateTop - 0.006}, {front, kBodyHalf, kPlateTop}, black, grey);
  plate.carries_picture = true;
  // The decks below the plate, a little smaller, so that the plate throws an edge.
  const Solid decks = box({back + 0.012, -kBodyHalf + 0.012, 0.012},
                          {front - 0.012, kBodyHalf - 0.012, 0.098}, black, {44, 44, 47});
  const Solid camera = box({0.0685, -0.015, 0.0935}, {0.084, 0.015, 0.1205}, {24, 24, 26}, {34, 34, 36});
  const auto wheel = [](double y) {
    return Solid{SolidKind::wheel,
                 {-0.033, y - 0.009, 0.0},
                 {0.033, y + 0.009, 0.066},
                 {34, 34, 36},
                 {52, 52, 56},
                 false};
  };
  return {lidar_cap, lidar_base, camera, plate, decks, wheel(0.144), wheel(-0.144)};
}

RobotModel waffle_pi() {
  RobotModel model;
  model.solids = waffle_pi_solids();
  const double back = kBodyCentreX - kBodyHalf;
  const double front = kBodyCentreX + kBodyHalf;
  model.footprint = {
      {{back, -kBodyHalf}, {front, kBodyHalf}},  // together 0.281 x 0.306 m, as in the e-manual
      {{-0.033, -0.153}, {0.033, 0.153}},
      {{front, -0.015}, {0.084, 0.015}}};
  model.plate = model.footprint.front();
  model.plate_height_m = kPlateTop;
  model.lidar_m = {kLidarX, 0.0};
  model.lidar_radius_m = kLidarRadius;
  model.mass_kg = 1.8;
  model.yaw_inertia_kgm2 = 1.8 * (0.281 * 0.281 + 0.306 * 0.306) / 12.0;  // a uniform plate of that outline
  model.centre_of_mass_x_m = -0.02;
  model.wheel_separation_m = 0.287;
  model.wheel_load = 0.85;
  model.max_speed_mps = 0.26;
  model.max_yaw_rate_radps = 1.82;
  // turtlebot3_navigation, dwa_local_planner_params_waffle_pi.yaml: acc_lim_x and acc_lim_theta.
  model.max_acceleration_mps2 = 2.5;
  model.max_yaw_acceleration_radps2 = 3.2;
  model.rolling_friction = 0.8;  // rubber on dry, hard floor
  model.lateral_friction = 0.7;
  return model;
}

}  // namespace

const RobotModel& robot_model(RobotModelName name) {
  static const RobotModel waffle = waffle_pi();
  switch (name) {
    case RobotModelName::waffle_pi:
    case RobotModelName::burger:
    case RobotModelName::differential:
    case RobotModelName::holonomic:
      break;
  }
  return waffle;
}

}  // namespace skylight::sim
