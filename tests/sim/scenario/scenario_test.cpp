// Scenario files: the published schema, the shipped scenarios, and one clear message for whatever is wrong.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "settings/document.hpp"
#include "sim/scenario/scenario_file.hpp"
#include "sim/simulation.hpp"

namespace skylight::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::filesystem::path source() {
  return SKYLIGHT_SOURCE_DIR;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// What is said about a scenario, by reading it or by starting it; empty where nothing is wrong.
std::string complaint(const std::string& text) {
  try {
    Scenario scenario = parse_scenario(text, "room.json");
    const Simulation simulation(scenario);
    return {};
  } catch (const settings::Error& error) {
    return error.what();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(ScenarioFile, ThePublishedSchemaIsTheOneThatIsRead) {
  EXPECT_TRUE(text_of(source() / "sim/scenario.schema.json") == scenario_schema())
      << "renew it: skylight simulate --schema > sim/scenario.schema.json";
}

TEST(ScenarioFile, EveryShippedScenarioLoadsAndSaysWhatItIsFor) {
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(source() / "sim/scenarios")) {
    if (entry.path().extension() != ".json") continue;
    const Scenario scenario = load_scenario(entry.path());
    EXPECT_EQ(scenario.name, entry.path().stem());
    EXPECT_FALSE(scenario.description.empty());
    EXPECT_EQ(scenario.description.find('\n'), std::string::npos);
    ++count;
  }
  EXPECT_GE(count, 30);
}

TEST(ScenarioFile, WhatIsWrittenReadsBackTheSame) {
  const Scenario scenario = load_scenario(source() / "sim/scenarios/demo.json");
  const std::string text = write_scenario(scenario);
  EXPECT_EQ(write_scenario(parse_scenario(text, "demo")), text);
}

TEST(ScenarioFile, AnEmptyObjectIsAnEmptyRoomWithACamera) {
  const Scenario scenario = parse_scenario("{}", "nothing");
  EXPECT_EQ(scenario.name, "nothing");
  EXPECT_EQ(scenario.cameras.size(), 1U);
  EXPECT_TRUE(scenario.robots.empty());
}

TEST(ScenarioFile, ThreadsOfPicturesAreReadFromTheScenariosFolder) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "skylight_scenario_test";
  std::filesystem::create_directories(folder);
  cv::imwrite((folder / "art.png").string(), cv::Mat(40, 40, CV_8UC3, cv::Scalar(10, 200, 30)));
  std::ofstream(folder / "s.json")
      << R"({"cameras": [{"width_px": 64, "height_px": 48, "fx_px": 50, "fy_px": 50}],
    "room": {"floor": {"material": "picture", "picture": "art.png"}},
    "robots": [{"id": "a", "picture": {"file": "art.png"}}]})";
  const Simulation simulation(load_scenario(folder / "s.json"));
  const RobotPicture picture = simulation.picture(0);
  EXPECT_EQ(picture.image.at<cv::Vec4b>(1, 1), cv::Vec4b(10, 200, 30, 255));
  EXPECT_NEAR(picture.metres_per_pixel, 0.266 / 40, 1e-12);
  std::filesystem::remove_all(folder);
}

struct Bad {
  std::string text;
  std::vector<std::string> says;  ///< parts of the message
};

/// A robot's program, in a scenario.
std::string program(const std::string& steps) {
  return R"({"robots": [{"id": "a", "program": [)" + steps + "]}]}";
}
std::string camera(const std::string& keys) {
  return R"({"cameras": [{)" + keys + "}]}";
}

