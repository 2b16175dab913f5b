// Outlines on the floor against plane geometry.
#include "sim/world/surroundings.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace skylight::sim {
namespace {

const Outline kSquare{{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}};

TEST(Surroundings, DistanceIsToTheNearestSideOrCornerAndNegativeWithin) {
  EXPECT_NEAR(distance(kSquare, {3.0, 0.5}), 2.0, 1e-12);
  EXPECT_NEAR(distance(kSquare, {4.0, -5.0}), 5.0, 1e-12);  // 3, 4 from the corner
  EXPECT_NEAR(distance(kSquare, {0.2, -0.7}), -0.3, 1e-12);
  EXPECT_NEAR(distance(kSquare, {1.0, 0.0}), 0.0, 1e-12);
}

TEST(Surroundings, DistanceToATurnedOutlineIsThatOfThePlaceTurnedBack) {
  const Pose2 at{0.7, -0.3, 0.6};
  const Eigen::Vector2d place(2.5, 1.1);
  const Eigen::Vector2d back(std::cos(0.6) * (2.5 - 0.7) + std::sin(0.6) * (1.1 + 0.3),
                             -std::sin(0.6) * (2.5 - 0.7) + std::cos(0.6) * (1.1 + 0.3));
  EXPECT_NEAR(distance(placed(kSquare, at), place), distance(kSquare, back), 1e-12);
}

TEST(Surroundings, AHullHasTheCornersThatStickOut) {
  const Outline cross = hull({{{-2.0, -0.5}, {2.0, -0.5}, {2.0, 0.5}, {-2.0, 0.5}},
                              {{-0.5, -2.0}, {0.5, -2.0}, {0.5, 2.0}, {-0.5, 2.0}}});
  EXPECT_EQ(cross.size(), 8U);
  double area = 0.0;
  for (std::size_t i = 0; i < cross.size(); ++i) {
    const Eigen::Vector2d& a = cross[i];
    const Eigen::Vector2d& b = cross[(i + 1) % cross.size()];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  EXPECT_NEAR(area, 16.0 - 4.0 * 0.5 * 1.5 * 1.5, 1e-12);  // counter-clockwise: positive
}

TEST(Surroundings, ARoundRobotsOutlineIsItsCircle) {
  for (const RobotModelName name : {RobotModelName::differential, RobotModelName::holonomic}) {
    const double radius = robot_model(name).round_radius_m;
    for (int i = 0; i < 100; ++i) {
      const double angle = 0.0628 * i;
      const Eigen::Vector2d place = 1.0 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      EXPECT_NEAR(distance(robot_outline(robot_model(name)), place), 1.0 - radius, 0.01 * radius);
    }
  }
}

}  // namespace
}  // namespace skylight::sim
