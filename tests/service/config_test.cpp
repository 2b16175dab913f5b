#include "service/config.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "settings/fields.hpp"

namespace skylight::service {
namespace {

using nlohmann::json;
using settings::Error;
using ::testing::HasSubstr;

const std::filesystem::path deploy_folder = std::filesystem::path(SKYLIGHT_SOURCE_DIR) / "deploy";

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

std::string refusal(const std::string& text) {
  try {
    settings::read<Config>(settings::parse(text, "my.json"));
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

std::string refusal_of(const ConfigLayers& layers) {
  try {
    load_config(layers);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Config, TheDefaultsAreTheSimulatorOnLoopback) {
  const Config config = load_config({});
  EXPECT_TRUE(std::holds_alternative<SimulatorSource>(config.source.input));
  EXPECT_EQ(config.server.host, "127.0.0.1");
  EXPECT_EQ(config.server.port, 8080);
  EXPECT_EQ(config.history.max_age_s, 600.0);
  EXPECT_EQ(config.prediction.horizon_s, 2.0);
  EXPECT_EQ(std::get<MotionFilterConfig>(config.tracker.method.filter.kind).smoothing_lag_s, 1.0);
}

TEST(Config, TheSampleLoadsAndShowsTheDefaults) {
  const Config sample = load_config({.file = deploy_folder / "skylight.sample.json"});
  const json shown = json::parse(config_json(sample));
  const json defaults = json::parse(config_json(Config{}));
  for (const char* section : {"server", "tracker", "history", "prediction", "log"}) {
    EXPECT_EQ(shown[section], defaults[section]) << section;
  }
}

TEST(Config, TheSampleHasEveryKeyOfTheSchema) {
  const std::string sample = text_of(deploy_folder / "skylight.sample.json");
  std::size_t keys = 0;
  const auto expect_shown = [&](const json& object) {
    const json properties = object.value("properties", json::object());
    for (const auto& [key, property] : properties.items()) {
      EXPECT_THAT(sample, HasSubstr("\"" + key + "\":"));
      ++keys;
      if (property.contains("const")) {
        EXPECT_THAT(sample, HasSubstr("\"" + key + "\": " + property["const"].dump()));
      }
    }
  };
  const json schema = json::parse(config_schema());
  for (const auto& [name, definition] : schema["$defs"].items()) {
    expect_shown(definition);
    const json branches = definition.value("oneOf", json::array());
    for (const json& branch : branches) expect_shown(branch);
  }
  EXPECT_GT(keys, 60u);
}

TEST(Config, ThePublishedSchemaIsTheOneThatTheCodeMakes) {
  EXPECT_EQ(text_of(deploy_folder / "skylight.schema.json"), config_schema())
      << "renew it: build/release/tests/service/skylight_config_samples --schema > "
         "deploy/skylight.schema.json";
}

TEST(Config, WhatIsPrintedIsReadBack) {
  const Config sample = load_config({.file = deploy_folder / "skylight.sample.json"});
  const std::string printed = config_json(sample);
  EXPECT_EQ(config_json(settings::read<Config>(settings::parse(printed, "printed"))), printed);
}

TEST(Config, LayersStandOverEachOther) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "config_test_layers.json";
  std::ofstream(file) << R"({"server": {"port": 1, "threads": 3, "max_body_bytes": 2000}})";
  const Config config =
      load_config({.file = file,
                   .environment = {{"SKYLIGHT_SERVER__PORT", "2"}, {"SKYLIGHT_SERVER__THREADS", "4"}},
                   .flags = {{"server.port=3"}, {"server.port=5", "--port"}}});
  EXPECT_EQ(config.server.port, 5);
  EXPECT_EQ(config.server.threads, 4u);
  EXPECT_EQ(config.server.max_body_bytes, 2000u);
  EXPECT_EQ(config.server.host, "127.0.0.1");
  std::filesystem::remove(file);
}

TEST(Config, VariablesReachEveryDepth) {
  const Config config =
      load_config({.environment = {{"SKYLIGHT_ROBOTS__0__ID", "7"},
                                   {"SKYLIGHT_ROBOTS__0__FILTER__TYPE", "window"},
                                   {"SKYLIGHT_ROBOTS__0__FILTER__WINDOW_SIZE", "8"},
                                   {"SKYLIGHT_SERVER__ALLOWED_HOSTS", "[\"a.lab\", \"b.lab\"]"}}});
  EXPECT_EQ(config.robots.at(0).id, "7");
  EXPECT_EQ(std::get<WindowFilterConfig>(config.robots.at(0).method.filter.kind).window_size, 8);
  EXPECT_EQ(config.server.allowed_hosts.at(1), "b.lab");
}

TEST(Config, ErrorsNameTheLayer) {
  EXPECT_EQ(refusal_of({.environment = {{"SKYLIGHT_SERVER__PORT", "70000"}}}),
            "SKYLIGHT_SERVER__PORT: server.port: 70000 is out of range, allowed 0 to 65535");
  EXPECT_EQ(
      refusal_of({.environment = {{"SKYLIGHT_SERVER_PORT", "1"}}}),
      "SKYLIGHT_SERVER_PORT: names no key: write the path with two underscores between its steps, as in "
      "SKYLIGHT_SERVER__PORT");
  EXPECT_EQ(refusal_of({.environment = {{"SKYLIGHT_SERVR__PORT", "1"}}}),
            "SKYLIGHT_SERVR__PORT: servr: unknown key, did you mean \"server\"?");
  EXPECT_EQ(refusal_of({.environment = {{"SKYLIGHT___", "1"}}}),
            "SKYLIGHT___: \"\" is no key path such as server.port or robots[0].id");
  EXPECT_EQ(refusal_of({.flags = {{"tracker.filter.gate=0"}}}),
            "--set tracker.filter.gate: 0 is out of range, allowed 1 to 1000");
  EXPECT_EQ(refusal_of({.flags = {{"server.port=x", "--port"}}}),
            "--port: server.port: expected a whole number, found the string \"x\"");
  EXPECT_EQ(refusal_of({.file = "/nowhere/my.json"}),
            "/nowhere/my.json: cannot be read: No such file or directory");
}

TEST(Config, TheEnvironmentOfThisProcessIsRead) {
  ASSERT_EQ(setenv("SKYLIGHT_LOG__LEVEL", "warn", 1), 0);
  ASSERT_EQ(setenv("SKYLIGHT_SHARED_DATA", "/somewhere", 1), 0);
  const auto variables = skylight_environment();
  EXPECT_EQ(variables.at("SKYLIGHT_LOG__LEVEL"), "warn");
  EXPECT_EQ(variables.count("SKYLIGHT_SHARED_DATA"), 0u);
  EXPECT_EQ(load_config({.environment = {{"SKYLIGHT_LOG__LEVEL", "warn"}}}).log.level, LogLevel::warn);
  unsetenv("SKYLIGHT_LOG__LEVEL");
}

TEST(Config, PathsAreRelativeToTheFile) {
  const Config config = load_config({.file = deploy_folder / "skylight.sample.json"});
  EXPECT_EQ(std::get<VideoSource>(config.source.input).path, (deploy_folder / "hall.mp4").string());
  EXPECT_EQ(config.appearances.at(0).image.value(), (deploy_folder / "waffle.png").string());
  const Config named = load_config({.flags = {{"source.scenario=circle"}}});
  EXPECT_EQ(std::get<SimulatorSource>(named.source.input).scenario, "circle");
  const Config moved =
      load_config({.file = deploy_folder / "skylight.sample.json",
                   .flags = {{"source={\"scenario\": \"my/room.json\"}"}, {"appearances[0].image=/a.png"}}});
  EXPECT_EQ(std::get<SimulatorSource>(moved.source.input).scenario,
            (deploy_folder / "my/room.json").string());
  EXPECT_EQ(moved.appearances.at(0).image.value(), "/a.png");
}

TEST(Config, ARobotTakesWhatItDoesNotSayFromTheTracker) {
  const Config config = settings::read<Config>(settings::parse(
      R"({"robots": [{"id": "a", "filter": {"alpha": 0.2}}, {"id": "b"}],
          "tracker": {"detector": "homography", "filter": {"type": "window", "window_size": 20}, "homography": {"drop": "ray"}}})",
      "my.json"));
  const RobotSpec a = robot_spec(config.robots.at(0), nullptr);
  const auto filter_of = [](const RobotSpec& spec) { return std::get<WindowFilterConfig>(spec.filter); };
  EXPECT_EQ(filter_of(a).alpha, 0.2);
  EXPECT_EQ(filter_of(a).window_size, 20);
  EXPECT_EQ(a.detector, DetectorKind::homography);
  EXPECT_EQ(a.homography.drop, FloorDrop::ray);
  EXPECT_EQ(filter_of(robot_spec(config.robots.at(1), nullptr)).alpha, WindowFilterConfig{}.alpha);
}

constexpr const char* kCamera =
    R"({"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [1000, 800]}})";