const std::vector<Bad>& bad_scenarios() {
  static const std::vector<Bad> all{
      {"", {"room.json"}},
      {"{", {"room.json"}},
      {"[]", {"room.json", "object"}},
      {R"({"rooom": {}})", {"room.json:1", "rooom", "room"}},
      {"{\n\"room\": {\"size\": [6, 6]}}", {"room.json:2", "room.size", "size_m"}},
      {R"({"room": {"size_m": [6]}})", {"room.size_m", "2"}},
      {R"({"room": {"size_m": [6, "six"]}})", {"room.size_m[1]", "number"}},
      {R"({"room": {"size_m": [0, 6]}})", {"room.size_m[0]", "0.5"}},
      {R"({"room": {"size_m": [-6, 6]}})", {"room.size_m[0]", "-6", "200"}},
      {R"({"room": {"wall_height_m": NaN}})", {"room.json:1"}},
      {R"({"room": {"floor": {"material": "lava"}}})", {"room.floor.material", "lava", "tiles"}},
      {R"({"room": {"floor": {"material": "picture"}}})", {"room.floor.picture", "image file"}},
      {R"({"room": {"floor": {"material": "picture", "picture": "no_such.png"}}})",
       {"room.floor.picture", "no_such.png"}},
      {R"({"room": {"floor": {"picture": "a.png"}}})", {"room.floor.picture"}},
      {R"({"seed": -1})", {"seed"}},
      {R"({"seed": 1.5})", {"seed"}},
      {R"({"duration_s": 31536000})", {"duration_s", "604800"}},
      {R"({"light": {"level": 1e400}})", {"light.level"}},
      {R"({"cameras": []})", {"cameras"}},
      {camera(R"("position_m": [0, 0, -1])"), {"cameras[0].position_m[2]", "above the floor"}},
      {camera(R"("width_px": 60000, "height_px": 60000)"), {"cameras[0].width_px", "8192"}},
      {camera(R"("width_px": 0)"), {"cameras[0].width_px", "16"}},
      {camera(R"("fx_px": 0)"), {"cameras[0].fx_px"}},
      {camera(R"("frame_rate_hz": 0)"), {"cameras[0].frame_rate_hz"}},
      {camera(R"("exposure_s": 0.05)"), {"cameras[0].exposure_s", "frame to frame"}},
      {camera(R"("exposure_s": 0)"), {"cameras[0].exposure_s", "0"}},
      {camera(R"("lens": "pinhole")"), {"cameras[0].lens", "brown_conrady"}},
      {camera(R"("cx_px": 5000)"), {"cameras[0].cx_px", "1919"}},
      {camera(R"("lens": "kannala_brandt", "distortion": [0, 0, 0, 0, 1])"), {"cameras[0].distortion[4]"}},
      {camera(R"("sensor": {"full_well_e": 0})"), {"cameras[0].sensor.full_well_e"}},
      {R"({"cameras": [{"id": "a"}, {"id": "a"}]})", {"cameras[1].id", "taken"}},
      {R"({"robots": [{"id": "a"}, {"id": "a", "start": {"x_m": 1}}]})", {"robots[1].id", "taken"}},
      {R"({"robots": [{}]})", {"robots[0].id"}},
      {R"({"robots": [{"id": "a b"}]})", {"robots[0].id", "letters"}},
      {R"({"robots": [{"id": "a", "model": "tank"}]})", {"robots[0].model", "waffle_pi"}},
      {R"({"robots": [{"id": "a", "start": {"x_m": 3.5}}]})", {"robots[0].start", "outside the room"}},
      {R"({"robots": [{"id": "a", "start": {"x_m": 2.95}}]})", {"robots[0].start", "in its wall"}},
      {R"({"robots": [{"id": "a"}, {"id": "b", "start": {"x_m": 0.2, "yaw_deg": 45}}]})",
       {"robots[1].start", "overlaps robot a"}},
      {R"({"robots": [{"id": "a", "picture": {"file": "no_such.png"}}]})",
       {"robots[0].picture.file", "no_such.png"}},
      {R"({"robots": [{"id": "a", "picture": {"width_m": 0.5}}]})", {"robots[0].picture.width_m", "plate"}},
      {program(R"({"do": "arc", "radius_m": 0})"), {"robots[0].program[0].radius_m", "0"}},
      {program(R"({"do": "arc", "angle_deg": 0})"), {"robots[0].program[0].angle_deg"}},
      {program(R"({"do": "line", "distance_m": -1})"), {"robots[0].program[0].distance_m"}},
      {program(R"({"do": "line", "distance_m": 1, "speed_mps": 1.0})"),
       {"robots[0].program[0].speed_mps", "0.26"}},
      {program(R"({"do": "turn", "rate_degps": 300})"), {"robots[0].program[0].rate_degps", "104.3"}},
      {program(R"({"do": "jump"})"), {"robots[0].program[0].do", "jump", "waypoints"}},
      {program(R"({"distance_m": 1})"), {"robots[0].program[0]", "do"}},
      {program(R"({"do": "stop", "speed_mps": 1})"), {"robots[0].program[0].speed_mps"}},
      {program(R"({"do": "repeat", "steps": []})"), {"robots[0].program[0].steps"}},
      {program(R"({"do": "repeat"})"), {"robots[0].program[0].steps"}},
      {program(R"({"do": "repeat", "steps": [{"do": "stop"}]}, {"do": "stop"})"),
       {"robots[0].program[1]", "never reached"}},
      {program(R"({"do": "waypoints", "points_m": []})"), {"robots[0].program[0].points_m"}},
      {program(R"({"do": "waypoints", "points_m": [[0, 0], [4, 0]]})"),
       {"robots[0].program[0].points_m[1]", "outside the room"}},
      {program(R"({"do": "repeat", "steps": [{"do": "waypoints", "points_m": [[0, 9]]}]})"),
       {"robots[0].program[0].steps[0].points_m[0]"}},
      {R"({"duration_s": -1})", {"duration_s", "-1"}},
      {R"({"room": {"size_m": [6, 6], "size_m": [5, 5]}})", {"room.json:1", "size_m"}},
      {R"({"room": {"floor": {"tile_m": 0}}})", {"room.floor.tile_m", "0.02"}},
      {R"({"room": {"floor": {"cables": -1}}})", {"room.floor.cables"}},
      {R"({"room": {"floor": {"friction_zones": [{"min_m": [1, 1], "max_m": [0, 2]}]}}})",
       {"room.floor.friction_zones[0].max_m", "greater than min_m"}},
      {R"({"light": {"lamps": [{"position_m": [0, 0, 0]}]}})", {"light.lamps[0].position_m[2]", "0.5 m"}},
      {R"({"light": {"lamps": [{"share": 0.6}, {"share": 0.6}]}})", {"light.lamps", "more than 1"}},
      {R"({"light": {"flicker": {"depth": 2}}})", {"light.flicker.depth", "1"}},
      {camera(R"("shutter": "rolling", "readout_s": 0.03)"), {"cameras[0].exposure_s", "with the readout"}},
      {camera(R"("shutter": "slow")"), {"cameras[0].shutter", "rolling"}},
      {camera(R"("depth": {"model": "sonar"})"), {"cameras[0].depth.model", "stereo"}},
      {camera(R"("depth": {"step_mm": 0})"), {"cameras[0].depth.step_mm", "0.1"}},
      {camera(R"("delivery": {"drop_share": 1.5})"), {"cameras[0].delivery.drop_share", "1"}},
      {camera(R"("delivery": {"jpeg_quality": 0})"), {"cameras[0].delivery.jpeg_quality", "1 to 100"}},
      {camera(R"("delivery": {"latency_s": -0.1})"), {"cameras[0].delivery.latency_s"}},
      {camera(R"("auto_exposure": {"target_grey": 300})"), {"cameras[0].auto_exposure.target_grey", "254"}},
      {camera(R"("sensor": {"gain": null})"), {"cameras[0].sensor.gain"}},
      {R"({"robots": [{"id": "a", "tag": {"family": "99h9"}}]})", {"robots[0].tag.family", "36h11"}},
      {R"({"robots": [{"id": "a", "tag": {"size_m": 0}}]})", {"robots[0].tag.size_m"}},
      {R"({"robots": [{"id": "a", "picture": {"enabled": false, "file": "a.png"}}]})",
       {"robots[0].picture.enabled"}},
      {R"({"robots": [{"id": "a", "copies": {"count": 0}}]})", {"robots[0].copies.count", "1"}},
      {R"({"robots": [{"id": "a", "copies": {"count": 3, "spacing_m": [0.1, 0.1]}}]})",
       {"robots[0].copies", "a-2", "overlaps robot a"}},
      {R"({"robots": [{"id": "a", "copies": {"count": 30}}]})", {"robots[0].copies", "outside the room"}},
      {R"({"robots": [{"id": "a", "copies": {"count": 2}}, {"id": "a-2", "start": {"y_m": 1}}]})",
       {"robots", "a-2", "copy"}},
      {R"({"robots": [{"id": "a", "odometry": {"rate_hz": 0}}]})", {"robots[0].odometry.rate_hz", "1"}},
      {program(R"({"do": "line", "distance_m": 1, "to_m": [1, 1]})"), {"robots[0].program[0]", "distance_m"}},
      {program(R"({"do": "line", "to_m": [9, 1]})"), {"robots[0].program[0].to_m", "outside the room"}},
      {program(R"({"do": "circle", "rounds": 0})"), {"robots[0].program[0].rounds"}},
      {program(R"({"do": "figure_eight", "rounds": 0}, {"do": "stop"})"),
       {"robots[0].program[1]", "never reached"}},
      {program(R"({"do": "figure_eight", "speed_mps": 0.3})"), {"robots[0].program[0].speed_mps", "0.26"}},
      {program(R"({"do": "wander"}, {"do": "stop"})"), {"robots[0].program[1]", "never reached"}},
      {program(R"({"do": "wander", "changes_per_min": 0})"), {"robots[0].program[0].changes_per_min"}},
      {program(R"({"do": "drive", "side_mps": 0.1})"), {"robots[0].program[0].side_mps", "holonomic"}},
      {program(R"({"do": "drive", "for_s": 31536000})"), {"robots[0].program[0].for_s", "604800"}},
      {program(R"({"do": "wait"})"), {"robots[0].program[0].event"}},
      {program(R"({"do": "wait", "event": "go"})"), {"robots[0].program[0].event", "no event", "go"}},
      {program(R"({"do": "run", "program": "dance"})"),
       {"robots[0].program[0].program", "no program", "dance"}},
      {program(R"({"do": "parallel", "steps": [{"do": "stop"}]})"), {"robots[0].program[0].steps", "2"}},
      {program(R"({"do": "parallel", "steps": [{"do": "stop"}, {"do": "turn", "rate_degps": 200}]})"),
       {"robots[0].program[0].steps[1].rate_degps"}},
      {R"({"programs": {"x": [{"do": "run", "program": "x"}]}})", {"programs.x", "runs itself", "x runs x"}},
      {R"({"programs": {"x": [{"do": "run", "program": "y"}],
           "y": [{"do": "repeat", "steps": [{"do": "run", "program": "x"}]}]}})",
       {"programs.x", "x runs y runs x"}},
      {R"({"programs": {"fast": [{"do": "drive", "v_mps": 0.4}]},
           "robots": [{"id": "a", "model": "burger", "program": [{"do": "run", "program": "fast"}]}]})",
       {"programs.fast[0].v_mps", "0.22"}},
      {R"({"robots": [{"id": "a", "program": [{"do": "wait", "event": "done"}]}],
           "events": [{"name": "done", "when": {"is": "program_done", "robot": "a"}, "do": "signal"}]})",
       {"robots[0].program[0].event", "own end"}},
      {R"({"objects": [{}]})", {"objects[0].id"}},
      {R"({"objects": [{"id": "box", "size_m": [1, -1, 1]}]})", {"objects[0].size_m[1]", "0.005"}},
      {R"({"objects": [{"id": "box", "x_m": 5}]})", {"objects[0]", "outside the room"}},
      {R"({"objects": [{"id": "box", "pushable": true, "bottom_m": 1}]})", {"objects[0].bottom_m"}},
      {R"({"objects": [{"id": "can", "shape": "cylinder", "size_m": [0.2, 0.3, 0.2]}]})",
       {"objects[0].size_m[1]", "cylinder"}},
      {R"({"objects": [{"id": "box"}], "robots": [{"id": "a"}]})", {"robots[0].start", "overlaps thing box"}},
      {R"({"objects": [{"id": "p", "pushable": true}, {"id": "q", "pushable": true, "x_m": 0.1}]})",
       {"objects[1]", "overlaps thing p"}},
      {R"({"objects": [{"id": "a", "x_m": 1}], "robots": [{"id": "a"}]})", {"objects[0].id", "taken"}},
      {R"({"people": [{"id": "p", "path_m": [[0, 0]]}]})", {"people[0].path_m", "2"}},
      {R"({"people": [{"id": "p", "path_m": [[0, 0], [1, 0]], "speed_mps": 0}]})",
       {"people[0].speed_mps", "0.05"}},
      {R"({"events": [{"do": "signal"}]})", {"events[0]", "at_s", "when"}},
      {R"({"events": [{"at_s": 1, "when": {"is": "after", "event": "x"}, "do": "signal"}]})",
       {"events[0]", "at_s"}},
      {R"({"events": [{"at_s": 1}]})", {"events[0]", "do"}},
      {R"({"events": [{"at_s": 1, "do": "explode"}]})", {"events[0].do", "explode", "kidnap"}},
      {R"({"events": [{"at_s": 1, "do": "light"}]})", {"events[0].level"}},
      {R"({"events": [{"at_s": 1, "do": "light", "level": 9}]})", {"events[0].level", "4"}},
      {R"({"duration_s": 5, "events": [{"at_s": 6, "do": "signal"}]})",
       {"events[0].at_s", "never reached", "5 s"}},
      {R"({"events": [{"at_s": 1, "do": "bump", "camera": "wall"}]})", {"events[0].camera", "no camera"}},
      {R"({"events": [{"at_s": 1, "do": "bump", "camera": "ceiling", "by_mm": [0, 0, -4500]}]})",
       {"events[0].by_mm[2]", "below the floor"}},
      {R"({"events": [{"at_s": 1, "do": "kidnap", "robot": "z", "to": {}}]})",
       {"events[0].robot", "no robot", "z"}},
      {R"({"robots": [{"id": "a"}], "events": [{"at_s": 1, "do": "kidnap", "robot": "a", "to": {"x_m": 3}}]})",
       {"events[0].to", "outside the room"}},
      {R"({"robots": [{"id": "a"}], "events": [{"at_s": 1, "do": "cover", "robot": "a"}]})",
       {"events[0].tag_only", "no tag"}},
      {R"({"robots": [{"id": "a"}], "events": [{"at_s": 1, "do": "drive", "robot": "a", "v_mps": 2}]})",
       {"events[0].v_mps", "0.26"}},
      {R"({"robots": [{"id": "a"}], "events": [{"at_s": 1, "do": "drive", "robot": "a", "side_mps": 0.1}]})",
       {"events[0].side_mps", "holonomic"}},
      {R"({"events": [{"at_s": 1, "do": "remove", "object": "box"}]})", {"events[0].object", "box"}},
      {R"({"events": [{"at_s": 1, "do": "put", "object": {"id": "box", "x_m": 9}}]})",
       {"events[0].object", "outside the room"}},
      {R"({"events": [{"when": {"is": "after", "event": "x"}, "do": "signal"}]})",
       {"events[0].when.event", "no event"}},
      {R"({"events": [{"name": "x", "when": {"is": "after", "event": "y"}, "do": "signal"},
                      {"name": "y", "when": {"is": "after", "event": "x"}, "do": "signal"}]})",
       {"events[0].when.event", "x after y after x"}},
      {R"({"events": [{"name": "x", "at_s": 1, "do": "signal"}, {"name": "x", "at_s": 2, "do": "signal"}]})",
       {"events[1].name", "taken"}},
      {R"({"robots": [{"id": "a"}],
           "events": [{"when": {"is": "robots_near", "robot": "a", "other": "a"}, "do": "signal"}]})",
       {"events[0].when.other", "another robot"}},
      {R"({"robots": [{"id": "a"}],
           "events": [{"when": {"is": "robot_at", "robot": "a", "place_m": [7, 0]}, "do": "signal"}]})",
       {"events[0].when.place_m", "outside the room"}},
      {R"({"expect": [{"figure": "mean_error_m"}]})", {"expect[0]", "at_most"}},
      {R"({"expect": [{"figure": "luck", "at_most": 1}]})", {"expect[0].figure", "luck", "usable"}},
      {R"({"expect": [{"figure": "usable", "robot": "z", "at_least": 1}]})", {"expect[0].robot", "no robot"}},
      {R"({"expect": [{"figure": "idf1", "robot": "z", "at_least": 1}]})", {"expect[0].robot", "together"}},
      {R"({"expect": [{"figure": "usable", "at_least": 1, "at_most": 0}]})", {"expect[0].at_least"}},
      {R"({"expect": [{"figure": "usable", "at_least": 1, "kind": "guessed"}]})", {"expect[0].kind"}},
      {R"({"repeats": 0})", {"repeats", "1"}},
      {R"({"sweep": [{"key": "light.level"}]})", {"sweep[0]", "values"}},
      {R"({"sweep": [{"key": "light.levle", "values": [1]}]})", {"light.levle"}},
      {R"({"sweep": [{"key": "light.level", "values": [1, 7]}]})", {"light.level", "7"}},
      {R"({"repeats": 1000, "sweep": [{"key": "light.level", "values": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.1]}]})",
       {"sweep", "11000", "10000"}},
  };
  return all;
}

