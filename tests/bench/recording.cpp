#include "tests/bench/recording.hpp"

#include <map>
#include <sstream>

#include "sim/camera/camera_model.hpp"
#include "sim/scenario/scenario_file.hpp"
#include "sim/simulation.hpp"

namespace skylight::bench {
namespace {

constexpr std::size_t kFrames = 24;  // of 6 MB each, more than any cache holds
constexpr double kFrameRateHz = 30.0;

// Five columns and two rows over what the camera sees of the room.
std::string robot_text(int i) {
  std::ostringstream text;
  text << R"({ "id": "waffle)" << i << R"(", "picture": { "seed": )" << 5 + i << R"( }, "start": { "x_m": )"
       << -2.4 + 1.2 * (i % 5) << R"(, "y_m": )" << (i < 5 ? -1.0 : 1.0) << R"(, "yaw_deg": )" << 20 + 37 * i
       << " }";
  if (i % 2 == 0)
    text
        << R"(, "program": [{ "do": "repeat", "steps": [{ "do": "arc", "radius_m": 0.35, "angle_deg": 360, "speed_mps": 0.1 }] }])";
  return text.str() + " }";
}

CameraModel tracker_camera(const sim::CameraSpec& spec) {
  return CameraModel({.width_px = spec.width_px,
                      .height_px = spec.height_px,
                      .fx_px = spec.fx_px,
                      .fy_px = spec.fy_px,
                      .cx_px = spec.cx_px.value_or((spec.width_px - 1) / 2.0),
                      .cy_px = spec.cy_px.value_or((spec.height_px - 1) / 2.0),
                      .lens = LensModel::brown_conrady,
                      .distortion = spec.distortion},
                     sim::map_from_camera(spec));
}

RobotSpec tracked(const sim::RobotPicture& picture, const sim::RobotTruth& truth) {
  const auto appearance =
      std::make_shared<const Appearance>(truth.id, Picture{.image = picture.image,
                                                           .metres_per_pixel = picture.metres_per_pixel,
                                                           .surface_height_m = picture.surface_height_m,
                                                           .reference_point_m = picture.reference_point_m});
  return {.id = truth.id, .appearance = appearance, .initial_pose = truth.pose};
}

Recording record(const RoomOptions& options) {
  const sim::Scenario scenario = room(options);
  sim::Simulation simulation(scenario);
  Recording recording{
      .camera = tracker_camera(scenario.cameras.at(0)), .robots = {}, .images = {}, .depths = {}};
  for (std::size_t i = 0; i < kFrames; ++i) {
    const auto shot = simulation.next();
    recording.images.push_back(shot->frame.image.clone());
    if (options.depth) recording.depths.push_back(shot->frame.depth.clone());
    if (i > 0) continue;
    for (std::size_t r = 0; r < shot->truth.size(); ++r)
      recording.robots.push_back(tracked(simulation.picture(r), shot->truth[r]));
  }
  return recording;
}

}  // namespace

sim::Scenario room(const RoomOptions& options) {
  std::ostringstream text;
  text << R"({ "seed": 1, "room": { "size_m": [6, 6], "floor": { "material": "speckle" } },
  "cameras": [{ "id": "ceiling", "depth": { "enabled": )"
       << (options.depth ? "true" : "false") << R"( } }], "robots": [)";
  for (int i = 0; i < options.robots; ++i) text << (i > 0 ? ", " : "") << robot_text(i);
  text << "] }";
  return sim::parse_scenario(text.str(), "benchmark room");
}

std::string room_label(const RoomOptions& options) {
  return "room 6 x 6 m, seed 1, " + std::to_string(options.robots) + " Waffle Pi, 1920 x 1080 at 30 Hz" +
         (options.depth ? ", depth" : "");
}

const Recording& recording(const RoomOptions& options) {
  static std::map<std::pair<int, bool>, Recording> made;
  const std::pair key(options.robots, options.depth);
  const auto at = made.find(key);
  return at != made.end() ? at->second : made.emplace(key, record(options)).first->second;
}

Frame Player::next() {
  const std::uint64_t turn = 2 * (recording_.images.size() - 1);
  const std::uint64_t place = played_ % turn;
  const std::uint64_t index = place < recording_.images.size() ? place : turn - place;
  const Frame frame{.sequence = played_,
                    .captured = Time{from_seconds(static_cast<double>(played_) / kFrameRateHz)},
                    .image = recording_.images[index],
                    .depth = recording_.depths.empty() ? cv::Mat() : recording_.depths[index]};
  ++played_;
  return frame;
}

}  // namespace skylight::bench
