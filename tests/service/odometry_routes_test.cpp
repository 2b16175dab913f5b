// What robots say of themselves, through the router.
#include <thread>

#include <gmock/gmock.h>

#include "tests/service/routes_fixture.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kAnna = "/api/v1/robots/anna/odometry";

RobotSpec with_motion_filter() {
  RobotSpec robot = robot_of(small_room());
  robot.filter = MotionFilterConfig{};
  return robot;
}

class OdometryRoutes : public Routes {
 protected:
  OdometryRoutes() : Routes({with_motion_filter()}) {}
  Answer post(const std::string& body) const { return call("POST", kAnna, body); }
};

TEST_F(OdometryRoutes, AReadingIsTakenAndReadBack) {
  EXPECT_EQ(get(kAnna).status, 404);
  EXPECT_THAT(get(kAnna).detail(), HasSubstr("not reported"));
  // The clock stands at 1700000000.
  const Answer taken = post(R"({"stamp": 1699999999.95, "v_mps": 0.2, "w_radps": -0.5})");
  ASSERT_EQ(taken.status, 202) << taken.body;
  EXPECT_EQ(taken.json(), (Json{{"robot", "anna"},
                                {"accepted", 1},
                                {"ignored", 0},
                                {"reason", nullptr},
                                {"clock_offset_s", -0.05}}));
  EXPECT_EQ(get(kAnna).json(), (Json{{"robot", "anna"},
                                     {"stamp", 1699999999.95},
                                     {"frame", "odom"},
                                     {"pose", nullptr},
                                     {"twist", {{"v_mps", 0.2}, {"side_mps", 0.0}, {"w_radps", -0.5}}}}));
}

TEST_F(OdometryRoutes, SeveralComeInOneMessageAndThoseWithoutAStampAreOfNow) {
  const Json taken = post(R"([{"stamp": 1699999999.96, "v_mps": 0.1, "w_radps": 0},
                              {"stamp": 1699999999.98, "v_mps": 0.2, "w_radps": 0, "kind": "command"},
                              {"stamp": 1700000000.0, "v_mps": 0.3, "side_mps": 0.1, "w_radps": 0.2,
                               "covariance": [1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-3]}])")
                         .json();
  EXPECT_EQ(taken["accepted"], 3);
  EXPECT_EQ(taken["clock_offset_s"], 0.0);
  EXPECT_EQ(get(kAnna).json()["twist"]["side_mps"], 0.1);
  rig_.clock.advance(milliseconds(500));
  EXPECT_EQ(post(R"({"v_mps": 0, "w_radps": 0})").json()["accepted"], 1);
  EXPECT_EQ(get(kAnna).json()["stamp"], 1700000000.5);
}

TEST_F(OdometryRoutes, BodiesThatAreRefusedNameKeyValueAndRange) {
  std::string many = "[";
  for (int i = 0; i < 1001; ++i) many += std::string(i > 0 ? "," : "") + R"({"v_mps": 0, "w_radps": 0})";
  many += "]";
  struct Case {
    std::string body;
    int status;
    const char* words;
  };
  const Case cases[] = {
      {"", 400, "body"},
      {"{", 400, "body:1"},
      {R"({"v_mps": NaN, "w_radps": 0})", 400, "body"},
      {"7", 422, "object"},
      {"[]", 422, "0 readings, allowed: 1 to 1000"},
      {many, 422, "1001 readings, allowed: 1 to 1000"},
      {R"({"w_radps": 0})", 422, "v_mps"},
      {R"({"v_mps": 51, "w_radps": 0})", 422, "v_mps: 51 is out of range, allowed -50 to 50"},
      {R"([{"v_mps": 1, "w_radps": 0}, {"v_mps": 1, "w_radps": -101}])", 422, "[1].w_radps: -101"},
      {R"({"v_mps": 1, "w_radps": 0, "stamp": -1})", 422, "stamp: -1"},
      {R"({"v_mps": 1, "w_radps": 0, "kind": "guess"})", 422, "guess"},
      {R"({"v_mps": 1, "w_radps": 0, "speed": 2})", 422, "speed"},
      {R"({"v_mps": 1, "w_radps": 0, "covariance": [1, 0, 0]})", 422, "covariance"},
      {R"({"v_mps": 1, "w_radps": 0, "covariance": [1, 2, 0, 2, 1, 0, 0, 0, 1]})", 422, "positive definite"},
      {R"({"v_mps": 1, "w_radps": 0, "covariance": [1, 0.5, 0, 0, 1, 0, 0, 0, 1]})", 422, "symmetric"},
      {R"({"v_mps": 1, "w_radps": 0, "covariance": [0, 0, 0, 0, 0, 0, 0, 0, 0]})", 422, "positive definite"},
  };
  for (const Case& c : cases) {
    const Answer answer = post(c.body);
    EXPECT_EQ(answer.status, c.status) << c.body.substr(0, 80);
    EXPECT_EQ(answer.type, "application/problem+json") << c.body.substr(0, 80);
    EXPECT_THAT(answer.detail(), AllOf(HasSubstr("body"), HasSubstr(c.words))) << c.body.substr(0, 80);
  }
  EXPECT_EQ(get(kAnna).status, 404) << "nothing was taken";
}

