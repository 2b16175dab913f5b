// Calibrations over the API: documents and their versions, and what lies on the floor.
#include <filesystem>
#include <numbers>

#include <gmock/gmock.h>

#include "tests/service/calibration/cameras.hpp"
#include "tests/service/calibration_room.hpp"
#include "tests/service/simulated_room.hpp"

namespace skylight::service::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kAt = "/calibration";

Json moved(Json document, double by_m) {
  document["map_from_camera"]["position_m"][0] =
      document["map_from_camera"]["position_m"][0].get<double>() + by_m;
  return document;
}

double x_of(const Answer& document) {
  return document.json()["map_from_camera"]["position_m"][0];
}

TEST(CalibrationRoutes, AnEditedDocumentIsInUseFromTheNextFrameAndTheRobotsPoseFollowsIt) {
  const auto scene = small_room();
  CalibrationRoom room({{"ceiling", scene.camera()}}, {robot_of(scene)});
  const Duration step = std::chrono::milliseconds(33);
  const auto measured = [&] {
    const Answer answer = room.anywhere("GET", "/robots/anna/pose?kind=measured");
    EXPECT_EQ(answer.status, 200) << answer.body;
    return answer.json()["pose"];
  };
  for (int i = 0; i < 6; ++i) room.show(scene.render(kStart).image, 0, step);
  const Json before = measured();
  EXPECT_NEAR(before["x"].get<double>(), scene.pictures[0].pose.x, 0.003);

  const Answer read = room.get(kAt);
  const Answer put = room.call("PUT", kAt, moved(read.json(), 0.04), {{"if-match", etag(read)}});
  ASSERT_EQ(put.status, 200) << put.body;
  EXPECT_EQ(put.json()["stored"], false) << "there is no file";
  EXPECT_EQ(room.get("").json()["map_from_camera"]["position_m"][0], 0.04) << "the camera's own resource";
  room.show(scene.render(kStart).image, 0, step);
  const Json after = measured();
  EXPECT_EQ(after["captured"], room.get("").json()["captured"]) << "measured in that frame";
  EXPECT_NEAR(after["x"].get<double>() - before["x"].get<double>(), 0.04, 0.001);

  const Answer restored = room.call("POST", "/calibration/restore", Json::object());
  ASSERT_EQ(restored.status, 200) << restored.body;
  EXPECT_EQ(etag(room.get(kAt)), etag(read)) << "the old one, to the letter";
  room.show(scene.render(kStart).image, 0, step);
  EXPECT_NEAR(measured()["x"].get<double>(), before["x"].get<double>(), 0.001);
}

TEST(CalibrationRoutes, ANewCalibrationBeginsTheWatchOverTheCameraAnew) {
  auto scene = small_room();
  scene.floor_speckle = 400;
  CalibrationRoom room({{"ceiling", scene.camera()}});
  const auto hold = [&] { return room.get("").json()["hold"]["state"]; };
  const cv::Mat floor = scene.render(kStart).image;
  for (int i = 0; i < 2000 && (i < 3 || hold() != "steady"); ++i) {
    room.show(floor, 0, std::chrono::milliseconds(500));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // the watch has a thread of its own
  }
  ASSERT_EQ(hold(), "steady");
  const Json document = room.get(kAt).json();
  ASSERT_EQ(room.call("PUT", kAt, moved(document, 0.1), {{"if-match", "*"}}).status, 200);
  EXPECT_EQ(hold(), "learning");
}

TEST(CalibrationRoutes, TwoWhoEditAtOnceDoNotOverwriteEachOther) {
  CalibrationRoom room({{"ceiling", small_room().camera()}});
  const Answer read = room.get(kAt);
  ASSERT_EQ(room.call("PUT", kAt, moved(read.json(), 0.1), {{"if-match", etag(read)}}).status, 200);
  const Answer late = room.call("PUT", kAt, moved(read.json(), 0.2), {{"if-match", etag(read)}});
  EXPECT_EQ(late.status, 412);
  EXPECT_THAT(late.detail(), AllOf(HasSubstr("ceiling"), HasSubstr("by now")));
  EXPECT_EQ(room.call("PUT", kAt, read.json()).status, 428);
  EXPECT_EQ(x_of(room.get(kAt)), 0.1);
  EXPECT_EQ(room.call("PUT", kAt, moved(read.json(), 0.2), {{"if-match", "*"}}).status, 200);
  EXPECT_EQ(x_of(room.get(kAt)), 0.2);
}