TEST(ScenarioFile, WhatIsWrongIsNamedWithItsPlaceAndWhatIsAllowed) {
  for (const Bad& bad : bad_scenarios()) {
    const std::string said = complaint(bad.text);
    EXPECT_FALSE(said.empty()) << bad.text;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    for (const std::string& part : bad.says) EXPECT_THAT(said, HasSubstr(part)) << bad.text;
  }
}

TEST(ScenarioFile, AFileMayAskForManyRuns) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "skylight_runs.json";
  std::ofstream(file) << R"({"seed": 5, "repeats": 2, "robots": [{"id": "a"}],
    "sweep": [{"key": "light.level", "values": [0.5, 1]}, {"key": "room.floor.material", "names": ["wood", "tiles"]}]})";
  const std::vector<Scenario> runs = load_runs(file);
  std::filesystem::remove(file);
  ASSERT_EQ(runs.size(), 8U);
  EXPECT_EQ(runs[0].name, "skylight_runs light.level=0.5 room.floor.material=wood");
  EXPECT_EQ(runs[0].seed, 5U);
  EXPECT_EQ(runs[1].seed, 6U);
  EXPECT_EQ(runs[1].name, runs[0].name);
  EXPECT_EQ(runs[7].light.level, 1.0);
  EXPECT_EQ(runs[7].room.floor.material, FloorMaterial::tiles);
  EXPECT_EQ(runs[2].room.floor.material, FloorMaterial::tiles);
  EXPECT_EQ(runs[2].light.level, 0.5);
  for (const Scenario& run : runs) EXPECT_NO_THROW(validate(run));
}

