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
  EXPECT_EQ(text_of(source() / "sim/scenario.schema.json"), scenario_schema());
}

TEST(ScenarioFile, EveryShippedScenarioLoadsAndSaysWhatItIsFor) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source() / "sim/scenarios")) {
    if (entry.path().extension() != ".json") continue;
    const Scenario scenario = load_scenario(entry.path());
    EXPECT_EQ(scenario.name, entry.path().stem());
    EXPECT_FALSE(scenario.description.empty());
    EXPECT_EQ(scenario.description.find('\n'), std::string::npos);
    ++count;
  }
  EXPECT_GE(count, 3);
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
      {program(R"({"do": "line", "distance_m": 1, "speed_mps": 1.0})"), {"robots[0].program[0].speed_mps", "0.26"}},
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
