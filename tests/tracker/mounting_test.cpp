#include "tracker/mounting.hpp"

#include <complex>

#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"
#include "tracker/tracker.hpp"

namespace skylight {
namespace {

const Pose2 kPicture{0.06, -0.03, 0.2};  // in base_link

// Where base_link stands whose picture lies at `picture`, by complex numbers: x + iy, heading e^(i yaw).
Pose2 base_of(const Pose2& picture, const Pose2& mounting) {
  using Complex = std::complex<double>;
  const Complex heading = std::polar(1.0, picture.yaw - mounting.yaw);
  const Complex base = Complex(picture.x, picture.y) - heading * Complex(mounting.x, mounting.y);
  return {base.real(), base.imag(), wrap_angle(picture.yaw - mounting.yaw)};
}

test::FlatScene scene() {
  test::FlatScene scene;
  scene.floor_speckle = 1500;
  scene.pictures = {{.image = test::corner_picture(51), .pose = {-0.4, 0.3, 2.0}}};
  return scene;
}

TEST(Mounting, GoesBackAndForthAndTurnsTheCovarianceAsFirstOrderSays) {
  const auto appearance = test::appearance_of(scene().pictures[0]);
  const Mounting mounting(*appearance, kPicture);
  const Pose2 base = mounting.base_at({1.0, -2.0, 3.0});
  const Pose2 back = mounting.appearance_at(base);
  EXPECT_NEAR(back.x, 1.0, 1e-12);
  EXPECT_NEAR(back.y, -2.0, 1e-12);
  EXPECT_NEAR(back.yaw, 3.0, 1e-12);

  Observation seen{.pose = {1.0, -2.0, 3.0}};
  seen.covariance << 4, 1, 0.5, 1, 3, 0.2, 0.5, 0.2, 2;
  Eigen::Matrix3d by;
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 3; ++k) {
    Pose2 ahead = seen.pose;
    (k == 0 ? ahead.x : k == 1 ? ahead.y : ahead.yaw) += kStep;
    const Pose2 there = mounting.base_at(ahead);
    by.col(k) = Eigen::Vector3d(there.x - base.x, there.y - base.y, wrap_angle(there.yaw - base.yaw)) / kStep;
  }
  const Eigen::Matrix3d expected = by * seen.covariance * by.transpose();
  EXPECT_LT((mounting.of_base(seen).covariance - expected).norm(), 1e-5);
}

TEST(Mounting, ARobotIsReportedByItsOwnBaseLinkWhetherExpectedThereOrSearchedFor) {
  const test::FlatScene room = scene();
  const Pose2 base = base_of(room.pictures[0].pose, kPicture);
  for (const bool expected : {true, false}) {
    Tracker tracker({room.camera()});
    RobotSpec robot{.id = "anna", .appearance = test::appearance_of(room.pictures[0])};
    robot.picture_mounting = kPicture;
    if (expected) robot.initial_pose = base;
    tracker.add(robot);
    std::optional<Observation> seen;
    for (int i = 0; i < 70; ++i) {  // over an audit too
      const auto reports = tracker.process(room.render(Time{} + from_seconds(1000.0 + i / 30.0)));
      if (reports[0].measured) seen = reports[0].measured;
      if (!seen) continue;
      EXPECT_NEAR(seen->pose.x, base.x, 0.0005) << i;
      EXPECT_NEAR(seen->pose.y, base.y, 0.0005) << i;
      EXPECT_NEAR(wrap_angle(seen->pose.yaw - base.yaw), 0.0, 0.005) << i;
    }
    EXPECT_TRUE(seen);
  }
}

TEST(Mounting, IsRefusedWithoutAPictureOrFarOutsideOfTheRobot) {
  Tracker tracker({scene().camera()});
  RobotSpec robot{.id = "anna", .appearance = test::appearance_of(scene().pictures[0])};
  robot.picture_mounting = Pose2{7.0, 0.0, 0.0};
  EXPECT_THROW(tracker.add(robot), std::invalid_argument);
  RobotSpec tagged{.id = "ben", .appearance = nullptr};
  tagged.detector = DetectorKind::apriltag;
  tagged.tag = TagSpec{};
  tagged.picture_mounting = Pose2{};
  EXPECT_THROW(tracker.add(tagged), std::invalid_argument);
}

}  // namespace
}  // namespace skylight