TEST(ScenarioFile, CopiesStandInRowsAndAreNamedAfterTheFirst) {
  const Scenario scenario = parse_scenario(
      R"({"robots": [{"id": "a", "start": {"x_m": -1, "y_m": -1}, "copies": {"count": 5, "per_row": 3, "spacing_m": [0.5, 0.6]}}]})",
      "copies");
  const std::vector<RobotSpec> robots = all_robots(scenario);
  ASSERT_EQ(robots.size(), 5U);
  EXPECT_EQ(robots[4].id, "a-5");
  EXPECT_NEAR(robots[4].start.x_m, -0.5, 1e-12);
  EXPECT_NEAR(robots[4].start.y_m, -0.4, 1e-12);
}

TEST(ScenarioFile, AnActionReadsLikeAnEventWithoutItsTime) {
  const Action action = parse_action(R"({"do": "kidnap", "robot": "a", "to": {"x_m": 1}})", "request");
  ASSERT_TRUE(std::holds_alternative<KidnapAction>(action));
  EXPECT_EQ(std::get<KidnapAction>(action).to.x_m, 1.0);
  EXPECT_THROW(parse_action(R"({"do": "kidnap", "robot": "a"})", "request"), settings::Error);
  EXPECT_THROW(parse_action(R"({"do": "light", "level": 1, "at_s": 3})", "request"), settings::Error);
}