struct Refused {
  std::string text;
  std::string what;
};

const Refused refused_texts[] = {
    {R"({"server": {"host": "0.0.0.0"}})",
     "my.json:1: server.host: \"0.0.0.0\" can be reached from other machines: that needs "
     "server.token_sha256"},
    {R"({"server": {"host": "127.0.0.1.evil.example"}})",
     "my.json:1: server.host: \"127.0.0.1.evil.example\" can be reached from other machines: that needs "
     "server.token_sha256"},
    {R"({"server": {"token_sha256": "abc"}})",
     "my.json:1: server.token_sha256: \"abc\" is not 64 hex digits (0-9, a-f)"},
    {R"({"server": {"token": "x"}})",
     "my.json:1: server.token: unknown key, known are host, port, threads, max_body_bytes, token_sha256, "
     "allowed_hosts "
     "and allowed_origins"},
    {R"({"source": {"type": "video"}})",
     "my.json:1: source.path: is missing: Relative to the configuration file's folder."},
    {R"({"source": {"type": "webcam"}})",
     "my.json:1: source.type: \"webcam\" is not one of simulator, video, folder or cameras"},
    {R"({"source": {"type": "video", "path": "a.mp4", "camera": "c"}})",
     "my.json:1: source.camera: no camera in cameras has the id \"c\""},
    {"{\"cameras\": [" + std::string(kCamera) + ",\n" + kCamera + "]}",
     "my.json:2: cameras[1].id: \"c\" is the id of cameras[0] too"},
    {R"({"cameras": [{"id": "c"}]})",
     "my.json:1: cameras[0]: needs one of calibration, map_from_camera or overhead"},
    {R"({"cameras": [{"id": "c/d"}]})",
     "my.json:1: cameras[0].id: \"c/d\" is not an id: 1 to 64 letters, digits, _ and -"},
    {R"({"cameras": [{"id": "c", "overhead": {"height_m": 4}}]})",
     "my.json:1: cameras[0].intrinsics: is missing, and there is no overhead.metres_per_pixel"},
    {R"({"cameras": [{"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.01}}]})",
     "my.json:1: cameras[0].overhead: metres_per_pixel and size_px go together"},
    {R"({"cameras": [{"id": "c", "map_from_camera": {"position_m": [0, 0, 4]}}]})",
     "my.json:1: cameras[0].map_from_camera: needs one of quaternion_xyzw or rpy_rad"},
    {R"({"cameras": [{"id": "c", "map_from_camera": {"position_m": [0, 0, 4], "quaternion_xyzw": [0, 0, 0, 0.9]}}]})",
     "my.json:1: cameras[0].map_from_camera.quaternion_xyzw: has the length 0.900000, allowed 0.999 to "
     "1.001"},
    {R"({"cameras": [{"id": "c", "map_from_camera": {"position_m": [0, 0, 4], "rpy_rad": [180, 0, 0]}}]})",
     "my.json:1: cameras[0].map_from_camera.rpy_rad[0]: 180 is out of range, allowed -6.3 to 6.3 rad"},
    {R"({"appearances": [{"id": "a"}]})", "my.json:1: appearances[0]: needs one of image or cut_from_frame"},
    {R"({"appearances": [{"id": "a", "image": "a.png"}]})",
     "my.json:1: appearances[0].metres_per_pixel: is missing: the scale of image"},
    {R"({"appearances": [{"id": "a", "image": "a.png", "metres_per_pixel": 0.001,)"
     "\n"
     R"("cut_from_frame": {"camera": "c", "box_px": [0, 0, 9, 9]}}]})",
     "my.json:2: appearances[0].cut_from_frame: contradicts image: give only one of image or cut_from_frame"},
    {R"({"appearances": [{"id": "a", "cut_from_frame": {"camera": "c", "box_px": [0, 0, 7, 9]}}]})",
     "my.json:1: appearances[0].cut_from_frame.box_px: is less than 8 px wide or high"},
    {"{\"cameras\": [" + std::string(kCamera) +
         "],\n\"appearances\": [{\"id\": \"a\", \"cut_from_frame\": {\"camera\": \"d\", \"box_px\": [0, 0, "
         "9, 9]}}]}",
     "my.json:2: appearances[0].cut_from_frame.camera: no camera in cameras has the id \"d\""},
    {R"({"robots": [{"id": "r", "appearance": "a"}]})",
     "my.json:1: robots[0].appearance: no appearance in appearances has the id \"a\""},
    {"{\"cameras\": [" + std::string(kCamera) +
         R"(], "source": {"type": "video", "path": "a", "camera": "c"}, "robots": [{"id": "r"}]})",
     "my.json:1: robots[0].appearance: is missing: only a simulated robot brings its own"},
    {R"({"robots": [{"id": "r", "tag": {"family": "16h5", "id": 30}}]})",
     "my.json:1: robots[0].tag: id is 30, allowed 0 to 29 in the family 16h5"},
    {R"({"robots": [{"id": "r", "tag": {"id": 3}}, {"id": "s", "tag": {"id": 3, "size_m": 0.1}}]})",
     "my.json:1: robots[1].tag: 36h11 3 is the tag of robots[0] too"},
    {R"({"robots": [{"id": "r", "tag": {"id": 3, "family": "tag36h11"}}]})",
     "my.json:1: robots[0].tag.family: \"tag36h11\" is not 36h11, 25h9, 16h5 or Standard41h12"},
    {"{\"cameras\": [" + std::string(kCamera) +
         R"(], "source": {"type": "video", "path": "a", "camera": "c"},
            "robots": [{"id": "r", "detector": "apriltag"}]})",
     "my.json:2: robots[0].tag: is missing: the detector apriltag needs it"},
    {R"({"robots": [{"id": "r"}, {"id": "s"},)"
     "\n"
     R"({"id": "r"}]})",
     "my.json:2: robots[2].id: \"r\" is the id of robots[0] too"},
    {R"({"robots": [{"id": "r", "filter": {"type": "kalman"}}]})",
     "my.json:1: robots[0].filter.type: \"kalman\" is not one of motion or window"},
    {R"({"floor": {"masks": [{"name": "a", "corners_m": [[0, 0], [1, 0]]}]}})",
     "my.json:1: floor.masks[0].corners_m: 2 entries, allowed 3 to 100"},
    {R"({"floor": {"masks": [{"name": "a", "corners_m": [[0, 0], [1, 1], [1, 0], [0, 1]]}]}})",
     "my.json:1: floor.masks[0].corners_m[2]: the side from there meets the one from corners[0], allowed: "
     "sides that do not cross"},
    {"{\"cameras\": [" + std::string(kCamera).substr(0, std::string(kCamera).size() - 1) +
         R"(, "floor_tags": [{"id": 1, "size_m": 0.2, "x_m": 0, "y_m": 0},
            {"id": 1, "size_m": 0.2, "x_m": 1, "y_m": 0}]}]})",
     "my.json:2: cameras[0].floor_tags[1].id: 36h11 1 is floor_tags[0] too"},
    {R"({"camera_watch": {"enabled": false, "recalibrate": true}})",
     "my.json:1: camera_watch.recalibrate: needs cameras to be watched: enabled is false"},
    {R"({"log": {"level": "loud"}})",
     "my.json:1: log.level: \"loud\" is not one of trace, debug, info, warn or error"},
};

