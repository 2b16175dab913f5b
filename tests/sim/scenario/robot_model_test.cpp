// The robots' measures against their data sheets, and what the rest of the simulator takes for granted.
#include "sim/scenario/robot_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace skylight::sim {
namespace {

constexpr std::array kModels{RobotModelName::waffle_pi, RobotModelName::burger, RobotModelName::differential,
                             RobotModelName::holonomic};

/// Length, width and height above the floor of all solids together.
Eigen::Vector3d extent(const RobotModel& model) {
  Eigen::Vector3d min = model.solids.front().min;
  Eigen::Vector3d max = model.solids.front().max;
  for (const Solid& solid : model.solids) {
    min = min.cwiseMin(solid.min);
    max = max.cwiseMax(solid.max);
  }
  return {max.x() - min.x(), max.y() - min.y(), max.z()};
}

void expect_size(RobotModelName name, const Eigen::Vector3d& expected, double tolerance) {
  const Eigen::Vector3d size = extent(robot_model(name));
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(size[i], expected[i], tolerance) << static_cast<int>(name) << " axis " << i;
}

TEST(RobotModels, AreAsLargeAsTheirDataSheetsSay) {
  expect_size(RobotModelName::waffle_pi, {0.281, 0.306, 0.141}, 0.001);  // TurtleBot3 e-manual
  expect_size(RobotModelName::burger, {0.138, 0.178, 0.192},
              0.0015);  // its lidar stands over by a millimetre
  expect_size(RobotModelName::differential, {0.30, 0.30, 0.12}, 1e-9);
  expect_size(RobotModelName::holonomic, {0.18, 0.18, 0.15}, 1e-9);
}

TEST(RobotModels, DriveAsTheirDataSheetsSay) {
  EXPECT_EQ(robot_model(RobotModelName::waffle_pi).max_speed_mps, 0.26);
  EXPECT_EQ(robot_model(RobotModelName::waffle_pi).max_yaw_rate_radps, 1.82);
  EXPECT_EQ(robot_model(RobotModelName::burger).max_speed_mps, 0.22);
  EXPECT_EQ(robot_model(RobotModelName::burger).max_yaw_rate_radps, 2.84);
  EXPECT_EQ(robot_model(RobotModelName::burger).wheel_separation_m, 0.160);
  for (const RobotModelName name : kModels) {
    const RobotModel& model = robot_model(name);
    EXPECT_EQ(model.holonomic, model.max_side_speed_mps > 0.0);
    EXPECT_GT(model.wheel_radius_m, 0.0);
    EXPECT_GT(model.wheel_separation_m, 0.0);
    EXPECT_GT(model.mass_kg, 0.0);
    EXPECT_GT(model.yaw_inertia_kgm2, 0.0);
    EXPECT_GT(model.max_acceleration_mps2, 0.0);
    EXPECT_GT(model.max_yaw_acceleration_radps2, 0.0);
  }
}

TEST(RobotModels, CarryOneSquarePlateAtItsHeightWithinTheirOutline) {
  for (const RobotModelName name : kModels) {
    const RobotModel& model = robot_model(name);
    const auto carries = [](const Solid& solid) { return solid.carries_picture; };
    ASSERT_EQ(std::count_if(model.solids.begin(), model.solids.end(), carries), 1);
    const Solid& plate = *std::find_if(model.solids.begin(), model.solids.end(), carries);
    EXPECT_NEAR((plate.min.head<2>() - model.plate.min).norm(), 0.0, 1e-12);
    EXPECT_NEAR((plate.max.head<2>() - model.plate.max).norm(), 0.0, 1e-12);
    EXPECT_EQ(plate.max.z(), model.plate_height_m);
    const Eigen::Vector2d size = model.plate.max - model.plate.min;
    EXPECT_NEAR(size.x(), size.y(), 1e-12);
    if (model.round_radius_m > 0.0) {
      EXPECT_LE(model.plate.max.norm(), model.round_radius_m);
    }
  }
}

/// The renderer stops at the first solid that a ray must have passed.
TEST(RobotModels, ListTheirSolidsHighestTopFirst) {
  for (const RobotModelName name : kModels) {
    const auto& solids = robot_model(name).solids;
    for (std::size_t i = 1; i < solids.size(); ++i) EXPECT_LE(solids[i].max.z(), solids[i - 1].max.z());
  }
}

TEST(RobotModels, FillARoundOutlineWithRectanglesWhoseCornersLieOnTheCircle) {
  for (const RobotModelName name : {RobotModelName::differential, RobotModelName::holonomic}) {
    const RobotModel& model = robot_model(name);
    EXPECT_GE(model.footprint.size(), 3U);
    for (const Rectangle& part : model.footprint) {
      EXPECT_NEAR(part.max.norm(), model.round_radius_m, 1e-12);
      EXPECT_NEAR((part.min + part.max).norm(), 0.0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace skylight::sim
