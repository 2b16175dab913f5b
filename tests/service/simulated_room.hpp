// Small scenarios, quick to draw, for tests of the service.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "service/sources/simulator.hpp"

namespace skylight::service::test {

/// A folder of the test's own, gone after it.
class RoomFolder {
 public:
  RoomFolder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path = std::filesystem::temp_directory_path() /
           ("skylight_room_" + std::to_string(getpid()) + "_" +
            std::to_string(std::hash<std::string>{}(std::string(test->test_suite_name()) + test->name())));
    std::filesystem::create_directories(path);
  }
  ~RoomFolder() {
    std::error_code error;
    std::filesystem::remove_all(path, error);
  }
  RoomFolder(const RoomFolder&) = delete;
  RoomFolder& operator=(const RoomFolder&) = delete;

  /// Writes a scenario; gives its path.
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name) << text;
    return (path / name).string();
  }

  std::filesystem::path path;
};

/// 320 x 240 px over 1.9 x 1.4 m, one robot on a circle; `more` are further members of the scenario
/// ("\"duration_s\": 2, ..."), `camera` of its camera, `robot` of its robot.
inline std::string small_scenario(const std::string& more, const std::string& camera = {},
                                  const std::string& robot = {}) {
  const auto with = [](const std::string& text) { return text.empty() ? text : ", " + text; };
  return R"({"seed": 4, "room": {"size_m": [3, 3], "floor": {"material": "speckle"}},
    "cameras": [{"id": "ceiling", "position_m": [0, 0, 1.5], "width_px": 320, "height_px": 240, "fx_px": 250,
                 "fy_px": 250, "distortion": [0, 0, 0, 0, 0], "frame_rate_hz": 30)" +
         with(camera) + R"(}],
    "robots": [{"id": "anna", "picture": {"seed": 5}, "start": {"x_m": 0.2, "y_m": -0.1, "yaw_deg": 90},
                "program": [{"do": "circle", "radius_m": 0.25, "rounds": 5, "speed_mps": 0.15}])" +
         with(robot) + "}]" + with(more) + "}";
}

}  // namespace skylight::service::test
