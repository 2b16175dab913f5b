#include "service/reproduce/paper_frames.hpp"

#include <set>

#include <gmock/gmock.h>

#include "sim/scenario/robot_model.hpp"
#include "tests/service/simulated_room.hpp"

namespace skylight::service::reproduce {
namespace {

/// A robot near the camera: 333 px per metre, two frames.
constexpr const char* kNear =
    R"({"seed": 4, "duration_s": 0.2, "room": {"size_m": [3, 3], "floor": {"material": "plain"}},
  "cameras": [{"id": "ceiling", "position_m": [0, 0, 1.5], "width_px": 640, "height_px": 480, "fx_px": 500,
               "fy_px": 500, "frame_rate_hz": 10, "depth": {"enabled": true}}],
  "robots": [{"id": "anna", "picture": {"seed": 5}, "start": {"x_m": 0.45, "y_m": -0.2, "yaw_deg": 100},
              "program": [{"do": "line", "distance_m": 1, "speed_mps": 0.2}]}]})";

class PaperFrames : public testing::Test {
 protected:
  ObservedRun near() const { return paper_run(scenario_run(folder_.write("near.json", kNear), 4), "near"); }
  test::RoomFolder folder_;
};

TEST(PaperReference, IsTheMiddleOfTheSimulatedPlate) {
  const sim::Rectangle& plate = sim::robot_model(sim::RobotModelName::waffle_pi).plate;
  EXPECT_NEAR((0.5 * (plate.min + plate.max) - Eigen::Vector2d(kBaseScanX, 0)).norm(), 0.0, 1e-12);
  // 280 px per metre on the floor; the plate of 0.266 m is 0.104 m nearer to a camera 6.93 m up.
  EXPECT_NEAR(robot_length_px(280.0), 0.266 * 280.0 * 6.93 / 6.826, 1e-9);
}

TEST_F(PaperFrames, LookAtOneHomographyInEveryWay) {
  const ObservedRun run = near();
  EXPECT_EQ(write_run(run, "key"), write_run(near(), "key"));  // RANSAC has a seed of its own
  ASSERT_EQ(run.frames.size(), 2u);
  EXPECT_THAT(run.variants, testing::ElementsAre("vertical", "ray", "vertical_scan"));
  for (const ObservedFrame& frame : run.frames) {
    EXPECT_TRUE(frame.in_view);
    for (const auto& seen : frame.seen) ASSERT_TRUE(seen.has_value());
    const Pose2 vertical = frame.seen[0]->pose;
    const Pose2 ray = frame.seen[1]->pose;
    const Pose2 scan = frame.seen[2]->pose;
    EXPECT_EQ(vertical.yaw, ray.yaw);
    EXPECT_EQ(vertical.yaw, scan.yaw);
    EXPECT_NEAR((point_of(scan, kBaseScanX) - vertical.position()).norm(), 0.0, 1e-12);
    // Similar triangles: the camera hangs over the origin at 1.5 m; what lies z above the floor there is seen
    // 1.5 / (1.5 - z) as far out. The ray through the plate's middle (0.104 m) ends at the lidar on it,
    // 0.1405 m up, which is where the depth is read.
    const Eigen::Vector2d further = point_of(ray, kBaseScanX);
    EXPECT_NEAR((further - vertical.position() * 1.5 / (1.5 - 0.1405)).norm(), 0.0, 0.004);
    const Eigen::Vector2d truth = point_of(frame.truth, kBaseScanX);
    EXPECT_NEAR((further - truth * 1.5 / (1.5 - 0.104)).norm(), 0.0, 0.01);
  }
}

PaperPlan small_plan() {
  PaperPlan plan;
  plan.setup.px_per_metre = 30.0;
  plan.routes = {"line-3"};
  plan.seeds = 1;
  plan.at_most_s = 0.35;
  return plan;
}

TEST_F(PaperFrames, FollowTheirPlan) {
  PaperPlan plan = small_plan();
  plan.seeds = 2;
  const auto runs = run_jobs(paper_jobs(plan), {.folder = folder_.path / "kept"});
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[1].seed, 2u);
  for (const ObservedRun& run : runs) {
    EXPECT_EQ(run.route, "line-3");
    EXPECT_EQ(run.frame_rate_hz, 10.0);
    EXPECT_EQ(run.width_px, 180);
    EXPECT_EQ(run.height_px, 180);
    EXPECT_EQ(run.frames.size(), 4u);
    for (const ObservedFrame& frame : run.frames) EXPECT_TRUE(frame.in_view);
  }
  // line-3 starts at (2.5, 0.8) looking back along x.
  EXPECT_NEAR(runs[0].frames[0].truth.x, 2.5, 0.001);
  EXPECT_NEAR(std::abs(runs[0].frames[0].truth.yaw), M_PI, 0.001);
}

TEST(PaperJobs, HaveAnotherKeyWhereAnythingThatDecidesDiffers) {
  std::vector<PaperPlan> plans(7, small_plan());
  plans[1].setup.px_per_metre = 30.5;
  plans[2].setup.frame_rate_hz = 10.5;
  plans[3].setup.floor = "tiles";
  plans[4].at_most_s = 0.4;
  plans[5].routes = {"line-4"};
  plans[6].seeds = 2;
  std::set<std::string> keys;
  for (const PaperPlan& plan : plans) keys.insert(paper_jobs(plan).back().key);
  EXPECT_EQ(keys.size(), plans.size());
  EXPECT_EQ(paper_jobs(small_plan()).back().key, paper_jobs(small_plan()).back().key);
}

TEST(PaperJobs, RefuseAFloorThatThereIsNot) {
  PaperPlan plan = small_plan();
  plan.setup.floor = "lava";
  EXPECT_THROW(paper_jobs(plan), std::runtime_error);
}

TEST(PaperJobs, OfAQuickLookAreAFewOfTheWhole) {
  EXPECT_EQ(paper_jobs(PaperPlan{}).size(), 130u);
  const auto quick = paper_jobs(quick_paper_plan());
  EXPECT_EQ(quick.size(), 5u);
  double weight = 0.0;
  for (const Job& job : quick) weight += job.weight;
  double whole = 0.0;
  for (const Job& job : paper_jobs(PaperPlan{})) whole += job.weight;
  EXPECT_LT(weight, 0.02 * whole);
}

TEST(PaperRoutes, AreEightLinesAndFiveCurves) {
  EXPECT_EQ(paper_routes().size(), 13u);
  EXPECT_EQ(std::count_if(paper_routes().begin(), paper_routes().end(), is_linear), 8);
}

TEST_F(PaperFrames, TheResolutionsCurveCountsEveryFrame) {
  ResolutionPlan plan;
  plan.px_per_metre = {20, 30};
  plan.floors = {"plain"};
  plan.routes = {"line-1"};
  plan.at_most_s = 2.1;
  const auto curve = resolution_curve(plan, {.folder = folder_.path / "kept"});
  ASSERT_EQ(curve.size(), 2u);
  EXPECT_EQ(curve[1].px_per_metre, 30.0);
  EXPECT_EQ(curve[1].floor, "plain");
  for (const ResolutionPoint& point : curve) {
    EXPECT_EQ(point.frames, 3u);  // at 0, 1 and 2 s
    EXPECT_EQ(point.found, 0u);   // 5 and 8 px: there is nothing to match
  }
}

}  // namespace
}  // namespace skylight::service::reproduce
