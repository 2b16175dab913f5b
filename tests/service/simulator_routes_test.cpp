// The simulator's resources through the router, without sockets.
#include <gmock/gmock.h>

#include "service/simulator_desk.hpp"
#include "tests/service/routes_fixture.hpp"
#include "tests/service/simulated_room.hpp"

namespace skylight::service::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class SimulatorRoutes : public testing::Test {
 protected:
  SimulatorRoutes() {
    config_.source.input = SimulatorSource{.scenario = folder_.write("room.json", small_scenario(""))};
    const Assembly assembly = assemble(config_);
    assembly.live->pause();  // nothing moves but where a test says so
    store_.replace(assembly.appearances);
    pipeline_ = std::make_unique<Pipeline>(pipeline_parts(assembly), PipelineOptions{.log = {}});
    desk_ = std::make_unique<SimulatorDesk>(config_, assembly.live, *pipeline_, store_);
    context_ = std::make_unique<RouteContext>(RouteContext{
        .pipeline = *pipeline_, .appearances = store_, .default_method = {}, .simulator = desk_.get()});
    add_odometry_routes(router_, *context_);
    add_simulator_routes(router_, *context_);
    pipeline_->start();
  }

  Answer call(const std::string& method, const std::string& target, const std::string& body = {}) const {
    return call_route(router_, method, target, body);
  }
  Answer simulator() const { return call("GET", "/api/v1/simulator"); }
  /// Lets frames pass and waits until they did.
  Json step(int frames) const {
    const auto passed = [this] {
      const auto snapshot = pipeline_->snapshot();
      return snapshot->cameras[0].frames + snapshot->cameras[0].dropped;
    };
    const std::uint64_t until = passed() + static_cast<std::uint64_t>(frames);
    EXPECT_EQ(call("POST", "/api/v1/simulator/step", "{\"frames\": " + std::to_string(frames) + "}").status,
              202);
    for (int i = 0; i < 60'000 && passed() < until; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_GE(passed(), until);
    return simulator().json();
  }

  RoomFolder folder_;
  Config config_;
  AppearanceStore store_{{}};
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<SimulatorDesk> desk_;
  std::unique_ptr<RouteContext> context_;
  http::Router router_;
};

TEST_F(SimulatorRoutes, TellsScenarioStateAndTruth) {
  Json now = simulator().json();
  EXPECT_EQ(now["scenario"], "room") << "no path of this machine";
  EXPECT_EQ(now["seed"], 4);
  EXPECT_EQ(now["state"], "paused");
  EXPECT_EQ(now["cameras"], Json::array({"ceiling"}));
  EXPECT_EQ(now["robots"], Json::array());
  EXPECT_TRUE(now["duration"].is_null());
  now = step(1);
  ASSERT_EQ(now["robots"].size(), 1U);
  EXPECT_EQ(now["robots"][0]["id"], "anna");
  EXPECT_NEAR(now["robots"][0]["x"].get<double>(), 0.2, 0.01);
  EXPECT_EQ(now["camera"], "ceiling");
}

TEST_F(SimulatorRoutes, StartsPausesAndRefusesStepsWhileItRuns) {
  EXPECT_EQ(call("POST", "/api/v1/simulator/start").json()["state"], "running");
  EXPECT_EQ(call("POST", "/api/v1/simulator/step", "{}").status, 409);
  EXPECT_EQ(call("POST", "/api/v1/simulator/pause").json()["state"], "paused");
  EXPECT_EQ(call("POST", "/api/v1/simulator/step").status, 400) << "no body at all";
  EXPECT_EQ(call("POST", "/api/v1/simulator/step", "{}").status, 202) << "one frame where none are named";
  EXPECT_THAT(call("POST", "/api/v1/simulator/step", R"({"frames": 0})").detail(),
              AllOf(HasSubstr("frames"), HasSubstr("1 to 1000")));
  EXPECT_EQ(call("POST", "/api/v1/simulator/start?fast=1").status, 400);
}

TEST_F(SimulatorRoutes, TheSpeedIsSetWithinItsRange) {
  EXPECT_EQ(call("PATCH", "/api/v1/simulator", R"({"speed": 2.5})").json()["speed"], 2.5);
  const Answer refused = call("PATCH", "/api/v1/simulator", R"({"speed": 0})");
  EXPECT_EQ(refused.status, 422);
  EXPECT_THAT(refused.detail(), AllOf(HasSubstr("speed"), HasSubstr("0.01 to 100")));
  EXPECT_EQ(call("PATCH", "/api/v1/simulator", "{}").status, 422);
  EXPECT_EQ(call("PATCH", "/api/v1/simulator", "fast").status, 400);
  EXPECT_EQ(simulator().json()["speed"], 2.5);
}

TEST_F(SimulatorRoutes, ResetBeginsTheSameScenarioAnew) {
  ASSERT_GT(step(2)["time"].get<double>(), 0.03);
  const Answer reset = call("POST", "/api/v1/simulator/reset");
  ASSERT_EQ(reset.status, 200) << reset.json();
  EXPECT_EQ(reset.json()["scenario"], "room");
  EXPECT_EQ(reset.json()["seed"], 4);
  EXPECT_EQ(reset.json()["time"], 0.0);
  EXPECT_EQ(reset.json()["state"], "paused") << "as it was";
  EXPECT_EQ(step(1)["robots"].size(), 1U);
}

TEST_F(SimulatorRoutes, ListsWhatComesAlongAndLoadsItByName) {
  const Json list = call("GET", "/api/v1/scenarios").json();
  ASSERT_GE(list["total"].get<int>(), 3);
  const auto demo = std::find_if(list["items"].begin(), list["items"].end(),
                                 [](const Json& scenario) { return scenario["name"] == "circle"; });
  ASSERT_NE(demo, list["items"].end());
  EXPECT_EQ((*demo)["robots"], 1);
  EXPECT_FALSE((*demo)["description"].get<std::string>().empty());
  const Answer loaded = call("PUT", "/api/v1/simulator", R"({"scenario": "circle", "seed": 9})");
  ASSERT_EQ(loaded.status, 200) << loaded.json();
  EXPECT_EQ(loaded.json()["scenario"], "circle");
  EXPECT_EQ(loaded.json()["seed"], 9);
  EXPECT_EQ(pipeline_->snapshot()->robots.size(), 1U);
  EXPECT_EQ(store_.all().size(), 1U);
}

TEST_F(SimulatorRoutes, WhatCannotBeLoadedIsRefusedAndTheOldOneGoesOn) {
  for (const char* body : {R"({"scenario": "atlantis"})", R"({"scenario": "../scenarios/circle"})",
                           R"({"scenario": "room.json"})", R"({"scenario": "/etc/passwd"})", R"({"seed": 3})",
                           R"({"scenario": "circle", "seed": -1})", R"({"scenario": "circle", "sed": 1})"}) {
    const Answer refused = call("PUT", "/api/v1/simulator", body);
    EXPECT_EQ(refused.status, 422) << body;
    EXPECT_FALSE(refused.detail().empty());
  }
  EXPECT_EQ(call("PUT", "/api/v1/simulator", "circle").status, 400);
  EXPECT_EQ(simulator().json()["scenario"], "room");
  EXPECT_EQ(step(1)["robots"].size(), 1U);
}

TEST_F(SimulatorRoutes, WhatAnActionLacksIsNamed) {
  const auto act = [&](const std::string& body) { return call("POST", "/api/v1/simulator/actions", body); };
  EXPECT_EQ(act("now").status, 400);
  Answer refused = act(R"({"do": "fly"})");
  EXPECT_EQ(refused.status, 422);
  EXPECT_THAT(refused.detail(), AllOf(HasSubstr("do"), HasSubstr("fly"), HasSubstr("kidnap")));
  refused = act(R"({"do": "light", "level": 99})");
  EXPECT_EQ(refused.status, 422);
  EXPECT_THAT(refused.detail(), AllOf(HasSubstr("level"), HasSubstr("99")));
  EXPECT_EQ(act(R"({"do": "power", "robot": "nobody", "on": true})").status, 422);
}

TEST_F(SimulatorRoutes, OnlyRobotsOfTheScenarioAreDrivenOrReport) {
  EXPECT_EQ(call("POST", "/api/v1/robots/nobody/cmd_vel", R"({"v_mps": 0.1, "w_radps": 0})").status, 404);
  const Answer refused = call("POST", "/api/v1/robots/anna/cmd_vel", R"({"v_mps": 99, "w_radps": 0})");
  EXPECT_EQ(refused.status, 422);
  EXPECT_THAT(refused.detail(), AllOf(HasSubstr("v_mps"), HasSubstr("-5 to 5")));
  EXPECT_EQ(call("POST", "/api/v1/robots/anna/cmd_vel", R"({"v_mps": 0.1})").status, 422);
  EXPECT_EQ(call("GET", "/api/v1/robots/nobody/odometry").status, 404);
  EXPECT_THAT(call("GET", "/api/v1/robots/anna/odometry").detail(), HasSubstr("not reported"))
      << "no frame yet";
}

TEST_F(SimulatorRoutes, OfASimulatedRobotItsWheelsAreReadWhoeverPostsForIt) {
  ASSERT_EQ(call("POST", "/api/v1/robots/anna/odometry", R"({"stamp": 5, "v_mps": 3, "w_radps": 0})").status,
            202);
  EXPECT_EQ(call("GET", "/api/v1/robots/anna/odometry").status, 404) << "the wheels have not reported yet";
  step(4);
  const Json report = call("GET", "/api/v1/robots/anna/odometry").json();
  EXPECT_NE(report["stamp"], 5.0);
  EXPECT_TRUE(report["pose"].is_object());
  EXPECT_NEAR(report["twist"]["v_mps"].get<double>(), 0.15, 0.1);
}

TEST_F(SimulatorRoutes, EventsComeByPages) {
  const Json page = call("GET", "/api/v1/simulator/events").json();
  EXPECT_EQ(page["total"], 0);
  EXPECT_EQ(call("GET", "/api/v1/simulator/events?since=-1").status, 400);
  EXPECT_EQ(call("GET", "/api/v1/simulator/events?since=2").status, 200);
}

TEST_F(SimulatorRoutes, WhereTheSourceIsNoSimulatorThereIsNone) {
  context_->simulator = nullptr;
  for (const auto& [method, path] :
       {std::pair{"GET", "/api/v1/simulator"}, std::pair{"PUT", "/api/v1/simulator"},
        std::pair{"POST", "/api/v1/simulator/start"}, std::pair{"POST", "/api/v1/simulator/actions"},
        std::pair{"GET", "/api/v1/simulator/events"}, std::pair{"POST", "/api/v1/robots/anna/cmd_vel"}}) {
    const Answer answer = call(method, path, "{}");
    EXPECT_EQ(answer.status, 404) << path;
    EXPECT_THAT(answer.detail(), HasSubstr("not the simulator"));
  }
  EXPECT_EQ(call("GET", "/api/v1/scenarios").status, 200) << "those there are all the same";
}

}  // namespace
}  // namespace skylight::service::test