TEST(CalibrationRoutes, DocumentsThatAreNoneAreRefusedNamingKeyValueAndRange) {
  CalibrationRoom room({{"ceiling", small_room().camera()}});
  const Answer read = room.get(kAt);
  const auto refused = [&](const std::function<void(Json&)>& change) {
    Json document = read.json();
    change(document);
    const Answer answer = room.call("PUT", kAt, document, {{"if-match", "*"}});
    EXPECT_EQ(answer.status, 422) << answer.body;
    return answer.detail();
  };
  EXPECT_THAT(refused([](Json& d) { d["intrinsics"]["fx_px"] = -5; }),
              AllOf(HasSubstr("intrinsics.fx_px"), HasSubstr("-5"), HasSubstr("allowed")));
  EXPECT_THAT(refused([](Json& d) { d["sigmas"]["focal"] = 1; }), HasSubstr("sigmas.focal"));
  EXPECT_THAT(refused([](Json& d) { d.erase("map_from_camera"); }), HasSubstr("map_from_camera"));
  EXPECT_THAT(refused([](Json& d) { d["intrinsics"]["width_px"] = 640; }),
              AllOf(HasSubstr("640 x 240"), HasSubstr("320 x 240"), HasSubstr("ceiling")));
  EXPECT_THAT(refused([](Json& d) {
                d["map_from_camera"]["quaternion_xyzw"] = {0, 0, 0, 0.5};
              }),
              HasSubstr("length 1"));
  EXPECT_EQ(etag(room.get(kAt)), etag(read)) << "nothing has changed";
}

TEST(CalibrationRoutes, VersionsAreListedReadAndPutBackWithoutAFileToo) {
  CalibrationRoom room({{"ceiling", small_room().camera()}});
  EXPECT_EQ(room.get("/calibration/versions").json()["total"], 0);
  EXPECT_EQ(room.call("POST", "/calibration/restore", Json::object()).status, 404);
  const Json original = room.get(kAt).json();
  for (const double by : {0.1, 0.2, 0.3})
    ASSERT_EQ(room.call("PUT", kAt, moved(original, by), {{"if-match", "*"}}).status, 200);
  const Json versions = room.get("/calibration/versions").json();
  EXPECT_EQ(versions["total"], 3);
  EXPECT_EQ(versions["stored"], false);
  EXPECT_EQ(x_of(room.get("/calibration/versions/2")), 0.1);
  EXPECT_EQ(room.get("/calibration/versions/7").status, 404);
  EXPECT_EQ(room.get("/calibration/versions/last").status, 404);
  EXPECT_EQ(room.call("POST", "/calibration/restore", {{"version", 9}}).status, 404);
  const Answer restored = room.call("POST", "/calibration/restore", {{"version", 2}});
  ASSERT_EQ(restored.status, 200);
  EXPECT_EQ(restored.json()["restored"], 2);
  EXPECT_EQ(x_of(room.get(kAt)), 0.1);
  EXPECT_EQ(x_of(room.get("/calibration/versions/4")), 0.3) << "what was in use is a version now";
}

TEST(CalibrationRoutes, ACameraWithAFileKeepsItsCalibrationThereFromTheConfigurationsOn) {
  const RoomFolder folder;
  const auto file = folder.path / "new" / "ceiling.json";
  const CameraModel camera = small_room().camera();
  const auto in_use = std::make_shared<const CalibrationInUse>(
      CalibrationInUse{.document = calibration_of(camera, {}), .file = file});
  CalibrationRoom room({{"ceiling", camera, in_use}});
  const Answer read = room.get(kAt);
  const Answer put = room.call("PUT", kAt, moved(read.json(), 0.1), {{"if-match", "*"}});
  ASSERT_EQ(put.status, 200) << put.body;
  EXPECT_EQ(put.json()["stored"], true);
  EXPECT_EQ(put.json()["version"], 1);
  EXPECT_EQ(tag_of(read_calibration(file)), etag(room.get(kAt))) << "a restart finds what is in use";
  EXPECT_EQ(etag(room.get("/calibration/versions/1")), etag(read)) << "also what no file said before";
  EXPECT_EQ(room.call("POST", "/calibration/restore", Json::object()).status, 200);
  EXPECT_EQ(tag_of(read_calibration(file)), etag(read));

  std::filesystem::remove_all(folder.path / "new");
  std::filesystem::create_directories(file);  // a folder where the file should be
  const Answer failed = room.call("PUT", kAt, moved(read.json(), 0.5), {{"if-match", "*"}});
  EXPECT_EQ(failed.status, 500);
  EXPECT_THAT(failed.detail(), AllOf(HasSubstr("ceiling.json"), testing::Not(HasSubstr("/new"))));
  EXPECT_EQ(etag(room.get(kAt)), etag(read)) << "not in use either";
}

