#include "service/wire.hpp"

#include <limits>

#include <gmock/gmock.h>

#include "tests/service/line_history.hpp"

namespace skylight::service::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

PoseAnswer answered(const Estimate& estimate, double score, double confidence) {
  PoseAnswer answer{
      .robot = "anna", .state = TrackState::tracking, .reason = {}, .last_seen = {}, .pose = {}};
  answer.pose = PublishedPose{.estimate = estimate, .cameras = {"ceiling"}, .score = score};
  answer.identity_confidence = confidence;
  return answer;
}

TEST(Wire, NumbersThatAreNoneBecomeNull) {
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    Estimate estimate{.at = kStart, .pose = {bad, bad, bad}, .velocity = {bad, bad, bad}};
    estimate.covariance.setConstant(bad);
    const Json json = Json::parse(to_json(answered(estimate, bad, bad), kStart).dump());
    const Json& pose = json["pose"];
    for (const char* key : {"x", "y", "yaw", "score", "identity_confidence"})
      EXPECT_TRUE(pose.at(key).is_null()) << key;
    for (const char* key : {"x", "y", "yaw_rate"}) EXPECT_TRUE(pose["velocity"].at(key).is_null()) << key;
    ASSERT_EQ(pose["covariance"].size(), 9U);
    for (const Json& value : pose["covariance"]) EXPECT_TRUE(value.is_null());
  }
}

TEST(Wire, TimesAreUnixSecondsToTheMicrosecond) {
  const Estimate estimate{.at = kStart + Duration(123'456'789)};
  PoseAnswer answer = answered(estimate, 1.0, 1.0);
  answer.last_seen = kStart + Duration(400);
  const std::string text = to_json(answer, kStart + std::chrono::milliseconds(1500)).dump();
  EXPECT_THAT(text, testing::HasSubstr("\"at\":1700000000.123457,"));
  EXPECT_THAT(text, testing::HasSubstr("\"last_seen\":1700000000.0,"));
  EXPECT_THAT(text, testing::HasSubstr("\"published\":1700000001.5,"));
}

TEST(Wire, APoseSaysAllThatTheDesignAsksFor) {
  Line line(100);
  const PoseAnswer found =
      answer(line.snapshot, line.robot, {}, {.now = line.newest + std::chrono::milliseconds(250)});
  const Json json = to_json(found, line.newest + std::chrono::milliseconds(250));
  EXPECT_EQ(json["robot"], "anna");
  EXPECT_EQ(json["state"], "tracking");
  EXPECT_TRUE(json["reason"].is_null());
  const Json& pose = json["pose"];
  EXPECT_EQ(pose["frame"], "map");
  EXPECT_EQ(pose["kind"], "filtered");
  EXPECT_EQ(pose["source"], "align");
  EXPECT_DOUBLE_EQ(pose["age"], 0.25);
  EXPECT_DOUBLE_EQ(pose["horizon"], 0.0);
  EXPECT_EQ(pose["cameras"], Json::array({"ceiling"}));
  EXPECT_NEAR(pose["velocity"]["x"], 0.1, 1e-3);
  const Covariance3& covariance = found.pose->estimate.covariance;
  EXPECT_EQ(pose["covariance"][1], covariance(0, 1)) << "row-major: x, y, yaw";
  EXPECT_EQ(pose["covariance"][4], covariance(1, 1));
}

TEST(Wire, AMeasurementHasNoVelocityAndALostRobotNoPose) {
  const Line line(100);
  const Json measured = to_json(
      answer(line.snapshot, line.robot, {.kind = PoseKind::measured}, {.now = line.newest}), line.newest);
  EXPECT_TRUE(measured["pose"]["velocity"].is_null());
  const Line unseen(2, {0, 1});
  const Json lost = to_json(answer(unseen.snapshot, unseen.robot, {}, {.now = unseen.newest}), unseen.newest);
  EXPECT_TRUE(lost["pose"].is_null());
  EXPECT_TRUE(lost["last_seen"].is_null());
  EXPECT_EQ(lost["reason"], "covered");
}

TEST(Wire, ARobotIsWrittenAsItsConfigurationWithItsStatus) {
  Line line(100);
  line.robot.copies = 2;
  const PoseAnswer now = answer(line.snapshot, line.robot, {}, {.now = line.newest});
  const Json robot = to_json(line.robot, now);
  EXPECT_EQ(robot["id"], "anna");
  EXPECT_EQ(robot["appearance"], "anna");
  EXPECT_EQ(robot["status"]["state"], "tracking");
  EXPECT_EQ(robot["status"]["copies"], 2);
  EXPECT_EQ(robot["status"]["last_seen"], unix_seconds(line.newest));
  EXPECT_NEAR(robot["status"]["size_m"][0], 0.24, 1e-9);
  EXPECT_TRUE(robot["status"]["measured_height"].is_null()) << "no depth has seen it";
}

TEST(Wire, ACameraIsWrittenWithItsLensAndWhereItHangs) {
  Line line(1);
  CameraSnapshot& camera = line.snapshot.cameras[0];
  EXPECT_TRUE(to_json(camera)["captured"].is_null()) << "before its first frame";
  camera.frames = 3;
  camera.captured = kStart;
  camera.frame_rate_hz = kNan;
  const Json json = to_json(camera);
  EXPECT_EQ(json["captured"], 1'700'000'000.0);
  EXPECT_TRUE(json["frame_rate_hz"].is_null());
  EXPECT_EQ(json["intrinsics"]["width_px"], 320);
  EXPECT_EQ(json["map_from_camera"]["position_m"][2], 1.5);
  EXPECT_TRUE(json["depth"].is_null());
  camera.depth = FloorFit{.known = true, .frames = 9, .share = 0.9, .offset_m = 0.03};
  EXPECT_EQ(to_json(camera)["depth"]["offset_m"], 0.03);
  EXPECT_EQ(to_json(camera)["depth"]["known"], true);
  // Looks straight down with the picture's top towards map y: a half turn about x.
  EXPECT_NEAR(std::abs(json["map_from_camera"]["quaternion_xyzw"][0].get<double>()), 1.0, 1e-12);
}

}  // namespace
}  // namespace skylight::service::test
