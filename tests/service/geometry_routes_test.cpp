// A robot's own geometry, through the router.
#include <gmock/gmock.h>

#include "service/robot_geometry.hpp"
#include "tests/service/routes_fixture.hpp"

namespace skylight::service::test {
namespace {

using testing::HasSubstr;

constexpr const char* kGeometry = "/api/v1/robots/anna/geometry";
constexpr const char* kApply = "/api/v1/robots/anna/geometry/apply";
constexpr double kForward_m = 0.006;

class GeometryRoutes : public Routes {
 protected:
  // The robot turns on the spot; its picture's middle lies ahead of the point that it turns about.
  void turn(int frames, double rate_radps) {
    for (int i = 0; i < frames; ++i) {
      yaw_ += rate_radps / 30.0;
      rig_.scene.pictures[0].pose = {0.1 + kForward_m * std::cos(yaw_), -0.1 + kForward_m * std::sin(yaw_),
                                     wrap_angle(yaw_)};
      rig_.clock.advance(std::chrono::milliseconds(33));  // else each frame waits until it is due
      ASSERT_TRUE(rig_.track(1));
    }
  }
  double yaw_ = 0.4;
};

TEST_F(GeometryRoutes, ATurnTellsTheReferencePointAndTheRobotTakesItOver) {
  turn(3, 0.0);
  EXPECT_EQ(get(kGeometry).status, 404);
  EXPECT_THAT(get(kGeometry).detail(), HasSubstr("POST"));
  const Answer begun = call("POST", kGeometry, R"({"distance": {"length_m": 2}})");
  ASSERT_EQ(begun.status, 201) << begun.body;
  EXPECT_THAT(begun.json()["result"]["figures"]["surface_height_m"]["missing"].get<std::string>(),
              HasSubstr("place"));
  EXPECT_EQ(begun.headers.at("Location"), kGeometry);
  EXPECT_EQ(begun.json()["known"]["distance"], (Json{{"length_m", 2.0}, {"sigma_m", 0.001}}));
  const Answer early = call("POST", kApply);
  EXPECT_EQ(early.status, 409);
  EXPECT_THAT(early.detail(), HasSubstr("turn on the spot"));

  turn(200, 1.2);
  const Json later = call("PUT", kGeometry, R"({"radius": {"length_m": 1}})").json();
  EXPECT_EQ(later["known"]["distance"], nullptr);
  EXPECT_EQ(later["since"], begun.json()["since"]) << "what was observed stays";
  const Json told = get(kGeometry).json();
  EXPECT_EQ(told["state"], "collecting");
  const Json result = told["result"];
  EXPECT_NEAR(result["covered"]["spun_rad"].get<double>(), 8.0, 1.0);
  EXPECT_EQ(result["figures"]["surface_height_m"]["verdict"], "open");
  EXPECT_EQ(result["figures"]["mounting_yaw_rad"]["measured"], nullptr);
  const Json& forward = result["figures"]["mounting_x_m"];
  ASSERT_EQ(forward["verdict"], "change") << forward;
  EXPECT_NEAR(forward["measured"].get<double>(), kForward_m, 3.0 * forward["sigma"].get<double>() + 1e-4);

  const Answer applied = call("POST", kApply);
  ASSERT_EQ(applied.status, 200) << applied.body;
  EXPECT_NEAR(applied.json()["picture_mounting"]["position_m"][0].get<double>(), kForward_m, 0.0005);
  EXPECT_FALSE(applied.json().contains("surface_height_m")) << "it was not determined";
  EXPECT_EQ(get(kGeometry).status, 404) << "what was collected is of the old geometry";
  turn(2, 0.0);
  const auto seen = rig_.pipeline->snapshot()->robots[0].view.last_measured;
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->pose.x, 0.1, 0.0007);
  EXPECT_NEAR(seen->pose.y, -0.1, 0.0007);
}

TEST_F(GeometryRoutes, AChangedRobotMakesTheCollectionOutdated) {
  turn(3, 0.0);
  ASSERT_EQ(call("POST", kGeometry, "{}").status, 201) << "nothing needs to be known";
  ASSERT_EQ(call("PATCH", "/api/v1/robots/anna", R"({"surface_height_m": 0.2})").status, 200);
  const Json told = get(kGeometry).json();
  EXPECT_EQ(told["state"], "outdated");
  EXPECT_EQ(told["result"], nullptr);
  EXPECT_THAT(told["reason"].get<std::string>(), HasSubstr("changed"));
  EXPECT_EQ(call("POST", kApply).status, 409);
}

TEST_F(GeometryRoutes, ACameraThatIsCalibratedAnewMakesTheCollectionOutdated) {
  turn(3, 0.0);
  ASSERT_EQ(call("POST", kGeometry, "{}").status, 201);
  const CameraSnapshot camera = rig_.pipeline->snapshot()->cameras[0];
  rig_.pipeline->recalibrate({{camera.id, camera.calibration}});
  const Json told = get(kGeometry).json();
  EXPECT_EQ(told["state"], "outdated");
  EXPECT_THAT(told["reason"].get<std::string>(), HasSubstr("cameras"));
  EXPECT_EQ(call("POST", kApply).status, 409);
}

TEST_F(GeometryRoutes, ItCanBeCancelledAndRefusesWhatIsNoKnowledge) {
  turn(3, 0.0);
  EXPECT_EQ(call("DELETE", kGeometry).status, 404);
  EXPECT_EQ(call("PUT", kGeometry, "{}").status, 404);
  ASSERT_EQ(call("POST", kGeometry, "{}").status, 201);
  EXPECT_EQ(call("DELETE", kGeometry).status, 204);
  EXPECT_EQ(get(kGeometry).status, 404);
  const Answer far = call("POST", kGeometry, R"({"distance": {"length_m": 2000}})");
  EXPECT_EQ(far.status, 422);
  EXPECT_THAT(far.detail(), testing::AllOf(HasSubstr("length_m"), HasSubstr("1000")));
  EXPECT_EQ(call("POST", kGeometry, R"({"diameter": 2})").status, 422);
  EXPECT_EQ(call("POST", "/api/v1/robots/nobody/geometry", "{}").status, 404);
}

calibration::RobotFit fit_of(std::optional<double> height, std::optional<double> x) {
  calibration::RobotFit fit;
  fit.surface_height_m = {.assumed = 0.1, .value = height, .sigma = 0.001};
  fit.mounting_x_m = {.assumed = 0.01, .value = x, .sigma = 0.001};
  fit.mounting_y_m = {.assumed = -0.02};
  fit.mounting_yaw = {.assumed = 0.3};
  return fit;
}

TEST(FoundGeometry, WhatIsDeterminedIsTakenOverAndTheRestStays) {
  const RobotSpec pictured = robot_of(small_room());
  const RobotSpec higher = with_geometry(pictured, fit_of(0.12, {}));
  EXPECT_EQ(higher.surface_height_m, 0.12);
  EXPECT_FALSE(higher.picture_mounting);
  const RobotSpec mounted = with_geometry(pictured, fit_of({}, 0.03));
  EXPECT_EQ(mounted.surface_height_m, pictured.surface_height_m);
  EXPECT_EQ(mounted.picture_mounting, (Pose2{0.03, -0.02, 0.3}));

  const RobotSpec tagged{.id = "ben", .tag = TagSpec{.height_m = 0.1, .mounting = {0.01, -0.02, 0.3}}};
  const RobotSpec changed = with_geometry(tagged, fit_of(0.12, {}));
  EXPECT_EQ(changed.tag->height_m, 0.12);
  EXPECT_EQ(changed.tag->mounting, tagged.tag->mounting);
  EXPECT_FALSE(changed.picture_mounting || changed.surface_height_m);
}

TEST(FoundGeometry, LooksThatSayNothingOfThePictureAreCounted) {
  const RobotSpec spec = robot_of(small_room());
  GeometryRun run(spec, {small_room().camera()}, {}, {});
  run.add(Observation{.captured = kStart, .source = PoseSource::orb, .heading_turns = 1});
  run.add(Observation{.captured = kStart, .source = PoseSource::orb, .heading_turns = 4});
  for (int i = 0; i < 2; ++i)
    run.add(Observation{.captured = kStart, .source = PoseSource::apriltag, .heading_turns = 1});
  EXPECT_EQ(run.run().seen.size(), 1U);
  const auto left_out = run.fit().left_out;
  const auto count = [&](const char* words) {
    std::size_t looks = 0;
    for (const auto& reason : left_out)
      looks += reason.reason.find(words) != std::string::npos ? reason.count : 0;
    return looks;
  };
  EXPECT_EQ(count("by its tag"), 2U);
  EXPECT_EQ(count("symmetric"), 1U);
}

TEST(FoundGeometry, AFigureIsToBeChangedBeyondThreeStandardDeviations) {
  EXPECT_EQ(verdict(fit_of(0.1029, {}).surface_height_m), "agrees");
  EXPECT_EQ(verdict(fit_of(0.0969, {}).surface_height_m), "change");
  EXPECT_EQ(verdict(fit_of({}, {}).surface_height_m), "open");
}

TEST(FoundGeometry, AWrongHeightCostsMoreTheFurtherTheRobotIsFromThePointUnderTheCamera) {
  // 1.5 m high, f = 250 px: the middle of the right side of 320 px is seen 159.5 / 250 x 1.4 m away.
  const HeightCost cost = height_cost(fit_of(0.105, {}), small_room().camera());
  EXPECT_NEAR(cost.error_m, 0.005, 1e-12);
  EXPECT_NEAR(cost.per_metre_m, 0.005 / 1.4, 1e-12);
  EXPECT_NEAR(cost.edge_m, 159.5 / 250.0 * 1.4, 0.01);
  EXPECT_DOUBLE_EQ(cost.at_edge_m, cost.per_metre_m * cost.edge_m);
}

}  // namespace
}  // namespace skylight::service::test
