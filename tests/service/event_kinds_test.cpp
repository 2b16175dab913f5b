// What each event says, of which kind and how serious it is: against cases worked out by hand.
#include "service/event_kinds.hpp"

#include <numbers>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "tests/service/fakes.hpp"

namespace skylight::service::test {
namespace {

using testing::HasSubstr;

/// A lens so long that a turn moves all of the picture alike: f = 2000 px, 320 x 240 px, straight down.
CameraModel long_lens() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  pose.translation().z() = 3.0;
  return {
      {.width_px = 320, .height_px = 240, .fx_px = 2000.0, .fy_px = 2000.0, .cx_px = 159.5, .cy_px = 119.5},
      pose};
}

CameraSnapshot hall(CameraHold hold = CameraHold::learning) {
  CameraSnapshot camera{.id = "hall", .model = std::make_shared<const CameraModel>(long_lens())};
  camera.hold = CameraWatchReport{.hold = hold, .since = kStart, .shift_px = 3.0, .turn_rad = 0.0};
  return camera;
}

TEST(EventKinds, ACameraThatWasTurnedIsToldByHowMuch) {
  constexpr double kAngle = 0.01;
  const CameraModel before = long_lens();
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
    Eigen::Isometry3d pose = before.map_from_camera();
    pose.linear() = pose.linear() * Eigen::AngleAxisd(kAngle, axis).toRotationMatrix();
    const CameraModel after(before.intrinsics(), pose);
    CameraWatchReport seen{.turn_rad = axis.z() != 0.0 ? -kAngle : 0.0};
    int count = 0;
    for (double u = 8; u < 320; u += 16) {
      for (double v = 8; v < 240; v += 16) {
        const Eigen::Vector2d floor = before.plane_from_pixel({u, v}, 0.0).value();
        seen.shift_px += (after.pixel_from_map({floor.x(), floor.y(), 0.0}).value() - Pixel(u, v)).norm();
        ++count;
      }
    }
    seen.shift_px /= count;
    EXPECT_NEAR(turned_rad(seen, before.intrinsics()), kAngle, 0.02 * kAngle) << axis.transpose();
  }
}

TEST(EventKinds, TheWatchTellsOfWhatChangedAndNotThatItHasLearnt) {
  EXPECT_FALSE(hold_event(hall(CameraHold::steady), CameraHold::learning));
  EXPECT_FALSE(hold_event(hall(CameraHold::learning), CameraHold::moved)) << "calibrated anew";

  const auto moved = hold_event(hall(CameraHold::moved), CameraHold::steady);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->kind, "camera.moved");
  EXPECT_EQ(moved->severity, Severity::warning);
  EXPECT_EQ(moved->camera, "hall");
  EXPECT_EQ(moved->data["since"], 1.7e9);
  EXPECT_EQ(moved->data["shift_px"], 3.0);
  EXPECT_NEAR(moved->data["degrees"].get<double>(), 3.0 / 2000.0 * 180.0 / std::numbers::pi, 1e-9);
  EXPECT_EQ(moved->message,
            "camera hall was moved: the floor is 3.0 px from where it was, about 0.09 degrees");

  const auto blind = hold_event(hall(CameraHold::blind), CameraHold::steady);
  ASSERT_TRUE(blind);
  EXPECT_EQ(blind->kind, "camera.blind");
  EXPECT_EQ(blind->severity, Severity::warning);
  for (const CameraHold before : {CameraHold::blind, CameraHold::moved}) {
    const auto back = hold_event(hall(CameraHold::steady), before);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->kind, "camera.back");
    EXPECT_EQ(back->severity, Severity::info);
  }
}

TEST(EventKinds, SourcesAndFeedsSayWhyTheyDoNotRun) {
  const Event failed = source_event(SourceState::failed, "hall.mkv: no such file");
  EXPECT_EQ(failed.kind, "source.state");
  EXPECT_EQ(failed.severity, Severity::error);
  EXPECT_EQ(failed.message, "the source is failed: hall.mkv: no such file");
  EXPECT_EQ(failed.data, (Json{{"state", "failed"}, {"reason", "hall.mkv: no such file"}}));
  const Event ended = source_event(SourceState::ended, {});
  EXPECT_EQ(ended.severity, Severity::info);
  EXPECT_EQ(ended.data, (Json{{"state", "ended"}, {"reason", nullptr}}));

  const auto feed = [](FeedState state, const std::string& reason) {
    return feed_event("hall", {.kind = "stream", .state = state, .reason = reason});
  };
  EXPECT_EQ(feed(FeedState::connecting, {}).severity, Severity::info);
  EXPECT_EQ(feed(FeedState::running, {}).severity, Severity::info);
  EXPECT_EQ(feed(FeedState::failed, "refused").severity, Severity::warning);
  const Event frozen = feed(FeedState::frozen, "the same picture for 5 s");
  EXPECT_EQ(frozen.kind, "camera.state");
  EXPECT_EQ(frozen.severity, Severity::warning);
  EXPECT_EQ(frozen.camera, "hall");
  EXPECT_EQ(frozen.message, "camera hall is frozen: the same picture for 5 s");
  EXPECT_EQ(frozen.data, (Json{{"state", "frozen"}, {"reason", "the same picture for 5 s"}}));
}