TEST(Config, RefusesWhatIsWrongAndWhatContradicts) {
  for (const Refused& each : refused_texts) EXPECT_EQ(refusal(each.text), each.what) << each.text;
}

TEST(Config, ATagBecomesTheTrackersAndBack) {
  RobotConfig robot{.id = "r"};
  robot.tag =
      TagSpec{.family = "25h9", .id = 4, .size_m = 0.12, .height_m = 0.2, .mounting = {0.1, -0.05, 0.5}};
  robot.method.detector = DetectorKind::apriltag;
  const RobotSpec spec = robot_spec(robot, nullptr);
  EXPECT_EQ(spec.tag, robot.tag);
  EXPECT_EQ(spec.detector, DetectorKind::apriltag);
  const RobotConfig back = robot_config(spec);
  EXPECT_EQ(back.tag, robot.tag);
  EXPECT_FALSE(back.appearance);
}

TEST(Config, AnotherHostIsAllowedWithAToken) {
  const std::string token(64, 'a');
  EXPECT_EQ(refusal(R"({"server": {"host": "0.0.0.0", "token_sha256": ")" + token + "\"}}"), "accepted");
  EXPECT_EQ(refusal(R"({"server": {"host": "localhost"}})"), "accepted");
  EXPECT_EQ(refusal(R"({"server": {"host": "::1"}})"), "accepted");
}