TEST(CalibrationRoutes, WhereOneOfTwoCamerasCannotBeStoredNeitherIsChanged) {
  const RoomFolder folder;
  const CameraModel camera = small_room().camera();
  const auto kept_in = [&](const char* name) {
    return std::make_shared<const CalibrationInUse>(
        CalibrationInUse{.document = calibration_of(camera, {}), .file = folder.path / name});
  };
  CalibrationRoom room(
      {{"ceiling", camera, kept_in("ceiling.json")}, {"door", camera, kept_in("door.json")}});
  std::filesystem::create_directories(folder.path / "door.json");  // a folder where the file should be
  const std::string before = etag(room.get(kAt));
  const Answer failed = room.call("POST", "/calibration/extrinsics",
                                  {{"map", {{"origin_px", {100, 100}}, {"x_axis_px", {200, 100}}}}});
  EXPECT_EQ(failed.status, 500) << failed.body;
  EXPECT_THAT(failed.detail(), HasSubstr("door"));
  EXPECT_EQ(etag(room.get(kAt)), before);
  EXPECT_EQ(tag_of(read_calibration(folder.path / "ceiling.json")), before) << "after a restart too";
}

TEST(CalibrationRoutes, AVersionThatSomebodySpoiltIsPassedOver) {
  const RoomFolder folder;
  const CameraModel camera = small_room().camera();
  CalibrationRoom room({{"ceiling", camera,
                         std::make_shared<const CalibrationInUse>(CalibrationInUse{
                             .document = calibration_of(camera, {}), .file = folder.path / "a.json"})}});
  const Json original = room.get(kAt).json();
  for (const double by : {0.1, 0.2, 0.3})
    ASSERT_EQ(room.call("PUT", kAt, moved(original, by), {{"if-match", "*"}}).status, 200);
  folder.write("a.3.json", "{}");
  EXPECT_EQ(room.get("/calibration/versions").json()["total"], 2);
  EXPECT_EQ(room.get("/calibration/versions/3").status, 404);
  const Answer restored = room.call("POST", "/calibration/restore", Json::object());
  ASSERT_EQ(restored.status, 200) << restored.body;
  EXPECT_EQ(restored.json()["restored"], 2);
  EXPECT_EQ(restored.json()["version"], 4);
  EXPECT_EQ(x_of(room.get(kAt)), 0.1);
}

// Points where a camera sees them that hangs elsewhere than the service believes.
Json clicked_points(const CameraModel& truth, double flip = 1.0) {
  Json points = Json::array();
  for (const double x : {-0.6, 0.0, 0.5}) {
    for (const double y : {-0.4, 0.1, 0.4}) {
      const Pixel at = truth.pixel_from_map({x, y, 0.0}).value();
      points.push_back({{"u_px", at.x()}, {"v_px", at.y()}, {"x_m", x}, {"y_m", flip * y}});
    }
  }
  return points;
}

CameraModel turned_camera() {
  const CameraModel believed = small_room().camera();
  Eigen::Isometry3d pose = believed.map_from_camera();
  pose.translation() += Eigen::Vector3d(0.02, -0.01, 0.03);
  pose.linear() = Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitX()).toRotationMatrix() * pose.linear();
  return {believed.intrinsics(), pose};
}

