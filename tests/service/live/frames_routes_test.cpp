// Posting frames, and how cameras and readiness tell of live cameras: through the router, without sockets.
#include <cstdio>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "service/routes/context.hpp"
#include "tests/service/live/live_fixture.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::AllOf;
using testing::HasSubstr;

class FrameRoutes : public testing::Test {
 protected:
  explicit FrameRoutes(bool synchronised = true) : room_(synchronised) {
    context_ = std::make_unique<RouteContext>(RouteContext{
        .pipeline = *room_.pipeline, .appearances = store_, .default_method = {}, .posted = room_.posted});
    add_health_routes(router_, *context_);
    add_camera_routes(router_, *context_);
    add_frame_routes(router_, *context_);
  }

  struct Answer {
    int status = 0;
    Json json;
    std::string detail() const { return json["detail"]; }
  };
  Answer call(const std::string& method, const std::vector<std::string>& segments,
              const std::string& body = {}, const std::multimap<std::string, std::string>& query = {}) {
    const http::Router::Match match = router_.match(method, segments);
    if (match.route == nullptr) return {.status = 404};
    http::Request request{.method = method, .path_params = match.path_params, .query = query, .body = body};
    http::Reply reply;
    try {
      reply = match.route->handler(request);
    } catch (const http::Problem& problem) {
      reply = problem.answer();
    }
    return {reply.status, Json::parse(reply.body)};
  }
  Answer post(const std::string& camera, const std::string& body, const std::string& captured = {}) {
    std::multimap<std::string, std::string> query;
    if (!captured.empty()) query.emplace("captured", captured);
    return call("POST", {"api", "v1", "cameras", camera, "frames"}, body, query);
  }
  std::string encoded(const char* extension = ".png") {
    std::vector<unsigned char> bytes;
    cv::imencode(extension, room_.picture(milliseconds(shots_++)), bytes);
    return {bytes.begin(), bytes.end()};
  }
  static std::string seconds_text(Time at) {
    char text[40];
    std::snprintf(text, sizeof text, "%.6f", unix_seconds(at));
    return text;
  }

  LiveRoom room_;
  AppearanceStore store_{{}};
  std::unique_ptr<RouteContext> context_;
  http::Router router_;
  int shots_ = 0;
};

TEST_F(FrameRoutes, AFrameThatIsPostedIsTrackedAtItsOwnTime) {
  room_.clock.advance(seconds(1));
  const Time captured = kStart + milliseconds(900);
  EXPECT_EQ(post("east", encoded(), seconds_text(captured)).status, 202);
  const auto snapshot = room_.wait_for([](const Snapshot& s) { return s.cameras[0].frames == 1; });
  ASSERT_TRUE(snapshot);
  EXPECT_LT(std::abs(to_seconds(snapshot->cameras[0].captured - captured)), 2e-6);
  const Json source = call("GET", {"api", "v1", "cameras", "east"}).json["source"];
  EXPECT_EQ(source["type"], "posted");
  EXPECT_EQ(source["state"], "running");
  EXPECT_EQ(source["received"], 1);
  EXPECT_NEAR(source["delay_s"].get<double>(), 0.1, 2e-6);
  EXPECT_NEAR(source["clock_offset_s"].get<double>(), -0.1, 2e-6);
}

TEST_F(FrameRoutes, WithoutAStampAFrameIsDatedByItsArrival) {
  room_.clock.advance(seconds(3));
  EXPECT_EQ(post("west", encoded(".jpg")).status, 202);
  const auto snapshot = room_.wait_for([](const Snapshot& s) { return s.cameras[1].frames == 1; });
  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->cameras[1].captured, kStart + seconds(3));
}

TEST_F(FrameRoutes, WhatIsRefusedIsNamed) {
  EXPECT_EQ(post("north", encoded()).status, 404);
  const Answer text = post("east", "hello");
  EXPECT_EQ(text.status, 422);
  EXPECT_THAT(text.detail(), HasSubstr("no JPEG or PNG"));
  std::vector<unsigned char> bytes;
  cv::imencode(".png", cv::Mat(24, 32, CV_8UC1, cv::Scalar(1)), bytes);
  EXPECT_THAT(post("east", {bytes.begin(), bytes.end()}).detail(),
              AllOf(HasSubstr("32 x 24"), HasSubstr("320 x 240")));
  EXPECT_THAT(post("east", encoded(), seconds_text(kStart + seconds(5))).detail(),
              AllOf(HasSubstr("captured"), HasSubstr("5.0"), HasSubstr("-10 to 1 s")));
  EXPECT_EQ(post("east", encoded(), seconds_text(kStart - seconds(60))).status, 422);
  EXPECT_EQ(post("east", encoded(), "noon").status, 400);
  context_->posted.erase("west");
  const Answer elsewhere = post("west", encoded());
  EXPECT_EQ(elsewhere.status, 409);
  EXPECT_THAT(elsewhere.detail(), HasSubstr("posted"));
}

TEST_F(FrameRoutes, ReadinessTellsWhichCameraIsNotThere) {
  Answer answer = call("GET", {"readyz"});
  EXPECT_EQ(answer.status, 503);
  ASSERT_TRUE(room_.wait_for(
      [](const Snapshot& s) { return s.source == SourceState::running && s.cameras[1].feed; }));
  EXPECT_THAT(call("GET", {"readyz"}).detail(),
              AllOf(HasSubstr("no frame yet"), HasSubstr("camera east is connecting"),
                    HasSubstr("camera west is connecting")));
  post("east", encoded());
  ASSERT_TRUE(room_.wait_for([](const Snapshot& s) {
    return s.cameras[0].frames == 1 && s.cameras[0].feed->state == FeedState::running;
  }));
  answer = call("GET", {"readyz"});
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.json["degraded"], Json::array({"camera west is connecting"}));
}

class FrameRoutesOfAnotherClock : public FrameRoutes {
 protected:
  FrameRoutesOfAnotherClock() : FrameRoutes(false) {}
};

TEST_F(FrameRoutesOfAnotherClock, ItsOffsetIsFoundAndFramesAreDatedByOurs) {
  // Two hours ahead; every second picture takes 30 ms, the others none.
  for (int i = 0; i < 6; ++i) {
    const Time shot = kStart + milliseconds(100 * i);
    room_.clock.advance(milliseconds(100 * i + (i % 2 == 0 ? 0 : 30)) - (room_.clock.now() - kStart));
    ASSERT_EQ(post("east", encoded(), seconds_text(shot + std::chrono::hours(2))).status, 202);
    const auto snapshot = room_.wait_for(
        [i](const Snapshot& s) { return s.cameras[0].frames == static_cast<std::uint64_t>(i) + 1; });
    ASSERT_TRUE(snapshot);
    EXPECT_LT(std::abs(to_seconds(snapshot->cameras[0].captured - shot)), 3e-6) << i;
    EXPECT_NEAR(to_seconds(snapshot->cameras[0].feed->clock_offset.value()), 7200.0, 3e-6);
  }
}

}  // namespace
}  // namespace skylight::service::test