TEST(Config, IntrinsicsAreCheckedAsTheTrackerDoes) {
  const std::string text = R"({"cameras": [{"id": "c", "overhead": {"height_m": 4}, "intrinsics":
    {"width_px": 640, "height_px": 480, "fx_px": 500, "fy_px": 500, "cx_px": 700, "cy_px": 240}}]})";
  EXPECT_THAT(refusal(text), HasSubstr("my.json:2: cameras[0].intrinsics: cx_px"));
}

TEST(Config, NoFilterThatTheTrackerRefusesIsAccepted) {
  const auto accepted = [](const std::string& key, const std::string& value) {
    return refusal(R"({"tracker": {"filter": {"type": "window", ")" + key + "\": " + value + "}}}") ==
           "accepted";
  };
  for (const int size : {1, 2, 1000, 1001}) {
    EXPECT_EQ(accepted("window_size", std::to_string(size)),
              check(WindowFilterConfig{.window_size = size}).empty());
  }
  for (const double alpha : {0.0, 1e-9, 100.0, 100.5}) {
    EXPECT_EQ(accepted("alpha", json(alpha).dump()), check(WindowFilterConfig{.alpha = alpha}).empty());
  }
  for (const int threshold : {-1, 0, 1, 1000, 1001, 100000, 100001}) {
    const std::string text = std::to_string(threshold);
    EXPECT_EQ(accepted("calibration_threshold", text),
              check(WindowFilterConfig{.calibration_threshold = threshold}).empty());
    EXPECT_EQ(accepted("frame_loss_threshold", text),
              check(WindowFilterConfig{.frame_loss_threshold = threshold}).empty());
  }
}

