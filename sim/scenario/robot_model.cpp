#include "sim/scenario/robot_model.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace skylight::sim {
namespace {

constexpr Color kBlack{30, 30, 32};
constexpr Color kGrey{58, 58, 62};
constexpr double kPlateThickness = 0.006;

Solid box(const Eigen::Vector3d& min, const Eigen::Vector3d& max, const Color& top, const Color& side) {
  return {SolidKind::box, min, max, top, side, false};
}

Solid cylinder(const Eigen::Vector2d& axis, double radius, const std::array<double, 2>& heights) {
  return {SolidKind::cylinder,
          {axis.x() - radius, axis.y() - radius, heights[0]},
          {axis.x() + radius, axis.y() + radius, heights[1]},
          {40, 40, 43},
          {28, 28, 30},
          false};
}

/// A wheel of the robot's radius that stands on the floor, its axis through base_link.
Solid wheel(double radius, double width, double y) {
  return {SolidKind::wheel,
          {-radius, y - 0.5 * width, 0.0},
          {radius, y + 0.5 * width, 2.0 * radius},
          {34, 34, 36},
          {52, 52, 56},
          false};
}

Solid picture_plate(const Rectangle& outline, double top, double thickness) {
  Solid plate = box({outline.min.x(), outline.min.y(), top - thickness},
                    {outline.max.x(), outline.max.y(), top}, kBlack, kGrey);
  plate.carries_picture = true;
  return plate;
}

/// A LDS-01 on a plate of this height: its base, and the cap that turns on it.
std::vector<Solid> lidar(const RobotModel& model, double top) {
  constexpr double kCapRadius = 0.035;
  const double joint = model.plate_height_m + 0.024;
  Solid cap = cylinder(model.lidar_m, kCapRadius, {joint, top});
  cap.top_rgb = {70, 70, 76};
  cap.side_rgb = {26, 26, 28};
  return {cap, cylinder(model.lidar_m, model.lidar_radius_m, {model.plate_height_m, joint})};
}

double plate_inertia(double mass, double length, double width) {
  return mass * (length * length + width * width) / 12.0;
}

// What both TurtleBot3 share: wheels of radius 0.033 and width 0.018, the lidar (a cylinder of radius 0.055),
// rubber on a dry, hard floor, and acc_lim_x and acc_lim_theta of turtlebot3_navigation,
// dwa_local_planner_params_{waffle_pi,burger}.yaml.
constexpr double kTurtleWheelWidth = 0.018;
RobotModel turtlebot() {
  RobotModel model;
  model.lidar_radius_m = 0.055;
  model.wheel_radius_m = 0.033;
  model.max_acceleration_mps2 = 2.5;
  model.max_yaw_acceleration_radps2 = 3.2;
  model.rolling_friction = 0.8;
  model.lateral_friction = 0.7;
  return model;
}

// Measures from turtlebot3_description/urdf/turtlebot3_waffle_pi.urdf.xacro, whose base_link lies 0.010 m
// above the floor: body box 0.266 x 0.266 x 0.094 at (-0.064, 0, 0.047); wheels at y = -+0.144; lidar of
// length 0.0315 at (-0.064 + 0.015, 0, 0.121 - 0.0065); camera box 0.015 x 0.030 x 0.027 at (0.078, 0,
// 0.097). Mass, speeds and wheel separation (0.287 m) from the e-manual.
RobotModel waffle_pi() {
  constexpr double kHalf = 0.133;
  constexpr double kBack = -0.064 - kHalf;
  constexpr double kFront = -0.064 + kHalf;
  constexpr double kWheelY = 0.144;
  RobotModel model = turtlebot();
  model.footprint = {{{kBack, -kHalf}, {kFront, kHalf}},  // together 0.281 x 0.306 m, as in the e-manual
                     {{-0.033, -0.153}, {0.033, 0.153}},
                     {{kFront, -0.015}, {0.084, 0.015}}};
  model.plate = model.footprint.front();
  model.plate_height_m = 0.104;
  model.lidar_m = {-0.049, 0.0};
  model.solids = lidar(model, 0.1405);
  // The decks below the plate, a little smaller, so that the plate throws an edge.
  const Solid decks = box({kBack + 0.012, -kHalf + 0.012, 0.012}, {kFront - 0.012, kHalf - 0.012, 0.098},
                          kBlack, {44, 44, 47});
  const Solid camera = box({0.0685, -0.015, 0.0935}, {0.084, 0.015, 0.1205}, {24, 24, 26}, {34, 34, 36});
  model.solids.insert(model.solids.end(),
                      {camera, picture_plate(model.plate, model.plate_height_m, kPlateThickness), decks,
                       wheel(model.wheel_radius_m, kTurtleWheelWidth, kWheelY),
                       wheel(model.wheel_radius_m, kTurtleWheelWidth, -kWheelY)});
  model.mass_kg = 1.8;
  model.yaw_inertia_kgm2 = plate_inertia(1.8, 0.281, 0.306);
  model.centre_of_mass_x_m = -0.02;
  model.wheel_separation_m = 0.287;
  model.wheel_load = 0.85;
  model.max_speed_mps = 0.26;
  model.max_yaw_rate_radps = 1.82;
  return model;
}

// Measures from turtlebot3_description/urdf/turtlebot3_burger.urdf.xacro, whose base_link lies 0.010 m above
// the floor: body box 0.140 x 0.140 x 0.143 at (-0.032, 0, 0.070), wheels at y = -+0.080, lidar of length
// 0.0315 at (-0.032 + 0.015, 0, 0.172 - 0.0065), caster at x = -0.081. Outline (0.138 x 0.178 x 0.192 m: the
// plate is taken as 0.138 x 0.138), mass, speeds and wheel separation from the e-manual. The lidar covers
// most of its plate.
RobotModel burger() {
  constexpr double kHalf = 0.069;
  constexpr double kMiddle = -0.032;
  constexpr double kWheelY = 0.080;
  RobotModel model = turtlebot();
  model.footprint = {{{kMiddle - kHalf, -kHalf}, {kMiddle + kHalf, kHalf}},
                     {{-0.033, -0.089}, {0.033, 0.089}}};
  model.plate = model.footprint.front();
  model.plate_height_m = 0.1515;
  model.lidar_m = {-0.017, 0.0};
  model.solids = lidar(model, 0.192);
  const Solid decks = box({kMiddle - kHalf + 0.008, -kHalf + 0.008, 0.0085},
                          {kMiddle + kHalf - 0.008, kHalf - 0.008, 0.1455}, kBlack, {44, 44, 47});
  model.solids.insert(model.solids.end(), {picture_plate(model.plate, model.plate_height_m, kPlateThickness),
                                           decks, wheel(model.wheel_radius_m, kTurtleWheelWidth, kWheelY),
                                           wheel(model.wheel_radius_m, kTurtleWheelWidth, -kWheelY)});
  model.mass_kg = 1.0;
  model.yaw_inertia_kgm2 = plate_inertia(1.0, 0.138, 0.178);
  model.centre_of_mass_x_m = -0.004;  // by the masses of the URDF's links
  model.wheel_separation_m = 0.160;
  model.wheel_load = 0.95;  // the lever that the caster has
  model.max_speed_mps = 0.22;
  model.max_yaw_rate_radps = 2.84;
  return model;
}

/// The outline, footprint and square plate of a round robot: the plate inscribed in its top.
RobotModel round_robot(double radius, double height) {
  RobotModel model;
  model.round_radius_m = radius;
  for (const double angle : {0.125, 0.25, 0.375}) {  // of half a turn: three of the octagon's rectangles
    const Eigen::Vector2d corner(radius * std::cos(angle * std::numbers::pi),
                                 radius * std::sin(angle * std::numbers::pi));
    model.footprint.push_back({-corner, corner});
  }
  const double half = std::floor(1000.0 * radius / std::numbers::sqrt2) / 1000.0;
  model.plate = {{-half, -half}, {half, half}};
  model.plate_height_m = height;
  constexpr double kSheet = 0.003;
  constexpr double kGroundClearance = 0.015;
  Solid body = cylinder({0.0, 0.0}, radius, {kGroundClearance, height - kSheet});
  body.top_rgb = kGrey;
  body.side_rgb = {74, 76, 82};
  model.solids = {picture_plate(model.plate, height, kSheet), body};
  model.rolling_friction = 0.8;
  model.lateral_friction = 0.7;
  return model;
}

// No product: a round robot as they are built for lessons and vacuum cleaning. A uniform disc of 3 kg, two
// driven wheels within its outline, casters before and behind.
RobotModel differential() {
  RobotModel model = round_robot(0.15, 0.12);
  model.wheel_radius_m = 0.035;
  model.wheel_separation_m = 0.24;
  const double y = 0.5 * model.wheel_separation_m;
  model.solids.push_back(wheel(model.wheel_radius_m, 0.02, y));
  model.solids.push_back(wheel(model.wheel_radius_m, 0.02, -y));
  model.mass_kg = 3.0;
  model.yaw_inertia_kgm2 = 0.5 * model.mass_kg * model.round_radius_m * model.round_radius_m;
  model.wheel_load = 0.85;
  model.max_speed_mps = 0.5;
  model.max_yaw_rate_radps = 2.0;
  model.max_acceleration_mps2 = 1.0;
  model.max_yaw_acceleration_radps2 = 6.0;
  return model;
}

// As large as the rules of the RoboCup Small Size League allow (0.18 m wide, 0.15 m high); mass (body 2 kg,
// four wheels of 0.2 kg), wheels of radius 0.0325 and their friction from grSim, config/Parsian.ini. Speeds
// are set lower than a match's, so that a camera at 30 Hz can follow.
RobotModel holonomic() {
  RobotModel model = round_robot(0.09, 0.15);
  model.holonomic = true;
  model.wheel_radius_m = 0.0325;
  model.wheel_separation_m = 0.16;
  model.mass_kg = 2.8;
  model.yaw_inertia_kgm2 = 0.5 * model.mass_kg * model.round_radius_m * model.round_radius_m;
  model.wheel_load = 1.0;
  model.max_speed_mps = 2.0;
  model.max_side_speed_mps = 2.0;
  model.max_yaw_rate_radps = 6.0;
  model.max_acceleration_mps2 = 3.0;
  model.max_yaw_acceleration_radps2 = 30.0;
  model.lateral_friction = 0.8;  // between them the four wheels grip alike in all directions
  return model;
}

}  // namespace

const RobotModel& robot_model(RobotModelName name) {
  static const std::array<RobotModel, 4> models{waffle_pi(), burger(), differential(), holonomic()};
  switch (name) {
    case RobotModelName::burger:
      return models[1];
    case RobotModelName::differential:
      return models[2];
    case RobotModelName::holonomic:
      return models[3];
    case RobotModelName::waffle_pi:
      break;
  }
  return models[0];
}

}  // namespace skylight::sim
