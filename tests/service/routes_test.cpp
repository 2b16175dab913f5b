#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "tests/service/routes_fixture.hpp"

namespace skylight::service::test {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;

TEST_F(Routes, ListsRobotsByPages) {
  const Json one = get("/api/v1/robots").json();
  EXPECT_EQ(one["total"], 1);
  EXPECT_EQ(one["items"][0]["id"], "anna");
  EXPECT_EQ(call("POST", "/api/v1/robots", R"({"id": "ben", "appearance": "anna"})").status, 201);
  const Json second = get("/api/v1/robots?limit=1&offset=1").json();
  EXPECT_EQ(second["total"], 2);
  ASSERT_EQ(second["items"].size(), 1U);
  EXPECT_EQ(second["items"][0]["id"], "ben");
  EXPECT_EQ(get("/api/v1/robots?offset=5").json()["items"], Json::array());
}

TEST_F(Routes, ARobotIsAddedFoundAndRemoved) {
  const Answer added = call(
      "POST", "/api/v1/robots",
      R"({"id": "ben", "appearance": "anna", "surface_height_m": 0.2, "initial_pose": {"x_m": 0.5, "y_m": 0}})");
  ASSERT_EQ(added.status, 201) << added.body;
  EXPECT_EQ(added.headers.at("Location"), "/api/v1/robots/ben");
  EXPECT_EQ(added.json()["surface_height_m"], 0.2);
  EXPECT_EQ(added.json()["status"]["copies"], 2);
  EXPECT_EQ(get("/api/v1/robots/ben").status, 200);
  EXPECT_EQ(call("DELETE", "/api/v1/robots/ben").status, 204);
  EXPECT_EQ(get("/api/v1/robots/ben").status, 404);
  const Answer again = call("DELETE", "/api/v1/robots/ben");
  EXPECT_EQ(again.status, 404);
  EXPECT_THAT(again.detail(), HasSubstr("'ben'"));
}

TEST_F(Routes, ANewRobotIsFilteredAsTheConfigurationSaysButForWhatItSaysItself) {
  const Json silent = call("POST", "/api/v1/robots", R"({"id": "ben", "appearance": "anna"})").json();
  EXPECT_EQ(silent["filter"]["window_size"], 7);
  const Json own = call("POST", "/api/v1/robots",
                        R"({"id": "cleo", "appearance": "anna", "filter": {"type": "window", "alpha": 0.5}})")
                       .json();
  EXPECT_EQ(own["filter"]["alpha"], 0.5);
  EXPECT_EQ(own["filter"]["window_size"], 7);
}

TEST_F(Routes, ARobotThatIsThereAlreadyIsAConflict) {
  const Answer answer = call("POST", "/api/v1/robots", R"({"id": "anna", "appearance": "anna"})");
  EXPECT_EQ(answer.status, 409);
  EXPECT_EQ(answer.type, "application/problem+json");
  EXPECT_THAT(answer.detail(), HasSubstr("'anna'"));
}

TEST_F(Routes, ABodyThatIsRefusedNamesKeyValueAndRange) {
  struct Case {
    const char* body;
    int status;
    const char* words;
  };
  const Case cases[] = {
      {R"({"id": "ben")", 400, "body:1"},
      {"", 400, "body"},
      {"[]", 422, "object"},
      {R"({"appearance": "anna"})", 422, "id"},
      {R"({"id": "", "appearance": "anna"})", 422, "id"},
      {R"({"id": 7, "appearance": "anna"})", 422, "id"},
      {R"({"id": "ben", "appearance": "anna", "surface_height_m": 99})", 422,
       "surface_height_m: 99 is out of range, allowed -1 to 5"},
      {R"({"id": "ben", "appearance": "anna", "wheels": 4})", 422, "wheels"},
      {R"({"id": "ben", "appearance": "anna", "filter": {"window_size": 1}})", 422, "filter.window_size: 1 "},
      {R"({"id": "ben", "appearance": "anna", "detector": "magic"})", 422, "magic"},
      {R"({"id": "ben", "appearance": "painting"})", 422, "no appearance 'painting'"},
      {R"({"id": "ben"})", 422, "no appearance 'ben'"},
  };
  for (const Case& c : cases) {
    const Answer answer = call("POST", "/api/v1/robots", c.body);
    EXPECT_EQ(answer.status, c.status) << c.body;
    EXPECT_EQ(answer.type, "application/problem+json") << c.body;
    EXPECT_THAT(answer.detail(), HasSubstr(c.words)) << c.body;
  }
  EXPECT_EQ(get("/api/v1/robots").json()["total"], 1) << "nothing was added";
}

TEST_F(Routes, AChangeNamesOnlyWhatItChanges) {
  const Answer changed = call("PATCH", "/api/v1/robots/anna", R"({"filter": {"alpha": 0.7}})");
  ASSERT_EQ(changed.status, 200) << changed.body;
  EXPECT_EQ(changed.json()["filter"]["alpha"], 0.7);
  EXPECT_EQ(changed.json()["filter"]["window_size"], 4) << "as it was";
  EXPECT_EQ(get("/api/v1/robots/anna").json()["filter"]["alpha"], 0.7);
}

TEST_F(Routes, AnotherTypeOfFilterBeginsWithItsOwnDefaults) {
  const Json motion =
      call("PATCH", "/api/v1/robots/anna", R"({"filter": {"type": "motion", "gate": 20}})").json();
  EXPECT_EQ(motion["filter"]["type"], "motion");
  EXPECT_EQ(motion["filter"]["gate"], 20);
  EXPECT_EQ(motion["filter"]["max_speed_mps"], MotionFilterConfig{}.max_speed_mps);
  EXPECT_FALSE(motion["filter"].contains("window_size"));
  const Json other =
      call("POST", "/api/v1/robots", R"({"id": "ben", "appearance": "anna", "filter": {"type": "motion"}})")
          .json();
  EXPECT_EQ(other["filter"]["type"], "motion") << other;
  const Json back = call("PATCH", "/api/v1/robots/anna", R"({"filter": {"type": "window"}})").json();
  EXPECT_EQ(back["filter"]["window_size"], WindowFilterConfig{}.window_size);
}

TEST_F(Routes, AChangeThatIsRefusedChangesNothing) {
  const Answer range = call("PATCH", "/api/v1/robots/anna", R"({"filter": {"alpha": -1}})");
  EXPECT_EQ(range.status, 422);
  EXPECT_THAT(range.detail(), AllOf(HasSubstr("filter.alpha"), HasSubstr("-1"), HasSubstr("100")));
  EXPECT_THAT(call("PATCH", "/api/v1/robots/anna", R"({"id": "ben"})").detail(), HasSubstr("cannot change"));
  EXPECT_EQ(call("PATCH", "/api/v1/robots/nobody", "{}").status, 404);
  EXPECT_EQ(call("PATCH", "/api/v1/robots/anna", "[1]").status, 422);
  EXPECT_EQ(call("PATCH", "/api/v1/robots/anna", "{").status, 400);
  EXPECT_EQ(get("/api/v1/robots/anna").json()["filter"]["alpha"], 0.3);
}

TEST_F(Routes, AnUnknownRobotIsNotFoundByName) {
  for (const char* target :
       {"/api/v1/robots/nobody", "/api/v1/robots/nobody/pose", "/api/v1/robots/nobody/trajectory"}) {
    const Answer answer = get(target);
    EXPECT_EQ(answer.status, 404) << target;
    EXPECT_THAT(answer.detail(), HasSubstr("'nobody'"));
  }
  EXPECT_EQ(get("/api/v1/cameras/nobody").status, 404);
  EXPECT_EQ(get("/api/v1/cameras/nobody/snapshot.jpg").status, 404);
}

TEST_F(Routes, ThePoseIsWhereTheRobotStands) {
  ASSERT_TRUE(rig_.track(8));
  const Json answer = get("/api/v1/robots/anna/pose?kind=measured").json();
  EXPECT_EQ(answer["state"], "tracking");
  const Pose2 truth = rig_.scene.pictures[0].pose;
  EXPECT_NEAR(answer["pose"]["x"], truth.x, 0.002);
  EXPECT_NEAR(answer["pose"]["y"], truth.y, 0.002);
  EXPECT_NEAR(answer["pose"]["yaw"], truth.yaw, 0.01);
  EXPECT_EQ(answer["pose"]["cameras"][0], "ceiling");
  const Json all = get("/api/v1/poses").json();
  EXPECT_EQ(all["total"], 1);
  EXPECT_EQ(all["items"][0]["robot"], "anna");
  const Json then = get("/api/v1/robots/anna/pose?kind=measured&at=1700000000.05").json();
  EXPECT_EQ(then["pose"]["at"], 1'700'000'000.05);
}

TEST_F(Routes, AnInstantWithoutAnAnswerIsA422ThatNamesTheBound) {
  ASSERT_TRUE(rig_.track(3));
  const Answer early = get("/api/v1/robots/anna/pose?at=1699999999");
  EXPECT_EQ(early.status, 422);
  EXPECT_THAT(early.detail(), HasSubstr("1700000000.000000"));
  EXPECT_THAT(get("/api/v1/robots/anna/pose?at=1700000009").detail(), HasSubstr("horizon of 2.000000 s"));
  EXPECT_EQ(get("/api/v1/poses?at=1700000009").status, 422);
  EXPECT_EQ(get("/api/v1/robots/anna/pose?at=1700000001&kind=measured").status, 422);
  EXPECT_EQ(get("/api/v1/robots/anna/pose?kind=smoothed").status, 422);
}

TEST_F(Routes, APoseNowIsCarriedToThePresent) {
  ASSERT_TRUE(rig_.track(8));
  rig_.clock.advance(milliseconds(7 * 33 + 200));
  for (const char* query : {"at=now", "at=now&kind=predicted", "kind=predicted"}) {
    const Json one = get("/api/v1/robots/anna/pose?" + std::string(query)).json();
    EXPECT_EQ(one["pose"]["kind"], "predicted") << query;
    EXPECT_EQ(one["pose"]["at"], one["published"]) << query;
    EXPECT_NEAR(one["pose"]["horizon"].get<double>(), 0.2, 1e-9);
    EXPECT_EQ(one["pose"]["horizon"], one["pose"]["age"]);
    EXPECT_EQ(get("/api/v1/poses?" + std::string(query)).json()["items"][0], one);
  }
  for (const char* kind : {"measured", "filtered", "smoothed"}) {
    for (const char* path : {"/api/v1/robots/anna/pose", "/api/v1/poses"}) {
      const Answer refused = get(std::string(path) + "?at=now&kind=" + kind);
      EXPECT_EQ(refused.status, 422) << kind;
      EXPECT_THAT(refused.detail(), AllOf(HasSubstr("kind is " + std::string(kind)), HasSubstr("at is now"),
                                          HasSubstr("allowed: predicted")));
    }
  }
  rig_.clock.advance(std::chrono::seconds(3));
  const Json stale = get("/api/v1/robots/anna/pose?at=now").json();
  EXPECT_TRUE(stale["pose"].is_null()) << "beyond the horizon nothing is made up";
  EXPECT_EQ(stale["state"], "lost");
}

TEST_F(Routes, SmoothedIsRefusedWhereTheFilterHasNoSmootherAndGivenOtherwise) {
  ASSERT_TRUE(rig_.track(2));
  for (const char* path : {"/api/v1/robots/anna/pose", "/api/v1/robots/anna/trajectory"}) {
    const Answer refused = get(std::string(path) + "?kind=smoothed");
    EXPECT_EQ(refused.status, 422);
    EXPECT_THAT(refused.detail(), AllOf(HasSubstr("smoothed"), HasSubstr("no smoother")));
  }
  ASSERT_EQ(call("PATCH", "/api/v1/robots/anna", R"({"filter": {"type": "motion"}})").status, 200);
  ASSERT_TRUE(rig_.track(8));
  const Json pose = get("/api/v1/robots/anna/pose?kind=smoothed").json()["pose"];
  EXPECT_EQ(pose["kind"], "smoothed");
  EXPECT_NEAR(pose["x"], rig_.scene.pictures[0].pose.x, 0.002);
  EXPECT_EQ(get("/api/v1/robots/anna/trajectory?kind=smoothed").json()["points"].size(), 8U)
      << "the new filter's own";
}

TEST_F(Routes, TrajectoriesComeInThreeFormats) {
  ASSERT_TRUE(rig_.track(8));
  const Answer json = get("/api/v1/robots/anna/trajectory?kind=measured");
  EXPECT_EQ(json.type, "application/json");
  EXPECT_EQ(json.json()["points"].size(), 8U);
  const Answer csv = get("/api/v1/robots/anna/trajectory?kind=measured&format=csv");
  EXPECT_THAT(csv.type, HasSubstr("text/csv"));
  EXPECT_EQ(std::count(csv.body.begin(), csv.body.end(), '\n'), 9);
  const Answer tum =
      get("/api/v1/robots/anna/trajectory?kind=measured&format=tum&from=1700000000.033&to=1700000000.066");
  EXPECT_EQ(std::count(tum.body.begin(), tum.body.end(), '\n'), 2) << "both ends included";
  EXPECT_THAT(get("/api/v1/robots/anna/trajectory?format=xml").detail(),
              HasSubstr("allowed: json, csv, tum"));
  EXPECT_EQ(get("/api/v1/robots/anna/trajectory?kind=predicted").status, 422);
  EXPECT_EQ(get("/api/v1/robots/anna/trajectory?from=9&to=8").status, 422);
}

TEST_F(Routes, QueryParametersAreRefusedByNameWithTheirValueAndRange) {
  ASSERT_TRUE(rig_.track(1));
  struct Case {
    const char* target;
    const char* words;
  };
  const Case cases[] = {
      {"/api/v1/robots/anna/pose?at=soon", "at is 'soon', allowed: now, or Unix seconds, 0 to 7258118400"},
      {"/api/v1/robots/anna/pose?at=nan", "at is 'nan'"},
      {"/api/v1/robots/anna/pose?at=inf", "at is 'inf'"},
      {"/api/v1/robots/anna/pose?at=", "at is ''"},
      {"/api/v1/robots/anna/pose?at=-1", "at is '-1', allowed: now, or Unix seconds, 0 to 7258118400"},
      {"/api/v1/robots/anna/pose?at=Now", "at is 'Now', allowed: now, or"},
      {"/api/v1/poses?at=now ", "at is 'now ', allowed: now, or"},
      {"/api/v1/robots/anna/trajectory?to=now", "to is 'now', allowed: Unix seconds, 0 to"},
      {"/api/v1/robots/anna/pose?at=1e300", "at is '1e300'"},
      {"/api/v1/robots/anna/pose?at=1&at=2", "at is given more than once"},
      {"/api/v1/robots/anna/pose?kind=guessed",
       "kind is 'guessed', allowed: measured, filtered, smoothed, predicted"},
      {"/api/v1/robots/anna/pose?knid=measured", "'knid' is no parameter here, allowed: at, kind"},
      {"/api/v1/robots?limit=0", "limit is '0', allowed: a whole number from 1 to 1000"},
      {"/api/v1/robots?limit=1001", "limit is '1001'"},
      {"/api/v1/robots?limit=2.5", "limit is '2.5'"},
      {"/api/v1/poses?offset=-1", "offset is '-1'"},
      {"/api/v1/robots/anna/trajectory?from=x", "from is 'x'"},
      {"/api/v1/cameras/ceiling/snapshot.jpg?width=63",
       "width is '63', allowed: a whole number from 64 to 4096"},
      {"/api/v1/cameras/ceiling/snapshot.jpg?width=4097", "width is '4097'"},
      {"/api/v1/cameras/ceiling/snapshot.jpg?width=0", "width is '0'"},
      {"/api/v1/cameras/ceiling/snapshot.jpg?width=100.5", "width is '100.5'"},
      {"/api/v1/cameras/ceiling/snapshot.jpg?overlay=maybe", "overlay is 'maybe', allowed: true, false"},
      {"/readyz?verbose", "'verbose' is no parameter here, allowed: none"},
  };
  for (const Case& c : cases) {
    const Answer answer = get(c.target);
    EXPECT_EQ(answer.status, 400) << c.target;
    EXPECT_EQ(answer.type, "application/problem+json") << c.target;
    EXPECT_THAT(answer.detail(), HasSubstr(c.words)) << c.target;
  }
}

cv::Mat decoded(const Answer& answer) {
  const std::vector<unsigned char> bytes(answer.body.begin(), answer.body.end());
  return cv::imdecode(bytes, cv::IMREAD_COLOR);
}

TEST_F(Routes, TheSnapshotIsAPictureOfTheWidthThatWasAskedFor) {
  EXPECT_EQ(get("/api/v1/cameras/ceiling/snapshot.jpg").status, 503) << "before the first frame";
  ASSERT_TRUE(rig_.track(2));
  const Answer answer = get("/api/v1/cameras/ceiling/snapshot.jpg");
  EXPECT_EQ(answer.type, "image/jpeg");
  EXPECT_EQ(answer.headers.at("Skylight-Captured"), "1700000000.033000");
  EXPECT_EQ(decoded(answer).size(), cv::Size(320, 240));
  for (const char* overlay : {"", "&overlay=true", "&overlay=false"}) {
    for (const int width : {64, 160, 333, 1000}) {
      const cv::Mat image =
          decoded(get("/api/v1/cameras/ceiling/snapshot.jpg?width=" + std::to_string(width) + overlay));
      EXPECT_EQ(image.cols, width) << overlay;
      EXPECT_NEAR(image.rows, width * 0.75, 1.0) << overlay;
    }
  }
}

TEST_F(Routes, TheOverlayIsDrawnOnTheRobotAndNotIntoTheFrame) {
  ASSERT_TRUE(rig_.track(2));
  const cv::Mat before = rig_.pipeline->snapshot()->cameras[0].image.clone();
  const cv::Mat plain = decoded(get("/api/v1/cameras/ceiling/snapshot.jpg?overlay=false"));
  const cv::Mat drawn = decoded(get("/api/v1/cameras/ceiling/snapshot.jpg"));
  cv::Mat difference;
  cv::absdiff(plain, drawn, difference);
  const Pose2 truth = rig_.scene.pictures[0].pose;
  const Pixel centre = rig_.scene.pixel(truth.x, truth.y, 0.1);
  const cv::Rect robot(static_cast<int>(centre.x()) - 35, static_cast<int>(centre.y()) - 35, 70, 70);
  EXPECT_GT(cv::norm(difference(robot), cv::NORM_INF), 60.0);
  EXPECT_LT(cv::norm(difference(cv::Rect(0, 0, 60, 60)), cv::NORM_INF), 10.0) << "nothing in the corner";
  EXPECT_EQ(cv::norm(before, rig_.pipeline->snapshot()->cameras[0].image, cv::NORM_INF), 0.0);
}

TEST_F(Routes, CamerasAreListedWithTheirCounts) {
  ASSERT_TRUE(rig_.track(3));
  const Json list = get("/api/v1/cameras").json();
  ASSERT_EQ(list["total"], 1);
  EXPECT_EQ(list["items"][0], get("/api/v1/cameras/ceiling").json());
  EXPECT_EQ(list["items"][0]["frames"], 3);
  EXPECT_EQ(list["items"][0]["captured"], 1'700'000'000.066);
}

TEST_F(Routes, AnAppearanceIsCutFromTheNewestFrameByABox) {
  const auto boxed = [&](const std::string& box) {
    return call(
        "POST", "/api/v1/appearances",
        R"({"id": "cut", "surface_height_m": 0.1, "cut_from_frame": {"camera": "ceiling", "box_px": )" + box +
            R"(, "yaw_rad": 0.4}})");
  };
  EXPECT_EQ(boxed("[100, 100, 40, 40]").status, 409) << "no frame yet";
  ASSERT_TRUE(rig_.track(2));
  const Pose2 truth = rig_.scene.pictures[0].pose;
  const Pixel centre = rig_.scene.pixel(truth.x, truth.y, 0.1);
  // 49 pixels to either side, the middle one at the robot's centre.
  const std::string box = Json::array({centre.x() - 24.0, centre.y() - 24.0, 49, 49}).dump();
  const Answer added = boxed(box);
  ASSERT_EQ(added.status, 201) << added.body;
  EXPECT_NEAR(added.json()["cut_pose"]["x"], truth.x, 1e-3);
  EXPECT_NEAR(added.json()["cut_pose"]["y"], truth.y, 1e-3);
  EXPECT_EQ(added.json()["cut_pose"]["yaw"], 0.4);
  EXPECT_EQ(get("/api/v1/appearances").json()["total"], 2);
  EXPECT_EQ(boxed(box).status, 409) << "the id is taken";
  EXPECT_EQ(call("POST", "/api/v1/robots", R"({"id": "ben", "appearance": "cut"})").status, 201);
}

TEST_F(Routes, ABoxThatGivesNoPictureIsRefusedWithItsReason) {
  ASSERT_TRUE(rig_.track(2));
  struct Case {
    const char* body;
    int status;
    const char* words;
  };
  const Case cases[] = {
      {R"({"id": "a", "cut_from_frame": {"camera": "wall", "box_px": [10, 10, 20, 20]}})", 422,
       "no camera 'wall'"},
      {R"({"id": "a", "cut_from_frame": {"camera": "ceiling", "box_px": [310, 10, 20, 20]}})", 422, "box"},
      {R"({"id": "a", "cut_from_frame": {"camera": "ceiling", "box_px": [10, 10, 7, 20]}})", 422, "8 px"},
      {R"({"id": "a", "cut_from_frame": {"camera": "ceiling", "box_px": [10, 10, 20]}})", 422, "box_px"},
      {R"({"id": "a", "cut_from_frame": {"camera": "ceiling", "box_px": [-1, 10, 20, 20]}})", 422, "box_px"},
      {R"({"id": "a", "image": "/etc/passwd", "metres_per_pixel": 0.001})", 422, "cut_from_frame is needed"},
      {R"({"id": "anna", "cut_from_frame": {"camera": "ceiling", "box_px": [10, 10, 20, 20]}})", 409,
       "'anna'"},
      {R"({"id": "a"})", 422, "cut_from_frame"},
      {"{", 400, "body:1"},
  };
  for (const Case& c : cases) {
    const Answer answer = call("POST", "/api/v1/appearances", c.body);
    EXPECT_EQ(answer.status, c.status) << c.body << answer.body;
    EXPECT_THAT(answer.detail(), HasSubstr(c.words)) << c.body;
  }
}

TEST_F(Routes, ReadyOnceFramesComeAndNotAnyMoreWhenTheyStop) {
  EXPECT_EQ(get("/livez").status, 200);
  ASSERT_TRUE(rig_.wait_for([](const Snapshot& s) { return s.source == SourceState::running; }));
  Answer answer = get("/readyz");
  EXPECT_EQ(answer.status, 503);
  EXPECT_EQ(answer.detail(), "no frame yet");
  ASSERT_TRUE(rig_.track(1));
  EXPECT_EQ(get("/readyz").status, 200);
  rig_.clock.advance(std::chrono::seconds(3));
  answer = get("/readyz");
  EXPECT_EQ(answer.status, 503);
  EXPECT_THAT(answer.detail(), HasSubstr("no frame for 3.0"));
  rig_.feed->fail("the cable is out");
  ASSERT_TRUE(rig_.wait_for([](const Snapshot& s) { return s.source == SourceState::failed; }));
  answer = get("/readyz");
  EXPECT_EQ(answer.status, 503);
  EXPECT_THAT(answer.detail(), AllOf(HasSubstr("failed"), HasSubstr("the cable is out")));
  EXPECT_EQ(get("/livez").status, 200) << "it lives all the same";
}

TEST_F(Routes, ALostRobotIsAnAnswerAndNoError) {
  ASSERT_TRUE(rig_.track(2));
  rig_.clock.advance(std::chrono::seconds(3));
  const Answer answer = get("/api/v1/robots/anna/pose");
  EXPECT_EQ(answer.status, 200);
  EXPECT_TRUE(answer.json()["pose"].is_null());
  EXPECT_EQ(answer.json()["state"], "lost");
  EXPECT_EQ(answer.json()["last_seen"], 1'700'000'000.033);
  EXPECT_THAT(answer.json()["reason"].get<std::string>(), HasSubstr("old"));
}

}  // namespace
}  // namespace skylight::service::test