TEST(EventKinds, ANewCalibrationSaysHowFarItIsFromTheOneBefore) {
  const CameraSnapshot camera = hall();
  Eigen::Isometry3d pose = camera.model->map_from_camera();
  pose.translation() += Eigen::Vector3d(0.003, 0.0, -0.004);
  pose.linear() = Eigen::AngleAxisd(0.5 * std::numbers::pi / 180.0, Eigen::Vector3d::UnitY()) * pose.linear();
  const Event event = calibration_event(camera, CameraModel(camera.model->intrinsics(), pose));
  EXPECT_EQ(event.kind, "calibration.changed");
  EXPECT_EQ(event.camera, "hall");
  EXPECT_NEAR(event.data["shift_mm"].get<double>(), 5.0, 1e-9);
  EXPECT_NEAR(event.data["turn_deg"].get<double>(), 0.5, 1e-9);
  EXPECT_THAT(event.message, HasSubstr("5.0 mm and 0.50 degrees"));
}

TEST(EventKinds, ACameraThatDisagreesIsNamedWithHowFarAndWhetherItIsBelieved) {
  AgreementChange change{.camera = 0,
                         .disagrees = true,
                         .state = {.off_m = 0.026, .sigmas = 7.25, .robots = 2, .refused = true}};
  const Event off = agreement_event("hall", change);
  EXPECT_EQ(off.kind, "cameras.disagree");
  EXPECT_EQ(off.severity, Severity::warning);
  EXPECT_EQ(off.camera, "hall");
  EXPECT_EQ(off.message,
            "camera hall sees a robot 26.0 mm from where the others see it, 7.2 sigma: it is not believed");
  EXPECT_EQ(off.data, (Json{{"off_m", 0.026}, {"sigmas", 7.25}, {"robots", 2}, {"refused", true}}));
  change.state.refused = false;
  EXPECT_THAT(agreement_event("hall", change).message, testing::EndsWith("sigma"));
  change.disagrees = false;
  const Event again = agreement_event("hall", change);
  EXPECT_EQ(again.kind, "cameras.agree");
  EXPECT_EQ(again.severity, Severity::info);
  EXPECT_THAT(again.message, HasSubstr("where the others do"));
}

TEST(EventKinds, RobotsThatCameWentOrChangedAreTold) {
  const auto scene = small_room();
  const auto robot = [&](const std::string& id) {
    return std::make_shared<const RobotSpec>(robot_of(scene, id));
  };
  const auto anna = robot("anna");
  auto higher = std::make_shared<RobotSpec>(*anna);
  higher->surface_height_m = 0.5;
  const auto kinds = [](const RobotSpecs& before, const RobotSpecs& after) {
    std::vector<std::string> out;
    for (const Event& event : robot_events(before, after)) out.push_back(event.kind + " " + event.robot);
    return out;
  };
  EXPECT_THAT(kinds({anna}, {anna}), testing::IsEmpty());
  EXPECT_THAT(kinds({anna}, {std::make_shared<const RobotSpec>(*anna)}), testing::IsEmpty())
      << "another object that says the same";
  EXPECT_THAT(kinds({}, {anna}), testing::ElementsAre("robot.added anna"));
  EXPECT_THAT(kinds({anna}, {robot("ben")}), testing::ElementsAre("robot.removed anna", "robot.added ben"));
  EXPECT_THAT(kinds({anna}, {higher}), testing::ElementsAre("robot.changed anna"));
  EXPECT_THAT(kinds({anna}, {robot("anna")}), testing::ElementsAre("robot.changed anna"))
      << "with another picture";
}

}  // namespace
}  // namespace skylight::service::test