TEST(CalibrationRoutes, ClickedPointsSayWhereTheCameraHangsAndWhatWouldChange) {
  CalibrationRoom room({{"ceiling", small_room().camera()}});
  const CameraModel truth = turned_camera();
  Json body{{"points", clicked_points(truth)}, {"apply", false}};
  const std::string before = etag(room.get(kAt));
  const Answer looked = room.call("POST", "/calibration/extrinsics", body);
  ASSERT_EQ(looked.status, 200) << looked.body;
  const Json camera = looked.json()["cameras"][0];
  EXPECT_NEAR(camera["change"]["shift_mm"].get<double>(),
              1e3 * std::sqrt(0.02 * 0.02 + 0.01 * 0.01 + 0.03 * 0.03), 0.01);
  EXPECT_NEAR(camera["change"]["turn_deg"].get<double>(), 0.03 * 180.0 / std::numbers::pi, 1e-3);
  EXPECT_GT(camera["change"]["floor_mm"].get<double>(), 20.0);
  EXPECT_EQ(camera["fit"]["points"].size(), 9U);
  EXPECT_LT(camera["fit"]["rms_px"].get<double>(), 1e-3);
  EXPECT_GT(camera["sigmas"]["position_m"][2].get<double>(), 1e-4);
  EXPECT_EQ(looked.json()["applied"], false);
  EXPECT_EQ(etag(room.get(kAt)), before) << "only looked at";

  body.erase("apply");
  ASSERT_EQ(room.call("POST", "/calibration/extrinsics", body).status, 200);
  const Json in_use = room.get(kAt).json();
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(in_use["map_from_camera"]["position_m"][static_cast<std::size_t>(i)].get<double>(),
                truth.map_from_camera().translation()[i], 1e-5);
  EXPECT_EQ(in_use["extrinsics_made"]["from"], "9 points");
  const Json again = room.call("POST", "/calibration/extrinsics", body).json();
  EXPECT_LT(again["cameras"][0]["change"]["shift_mm"].get<double>(), 0.01);
}

TEST(CalibrationRoutes, WhatIsSaidOfPointsAndHeightCounts) {
  CalibrationRoom room({{"ceiling", small_room().camera()}});
  const CameraModel truth = turned_camera();
  const auto sigma_of_height = [&](Json body) {
    body["points"] = clicked_points(truth);
    body["apply"] = false;
    const Answer answer = room.call("POST", "/calibration/extrinsics", body);
    EXPECT_EQ(answer.status, 200) << answer.body;
    return answer.json()["cameras"][0]["sigmas"]["position_m"][2].get<double>();
  };
  const double plain = sigma_of_height(Json::object());
  EXPECT_LT(sigma_of_height({{"click_sigma_px", 0.1}}), 0.5 * plain);
  EXPECT_GT(sigma_of_height({{"point_sigma_m", 0.05}}), 2.0 * plain);
  const double height = truth.map_from_camera().translation().z();
  EXPECT_LE(sigma_of_height({{"height_m", height}, {"height_sigma_m", 0.0005}}), 0.0005);
}

// Were the refined lens where the next calibration begins, the same points would count twice.
TEST(CalibrationRoutes, ACalibrationThatIsRepeatedBeginsFromTheLensAsItWasBefore) {
  const CameraModel believed = small_room().camera();
  CalibrationSigmas sigmas;
  sigmas.focal_px = 5.0;
  const auto in_use = std::make_shared<const CalibrationInUse>(
      CalibrationInUse{.document = calibration_of(believed, skylight::camera_uncertainty(sigmas))});
  CalibrationRoom room({{"ceiling", believed, in_use}});
  const Json body{{"points", clicked_points(turned_camera())}};
  ASSERT_EQ(room.call("POST", "/calibration/extrinsics", body).status, 200);
  const Json once = room.get(kAt).json();
  EXPECT_LT(once["sigmas"]["focal_px"][0].get<double>(), 5.0) << "the points tell of the lens too";
  ASSERT_EQ(room.call("POST", "/calibration/extrinsics", body).status, 200);
  const Json twice = room.get(kAt).json();
  EXPECT_EQ(twice["intrinsics"], once["intrinsics"]);
  EXPECT_EQ(twice["sigmas"], once["sigmas"]);
}

