// What is known of the cameras' calibration, from the tracker's settings into every pose.
#include <vector>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>

#include "tests/support/flat_scene.hpp"
#include "tracker/tracker.hpp"

namespace skylight {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

Tracker tracker_of(const test::FlatScene& scene, const std::vector<CameraUncertainty>& calibration) {
  Tracker tracker({scene.camera()}, {.calibration = calibration});
  tracker.add({.id = "anna",
               .appearance = test::appearance_of(scene.pictures[0]),
               .initial_pose = scene.pictures[0].pose});
  return tracker;
}

TEST(TrackerCalibration, GoesIntoEveryObservationAndEveryPublishedCovarianceAndChangesNoPose) {
  test::FlatScene scene;
  scene.pictures = {{.image = test::corner_picture(51), .pose = {0.4, -0.3, 0.7}}};
  const CameraUncertainty uncertainty =
      camera_uncertainty({.focal_px = 0.5, .position_m = 0.002, .rotation_rad = 0.0005});
  Tracker exact = tracker_of(scene, {});
  Tracker told = tracker_of(scene, {uncertainty});
  Frame frame = scene.render();
  std::size_t filtered = 0;
  for (int i = 0; i < 20; ++i) {
    frame.captured = Time{} + from_seconds(1000.0 + i / 30.0);
    const RobotReport plain = exact.process(frame).at(0);
    const RobotReport report = told.process(frame).at(0);
    ASSERT_TRUE(plain.measured && report.measured) << i;
    EXPECT_EQ(report.measured->pose, plain.measured->pose);
    EXPECT_EQ(report.measured->covariance, plain.measured->covariance);
    EXPECT_EQ(plain.measured->correlated, Covariance3(Covariance3::Zero()));
    const double height = scene.pictures[0].height_m;
    const Covariance3 expected =
        floor_covariance(scene.camera(), uncertainty, report.measured->pose.position(), height).value();
    EXPECT_EQ(report.measured->correlated, expected);
    ASSERT_EQ(report.filtered.has_value(), plain.filtered.has_value());
    if (!report.filtered) continue;
    ++filtered;
    EXPECT_EQ(report.filtered->pose, plain.filtered->pose);
    EXPECT_EQ(report.filtered->covariance, Covariance3(plain.filtered->covariance + expected));
  }
  EXPECT_GT(filtered, 3U);
  // As measured, too, a pose is known no better than its camera.
  const auto pose = told.views().at(0).history.pose(PoseKind::measured, frame.captured).pose;
  const auto plain = exact.views().at(0).history.pose(PoseKind::measured, frame.captured).pose;
  ASSERT_TRUE(pose && plain);
  EXPECT_EQ(pose->estimate.covariance,
            Covariance3(plain->estimate.covariance + told.views().at(0).last_measured->correlated));
}

TEST(TrackerCalibration, ForAnotherNumberOfCamerasOrThatIsNoCovarianceIsRefused) {
  const test::FlatScene scene;
  const auto tracker = [&](const std::vector<CameraUncertainty>& calibration) {
    return [&scene, calibration] { Tracker({scene.camera()}, {.calibration = calibration}); };
  };
  EXPECT_THAT(tracker({{}, {}}),
              ThrowsMessage<std::invalid_argument>(HasSubstr("calibration has 2 entries")));
  CameraUncertainty none;
  none.covariance(3, 3) = -1.0;
  EXPECT_THAT(tracker({none}), ThrowsMessage<std::invalid_argument>(HasSubstr("calibration[0]: a camera's")));
}

TEST(TrackerCalibration, ThatIsReplacedHoldsFromTheNextFrameOnAndTheTrackCarriesOn) {
  test::FlatScene scene;
  scene.pictures = {{.image = test::corner_picture(51), .pose = {0.4, -0.3, 0.7}}};
  Tracker tracker = tracker_of(scene, {});
  Frame frame = scene.render();
  const auto run = [&](int from, int to) {
    RobotReport report;
    for (int i = from; i < to; ++i) {
      frame.captured = Time{} + from_seconds(1000.0 + i / 30.0);
      report = tracker.process(frame).at(0);
    }
    return report;
  };
  const RobotReport before = run(0, 10);
  ASSERT_TRUE(before.filtered);
  // The camera was put up 4 mm further along x than had been thought, and that is known to 1 mm.
  CameraParameters by = CameraParameters::Zero();
  by[kCameraPosition] = 0.004;
  const CameraUncertainty told = camera_uncertainty({.position_m = 0.001});
  tracker.recalibrate(0, moved(scene.camera(), by), told);
  const RobotReport after = run(10, 100);
  ASSERT_TRUE(after.measured && after.filtered);
  EXPECT_EQ(after.state, TrackState::tracking);
  EXPECT_NEAR(after.measured->pose.x - before.measured->pose.x, 0.004, 1e-4);
  EXPECT_NEAR(after.filtered->pose.x - before.filtered->pose.x, 0.004, 2e-4);
  EXPECT_NEAR(after.measured->correlated(0, 0), 1e-6, 2e-7);
}

TEST(TrackerCalibration, ThatIsReplacedByWhatFitsNoCameraIsRefusedAndNothingChanges) {
  const test::FlatScene scene;
  Tracker tracker({scene.camera()});
  EXPECT_THAT([&] { tracker.recalibrate(1, scene.camera(), {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("there is no camera 1, allowed 0 to 0")));
  Intrinsics other = scene.camera().intrinsics();
  other.width_px += 2;
  EXPECT_THAT([&] { tracker.recalibrate(0, CameraModel(other, scene.camera().map_from_camera()), {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("its new calibration is for")));
  CameraUncertainty none;
  none.covariance(3, 3) = -1.0;
  EXPECT_THAT([&] { tracker.recalibrate(0, scene.camera(), none); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("uncertainty: ")));
}

}  // namespace
}  // namespace skylight