/// The place of map under a pixel, by the model that the configuration makes.
Eigen::Vector2d on_floor(const CameraConfig& camera, double u, double v) {
  return camera_model(camera).plane_from_pixel({u, v}, 0.0).value();
}

TEST(Config, AnOverheadCameraHasItsScaleAndHeading) {
  CameraConfig camera;
  camera.overhead = OverheadPose{.height_m = 4.0,
                                 .position_m = {1.0, -2.0},
                                 .yaw_rad = 0.0,
                                 .metres_per_pixel = 0.005,
                                 .size_px = {{801, 601}}};
  EXPECT_LT((on_floor(camera, 400, 300) - Eigen::Vector2d(1.0, -2.0)).norm(), 1e-9);
  EXPECT_LT((on_floor(camera, 500, 300) - Eigen::Vector2d(1.5, -2.0)).norm(), 1e-9);  // right is map x
  EXPECT_LT((on_floor(camera, 400, 200) - Eigen::Vector2d(1.0, -1.5)).norm(), 1e-9);  // up is map y
  camera.overhead->yaw_rad = std::numbers::pi / 2;
  EXPECT_LT((on_floor(camera, 500, 300) - Eigen::Vector2d(1.0, -1.5)).norm(), 1e-9);  // right is map y
}

TEST(Config, TheOrientationsOfACameraAgree) {
  CameraConfig overhead;
  overhead.overhead = OverheadPose{.height_m = 4.0,
                                   .position_m = {1.0, -2.0},
                                   .yaw_rad = 0.7,
                                   .metres_per_pixel = 0.005,
                                   .size_px = {{801, 601}}};
  CameraConfig posed;
  posed.intrinsics = camera_model(overhead).intrinsics();
  posed.map_from_camera = CameraPose{
      .position_m = {1.0, -2.0, 4.0}, .quaternion_xyzw = {}, .rpy_rad = {{std::numbers::pi, 0.0, 0.7}}};
  EXPECT_LT((on_floor(posed, 10, 20) - on_floor(overhead, 10, 20)).norm(), 1e-9);
  // Turned by 0.7 about z after pi about x: (cos, sin, 0, 0) of the half angle.
  posed.map_from_camera->rpy_rad.reset();
  posed.map_from_camera->quaternion_xyzw = {{std::cos(0.35), std::sin(0.35), 0.0, 0.0}};
  EXPECT_LT((on_floor(posed, 10, 20) - on_floor(overhead, 10, 20)).norm(), 1e-9);
}

TEST(Config, ABoxCountsWholePixels) {
  AppearanceConfig appearance;
  appearance.cut_from_frame = CutConfig{.camera = "c", .box_px = {3, 10, 20, 30}, .yaw_rad = 1.0};
  appearance.surface_height_m = 0.1;
  const FrameCut cut = frame_cut(appearance);
  EXPECT_EQ(cut.box_px, cv::Rect2d(2.5, 9.5, 20.0, 30.0));
  EXPECT_EQ(cut.yaw, 1.0);
  EXPECT_EQ(cut.surface_height_m, 0.1);
}

}  // namespace
}  // namespace skylight::service