TEST(CalibrationRoutes, PointsThatContradictThemselvesAreNamed) {
  CalibrationRoom room({{"ceiling", small_room().camera()}});
  const auto refused = [&](const Json& body) {
    const Answer answer = room.call("POST", "/calibration/extrinsics", body);
    EXPECT_EQ(answer.status, 422) << answer.body;
    return answer.detail();
  };
  const Json points = clicked_points(small_room().camera());
  EXPECT_THAT(refused(Json::object()), HasSubstr("tags, sheets, points, or map"));
  EXPECT_THAT(refused({{"points", {points[0], points[1], points[5]}}}),
              AllOf(HasSubstr("ceiling"), HasSubstr("at least 4 points")));
  EXPECT_THAT(refused({{"points", clicked_points(small_room().camera(), -1.0)}}), HasSubstr("mirrored"));
  Json line = Json::array();
  for (int i = 0; i < 6; ++i)
    line.push_back({{"u_px", 40 + 40 * i}, {"v_px", 100}, {"x_m", 0.24 * i}, {"y_m", 0.0}});
  EXPECT_THAT(refused({{"points", line}}), HasSubstr("line"));
  Json outside = points;
  outside[3]["u_px"] = 4000;
  EXPECT_THAT(refused({{"points", outside}}), HasSubstr("outside the picture of 320 x 240"));
  EXPECT_THAT(refused({{"tags", {{{"family", "99h9"}, {"id", 1}, {"x_m", 0}, {"y_m", 0}, {"size_m", 0.2}}}}}),
              HasSubstr("99h9"));
  Json elsewhere = points;
  elsewhere[2]["camera"] = "door";
  EXPECT_THAT(refused({{"points", elsewhere}}), AllOf(HasSubstr("points[2].camera"), HasSubstr("door")));
  EXPECT_THAT(refused({{"points", points}, {"map", {{"origin_px", {1, 1}}, {"x_axis_px", {9, 9}}}}}),
              HasSubstr("stands alone"));
  const Answer unseen =
      room.call("POST", "/calibration/extrinsics",
                {{"tags", {{{"family", "36h11"}, {"id", 1}, {"x_m", 0}, {"y_m", 0}, {"size_m", 0.2}}}}});
  EXPECT_EQ(unseen.status, 503) << "there is no frame yet";
}

TEST(CalibrationRoutes, TwoClickedPointsGiveTheMapOtherAxesForAllCameras) {
  const CameraModel camera = small_room().camera();
  Eigen::Isometry3d beside = camera.map_from_camera();
  beside.translation().x() += 1.0;
  CalibrationRoom room({{"ceiling", camera}, {"door", CameraModel(camera.intrinsics(), beside)}});
  const Pixel origin = camera.pixel_from_map({0.2, 0.1, 0.0}).value();
  const Pixel along = camera.pixel_from_map({0.2, 0.4, 0.0}).value();
  const Answer answer =
      room.call("POST", "/calibration/extrinsics",
                {{"map", {{"origin_px", {origin.x(), origin.y()}}, {"x_axis_px", {along.x(), along.y()}}}}});
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.json()["cameras"].size(), 2U);
  const auto snapshot = room.pipeline->snapshot();
  const auto floor_at = [&](std::size_t index, const Pixel& pixel) {
    return snapshot->cameras[index].model->plane_from_pixel(pixel, 0.0).value();
  };
  EXPECT_LT((floor_at(0, origin) - Eigen::Vector2d(0.0, 0.0)).norm(), 1e-9);
  EXPECT_LT((floor_at(0, along) - Eigen::Vector2d(0.3, 0.0)).norm(), 1e-9);
  // (1.2, 0.1) of the old map, 1 m from the origin along the old x axis, lies at y = -1 of the new one.
  EXPECT_LT((floor_at(1, origin) - Eigen::Vector2d(0.0, -1.0)).norm(), 1e-9);
  const Answer sky = room.call("POST", "/calibration/extrinsics",
                               {{"map", {{"origin_px", {400, 10}}, {"x_axis_px", {5, 5}}}}});
  EXPECT_EQ(sky.status, 422);
  EXPECT_THAT(sky.detail(), HasSubstr("map.origin_px"));
}