TEST(ScenarioFile, AFileThatIsMissingOrNoPictureIsNamed) {
  EXPECT_THROW(load_scenario("/nowhere/scenario.json"), settings::Error);
  const auto file = std::filesystem::path(::testing::TempDir()) / "skylight_no_picture.png";
  std::ofstream(file) << "not a picture";
  EXPECT_THAT(complaint(R"({"robots": [{"id": "a", "picture": {"file": ")" + file.string() + "\"}}]}"),
              AllOf(HasSubstr("robots[0].picture.file"), HasSubstr("no picture")));
  std::filesystem::remove(file);
}

/// The start of a PNG that claims a size, with a valid checksum but no pixels.
std::string png_header(unsigned width, unsigned height) {
  const auto number = [](unsigned v) {
    return std::string{static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8),
                       static_cast<char>(v)};
  };
  const std::string chunk = "IHDR" + number(width) + number(height) + std::string("\x08\x02\x00\x00\x00", 5);
  unsigned crc = ~0U;
  for (const char c : chunk) {
    crc ^= static_cast<unsigned char>(c);
    for (int i = 0; i < 8; ++i) crc = (crc >> 1) ^ ((crc & 1U) != 0U ? 0xedb88320U : 0U);
  }
  return std::string("\x89PNG\r\n\x1a\n", 8) + number(13) + chunk + number(~crc) + number(0) + "IDAT";
}

TEST(ScenarioFile, APictureOfAbsurdSizeIsRefusedBeforeItIsRead) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "skylight_huge.png";
  for (const unsigned size : {60000U, 20000U}) {
    std::ofstream(file, std::ios::binary) << png_header(size, size);
    EXPECT_THAT(complaint(R"({"robots": [{"id": "a", "picture": {"file": ")" + file.string() + "\"}}]}"),
                AllOf(HasSubstr("robots[0].picture.file"), HasSubstr("8192")));
  }
  std::filesystem::remove(file);
}

TEST(ScenarioFile, AScenarioMadeInCodeIsCheckedTheSameWay) {
  Scenario scenario;
  scenario.cameras[0].width_px = 100000;
  EXPECT_THROW(Simulation{scenario}, std::invalid_argument);
  scenario = {};
  scenario.cameras[0].exposure_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Simulation{scenario}, std::invalid_argument);
  scenario = {};
  scenario.robots.emplace_back();
  scenario.robots[0].id = "a";
  scenario.robots[0].start.x_m = 5.0;
  try {
    Simulation simulation(scenario);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("robots[0].start"));
  }
}

}  // namespace
}  // namespace skylight::sim