TEST_F(OdometryRoutes, WhatIsIgnoredIsCountedWithItsReason) {
  ASSERT_TRUE(rig_.track(2));
  const Json old = post(R"([{"stamp": 1699999990, "v_mps": 0, "w_radps": 0},
                            {"stamp": 1700000000, "v_mps": 0, "w_radps": 0}])")
                       .json();
  EXPECT_EQ(old["accepted"], 1);
  EXPECT_EQ(old["ignored"], 1);
  EXPECT_THAT(old["reason"].get<std::string>(), HasSubstr("older than the newest frame"));
}

TEST_F(OdometryRoutes, ItGoesWithItsRobot) {
  EXPECT_EQ(call("POST", "/api/v1/robots/nobody/odometry", R"({"v_mps": 0, "w_radps": 0})").status, 404);
  EXPECT_EQ(get("/api/v1/robots/nobody/odometry").status, 404);
  ASSERT_EQ(post(R"({"stamp": 1e6, "v_mps": 0.2, "w_radps": 0})").status, 202);
  ASSERT_EQ(call("DELETE", "/api/v1/robots/anna").status, 204);
  EXPECT_EQ(post(R"({"v_mps": 0.2, "w_radps": 0})").status, 404);
  ASSERT_EQ(call("POST", "/api/v1/robots", R"({"id": "anna", "appearance": "anna"})").status, 201);
  EXPECT_EQ(get(kAnna).status, 404) << "another robot of that name";
  const Json taken = post(R"({"stamp": 1700000000, "v_mps": 0.2, "w_radps": 0})").json();
  EXPECT_EQ(taken["clock_offset_s"], 0.0) << "with a clock of its own";
}

TEST_F(OdometryRoutes, AFilterThatUsesNoneSaysSo) {
  ASSERT_EQ(
      call("POST", "/api/v1/robots", R"({"id": "ben", "appearance": "anna", "filter": {"type": "window"}})")
          .status,
      201);
  const Json taken = call("POST", "/api/v1/robots/ben/odometry", R"({"v_mps": 0.2, "w_radps": 0})").json();
  EXPECT_EQ(taken["accepted"], 0);
  EXPECT_EQ(taken["ignored"], 1);
  EXPECT_THAT(taken["reason"].get<std::string>(), HasSubstr("window"));
}

TEST_F(OdometryRoutes, RobotsThatPostAllAtOnceHoldUpNeitherEachOtherNorTheFrames) {
  // Four robots' connections, each as fast as it can, while frames are tracked.
  std::vector<std::thread> robots;
  std::atomic<int> failed{0};
  for (int r = 0; r < 4; ++r) {
    robots.emplace_back([&] {
      for (int i = 0; i < 300; ++i) failed += post(R"({"v_mps": 0, "w_radps": 0})").status == 202 ? 0 : 1;
    });
  }
  const auto snapshot = rig_.track(20);
  for (std::thread& robot : robots) robot.join();
  EXPECT_EQ(failed, 0);
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[0].frames, 20U);
  EXPECT_EQ(get("/api/v1/robots/anna/pose").json()["state"], "tracking");
}

}  // namespace
}  // namespace skylight::service::test