// Two cameras of 640 x 480 px beside each other; only the left one sees a tag whose place was measured, both
// see the sheet that nobody measured.
TEST(CalibrationRoutes, OneSheetThatTwoCamerasSeeJoinsThem) {
  auto left = skylight::test::small_camera();
  left.map_from_camera.translation() = Eigen::Vector3d(-0.6, 0.0, 2.5);
  auto right = left;
  right.map_from_camera.translation() = Eigen::Vector3d(0.9, 0.1, 2.6);
  const auto lying = [](double x, double y, double yaw) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() << x, y, 0.0;
    pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return pose;
  };
  const Eigen::Isometry3d sheet = lying(0.12, -0.2, 0.4);
  std::vector<skylight::test::Print> prints{skylight::test::tag_print(1, 0.3, lying(-1.4, 0.5, 0.0)),
                                            skylight::test::tag_print(2, 0.3, lying(-1.3, -0.6, 1.0))};
  Json on_sheet = Json::array();
  for (int i = 0; i < 4; ++i) {
    const double x = i % 2 == 0 ? -0.25 : 0.25;
    const double y = i / 2 == 0 ? -0.4 : 0.4;
    prints.push_back(skylight::test::tag_print(10 + i, 0.25, sheet * lying(x, y, 0.0)));
    on_sheet.push_back({{"id", 10 + i}, {"x_m", x}, {"y_m", y}, {"size_m", 0.25}});
  }
  const auto model = [](const sim::CameraParameters& truth, double off) {
    Eigen::Isometry3d believed = truth.map_from_camera;
    believed.translation() += Eigen::Vector3d(off, -off, off);
    return CameraModel(skylight::test::intrinsics_of(truth), believed);
  };
  CalibrationRoom room({{"ceiling", model(left, 0.1)}, {"door", model(right, -0.2)}});
  room.show(skylight::test::BoardScene{.camera = left, .seed = 3, .prints = prints}.render(), 0);
  room.show(skylight::test::BoardScene{.camera = right, .seed = 4, .prints = prints}.render(), 1);
  const Json placed{
      {{"id", 1}, {"x_m", -1.4}, {"y_m", 0.5}, {"size_m", 0.3}},
      {{"id", 2}, {"x_m", -1.3}, {"y_m", -0.6}, {"yaw_deg", 180.0 / std::numbers::pi}, {"size_m", 0.3}}};
  const Json sheets{{{"name", "joint"}, {"tags", on_sheet}}};
  const Answer answer = room.anywhere(
      "POST", "/calibration/extrinsics",
      {{"cameras", {"ceiling", "door"}}, {"tags", placed}, {"place_sigma_m", 0.0005}, {"sheets", sheets}});
  ASSERT_EQ(answer.status, 200) << answer.body;
  const auto snapshot = room.pipeline->snapshot();
  const auto error_m = [&](std::size_t index, const sim::CameraParameters& truth) {
    return (snapshot->cameras[index].model->map_from_camera().translation() -
            truth.map_from_camera.translation())
        .norm();
  };
  const Json hidden{{{"id", 7}, {"x_m", 0}, {"y_m", 0}, {"size_m", 0.3}}};
  const Answer blank = room.call("POST", "/calibration/extrinsics", {{"tags", hidden}});
  EXPECT_EQ(blank.status, 422);
  EXPECT_THAT(blank.detail(), AllOf(HasSubstr("at least 4 points"), HasSubstr("not seen: tag 36h11:7")));

  EXPECT_LT(error_m(0, left), 0.01);
  EXPECT_LT(error_m(1, right), 0.02) << "it sees no tag whose place was measured";
  const Json found = answer.json()["sheets"].back();
  EXPECT_EQ(found["name"], "sheet joint");
  EXPECT_NEAR(found["x_m"].get<double>(), 0.12, 0.005);
  EXPECT_NEAR(found["yaw_deg"].get<double>(), 0.4 * 180.0 / std::numbers::pi, 0.5);

  const Answer apart =
      room.anywhere("POST", "/calibration/extrinsics", {{"cameras", {"ceiling", "door"}}, {"tags", placed}});
  EXPECT_EQ(apart.status, 422) << apart.body;
  EXPECT_THAT(apart.detail(), HasSubstr("door"));
  const Answer nobody = room.anywhere("POST", "/calibration/extrinsics", {{"cameras", {"attic"}}});
  EXPECT_EQ(nobody.status, 422);
  EXPECT_THAT(nobody.detail(), HasSubstr("attic"));
}

}  // namespace
}  // namespace skylight::service::test
