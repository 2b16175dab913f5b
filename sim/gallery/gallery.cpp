// Draws each effect of the simulator switched off and on, side by side, and a page that shows them all:
//   build/release/skylight_gallery sim/gallery
// The pictures are cut from frames at their own resolution and enlarged without smoothing.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sim/scenario/scenario_file.hpp"
#include "sim/simulation.hpp"

namespace skylight::sim {
namespace {

using Change = std::function<void(Scenario&)>;

struct Effect {
  std::string name;     ///< of its picture
  std::string caption;  ///< what differs
  Change both;          ///< of the scene, off and on
  Change off;
  Change on;
  double at_s = 1.0;                 ///< which frame is shown
  cv::Rect cut{420, 300, 320, 200};  ///< of the frame; empty: all of it
  int enlarge = 2;
  bool depth = false;  ///< the depth picture, near to far from bright to dark
};

/// A room under a camera of 1280 x 800 px with a robot in the middle and one at its side.
Scenario room() {
  Scenario scenario = parse_scenario(R"({
    "seed": 3,
    "room": { "floor": { "material": "tiles" } },
    "cameras": [{ "width_px": 1280, "height_px": 800, "fx_px": 560, "fy_px": 560, "position_m": [0, 0, 3.2],
                  "frame_rate_hz": 20 }],
    "robots": [
      { "id": "a", "start": { "yaw_deg": 30 } },
      { "id": "b", "start": { "x_m": -2, "y_m": 1.2, "yaw_deg": -70 } }
    ]
  })",
                                     "gallery");
  return scenario;
}

cv::Mat as_grey(const cv::Mat& depth) {
  double least = 0.0;
  double most = 0.0;
  cv::minMaxLoc(depth, &least, &most, nullptr, nullptr, depth > 0);
  cv::Mat grey;
  depth.convertTo(grey, CV_8U, -215.0 / std::max(1.0, most - least),
                  40.0 + 215.0 * most / std::max(1.0, most - least));
  grey.setTo(0, depth == 0);
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2BGR);
  return grey;
}

cv::Mat draw(const Effect& effect, const Change& change) {
  Scenario scenario = room();
  if (effect.both) effect.both(scenario);
  if (change) change(scenario);
  Simulation simulation(scenario);
  const Time shown = simulation.now() + from_seconds(effect.at_s);
  while (const auto shot = simulation.next()) {
    if (shot->truth.at(0).at < shown) continue;
    const cv::Mat whole = effect.depth ? as_grey(shot->frame.depth) : shot->frame.image;
    cv::Mat part = effect.cut.empty() ? whole : whole(effect.cut);
    cv::resize(part, part, {}, effect.enlarge, effect.enlarge, cv::INTER_NEAREST);
    if (effect.cut.empty()) cv::resize(part, part, {640, 400}, 0, 0, cv::INTER_AREA);
    return part;
  }
  throw std::runtime_error(effect.name + ": no frame at " + std::to_string(effect.at_s) + " s");
}

void drive(Scenario& scenario, double v_mps, double w_degps = 0.0) {
  scenario.robots[0].model = RobotModelName::holonomic;
  scenario.robots[0].start = {-0.9 * v_mps, 0.0, 0.0};
  scenario.robots[0].program = {{DriveStep{.v_mps = v_mps, .w_degps = w_degps, .for_s = 5.0}}};
}

Action light_to(double level) {
  return LightAction{.level = level};
}

EventSpec event(double at_s, Action action) {
  EventSpec spec;
  spec.at_s = at_s;
  spec.action = std::move(action);
  return spec;
}

ObjectSpec beam() {
  ObjectSpec object;
  object.id = "beam";
  object.size_m = {0.12, 3.0, 0.15};
  object.x_m = 0.02;
  object.bottom_m = 1.2;
  object.yaw_deg = 20.0;
  return object;
}

std::vector<Effect> light_effects() {
  return {
      {.name = "shadow",
       .caption = "Soft shadow of a lamp: `light.lamps`",
       .both =
           [](Scenario& s) {
             s.light.lamps = {{.position_m = {1.6, 1.2, 2.6}, .share = 0.0}};
           },
       .off = {},
       .on = [](Scenario& s) { s.light.lamps[0].share = 0.6; }},
      {.name = "contact-shadow",
       .caption = "Shadow at a robot's foot: `light.contact_shadow`",
       .both = [](Scenario& s) { s.light.lamps.clear(); },
       .off = [](Scenario& s) { s.light.contact_shadow = 0.0; },
       .on = {}},
      {.name = "gloss",
       .caption = "The floor mirrors a lamp: `room.floor.gloss`",
       .both =
           [](Scenario& s) {
             s.light.lamps = {{.position_m = {0.8, -0.5, 2.6}, .diameter_m = 0.5, .share = 0.5}};
           },
       .off = [](Scenario& s) { s.room.floor.gloss = 0.0; },
       .on = [](Scenario& s) { s.room.floor.gloss = 0.3; },
       .cut = {},
       .enlarge = 1},
      {.name = "gradient",
       .caption = "Light that changes across the room: `light.gradient`",
       .both = [](Scenario& s) { s.light.lamps.clear(); },
       .off = [](Scenario& s) { s.light.gradient = 0.0; },
       .on = [](Scenario& s) { s.light.gradient = 0.7; },
       .cut = {},
       .enlarge = 1},
      {.name = "passing-shadow",
       .caption = "A cloud's shadow passes: event `shadow`",
       .both = {},
       .off = {},
       .on =
           [](Scenario& s) {
             s.events = {event(0.0, ShadowAction{.darkness = 0.6, .width_m = 2.0, .speed_mps = 4.0})};
           },
       .at_s = 1.0,
       .cut = {},
       .enlarge = 1},
      {.name = "flicker",
       .caption = "Lamps that follow the mains under a rolling shutter: `light.flicker`",
       .both =
           [](Scenario& s) {
             s.cameras[0].shutter = Shutter::rolling;
             s.cameras[0].readout_s = 0.03;
             s.cameras[0].exposure_s = 0.002;
           },
       .off = [](Scenario& s) { s.light.flicker.depth = 0.0; },
       .on = [](Scenario& s) { s.light.flicker.depth = 0.4; },
       .cut = {},
       .enlarge = 1},
  };
}

std::vector<Effect> camera_effects() {
  return {
      {.name = "noise",
       .caption = "Photon and read noise at a gain of 12: `sensor.noise`",
       .both = [](Scenario& s) { s.cameras[0].sensor.gain = 12.0; },
       .off = [](Scenario& s) { s.cameras[0].sensor.noise = false; },
       .on = {}},
      {.name = "blur",
       .caption = "Motion blur at 1.5 m/s, 0.5 and 25 ms: `exposure_s`",
       .both = [](Scenario& s) { drive(s, 1.5); },
       .off = [](Scenario& s) { s.cameras[0].exposure_s = 0.0005; },
       .on = [](Scenario& s) { s.cameras[0].exposure_s = 0.025; },
       .at_s = 1.0},
      {.name = "rolling-shutter",
       .caption = "A robot that passes at 1.8 m/s: `shutter`",
       .both =
           [](Scenario& s) {
             drive(s, 1.8);
             s.cameras[0].exposure_s = 0.0005;
             s.cameras[0].readout_s = 0.049;
             s.cameras[0].position_m[2] = 0.8;
           },
       .off = {},
       .on = [](Scenario& s) { s.cameras[0].shutter = Shutter::rolling; },
       .at_s = 1.15,
       .cut = {},
       .enlarge = 1},
      {.name = "exposure-lag",
       .caption = "A fifth of a second after the lights went on, without and with the camera's own control: "
                  "`auto_exposure`",
       .both =
           [](Scenario& s) {
             s.light.level = 0.25;
             s.events = {event(2.0, light_to(1.0))};
           },
       .off = {},
       .on = [](Scenario& s) { s.cameras[0].auto_exposure.enabled = true; },
       .at_s = 2.2,
       .cut = {},
       .enlarge = 1},
      {.name = "jpeg",
       .caption = "Compressed at quality 15: `delivery.jpeg_quality`",
       .both = {},
       .off = {},
       .on = [](Scenario& s) { s.cameras[0].delivery.jpeg_quality = 15; }},
      {.name = "vignetting",
       .caption = "Dark corners: `vignetting`",
       .both = {},
       .off = [](Scenario& s) { s.cameras[0].vignetting = 0.0; },
       .on = [](Scenario& s) { s.cameras[0].vignetting = 0.6; },
       .cut = {},
       .enlarge = 1},
      {.name = "distortion",
       .caption = "Barrel distortion: `distortion`",
       .both = {},
       .off = [](Scenario& s) { s.cameras[0].distortion = {}; },
       .on =
           [](Scenario& s) {
             s.cameras[0].distortion = {-0.25, 0.06, 0.0, 0.0, 0.0};
           },
       .cut = {},
       .enlarge = 1},
      {.name = "fisheye",
       .caption = "A fisheye in place of the pinhole: `lens`",
       .both = {},
       .off = {},
       .on =
           [](Scenario& s) {
             s.cameras[0].lens = Lens::kannala_brandt;
             s.cameras[0].distortion = {};
             s.cameras[0].fx_px = s.cameras[0].fy_px = 420.0;
           },
       .cut = {},
       .enlarge = 1},
      {.name = "depth-noise",
       .caption = "Noise, steps and holes of a stereo camera's depth: `depth`",
       .both =
           [](Scenario& s) {
             s.cameras[0].depth.enabled = true;
             s.cameras[0].depth.model = DepthModel::stereo;
           },
       .off = [](Scenario& s) { s.cameras[0].depth.noise = false; },
       .on = {},
       .depth = true},
  };
}

std::vector<Effect> scene_effects() {
  return {
      {.name = "parallax",
       .caption = "The same robot beside the camera's foot and below it: bodies, not stickers",
       .both = [](Scenario& s) { s.cameras[0].position_m[2] = 2.0; },
       .off = [](Scenario& s) { s.cameras[0].position_m[0] = 1.6; },
       .on = {},
       .cut = {},
       .enlarge = 1},
      {.name = "beam",
       .caption = "Half hidden by a beam: `objects` with `bottom_m`",
       .both = {},
       .off = {},
       .on = [](Scenario& s) { s.objects = {beam()}; }},
      {.name = "person",
       .caption = "Somebody walks by: `people`",
       .both = {},
       .off = {},
       .on =
           [](Scenario& s) {
             PersonSpec person;
             person.id = "visitor";
             person.path_m = {{-1.6, 0.9}, {1.6, -0.3}};
             s.people = {person};
           },
       .at_s = 1.2,
       .cut = {},
       .enlarge = 1},
      {.name = "tag",
       .caption = "A tag on the bare top, and over a picture: `tag`, `picture.enabled`",
       .both = [](Scenario& s) { s.robots[0].tag = TagSpec{.id = 7}; },
       .off = [](Scenario& s) { s.robots[0].picture.enabled = false; },
       .on = {}},
      {.name = "floor-tiles-wood",
       .caption = "Floors: `tiles` and `wood`",
       .both = {},
       .off = {},
       .on = [](Scenario& s) { s.room.floor.material = FloorMaterial::wood; },
       .cut = {},
       .enlarge = 1},
      {.name = "floor-speckle-concrete",
       .caption = "Floors: `speckle` and `concrete`",
       .both = [](Scenario& s) { s.room.floor.material = FloorMaterial::speckle; },
       .off = {},
       .on = [](Scenario& s) { s.room.floor.material = FloorMaterial::concrete; },
       .cut = {},
       .enlarge = 1},
      {.name = "cables",
       .caption = "Cables on the floor: `room.floor.cables`",
       .both = {},
       .off = {},
       .on = [](Scenario& s) { s.room.floor.cables = 10; },
       .cut = {},
       .enlarge = 1},
  };
}

void put_side_by_side(const Effect& effect, const std::filesystem::path& folder) {
  const cv::Mat off = draw(effect, effect.off);
  const cv::Mat on = draw(effect, effect.on);
  cv::Mat both(off.rows, off.cols + on.cols + 8, CV_8UC3, cv::Scalar::all(255));
  off.copyTo(both(cv::Rect(0, 0, off.cols, off.rows)));
  on.copyTo(both(cv::Rect(off.cols + 8, 0, on.cols, on.rows)));
  const auto file = folder / (effect.name + ".jpg");
  if (!cv::imwrite(file.string(), both, {cv::IMWRITE_JPEG_QUALITY, 88}))
    throw std::runtime_error(file.string() + ": cannot be written");
}

int run(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream page(folder / "README.md");
  page << "# The effects, each off (left) and on (right)\n\nDrawn by `build/release/skylight_gallery "
          "sim/gallery`; "
          "enlarged twice where a part of the frame is shown.\n";
  for (const auto& effects : {light_effects(), camera_effects(), scene_effects()}) {
    for (const Effect& effect : effects) {
      put_side_by_side(effect, folder);
      page << "\n" << effect.caption << "\n\n![" << effect.name << "](" << effect.name << ".jpg)\n";
      std::printf("%s\n", effect.name.c_str());
    }
  }
  page.flush();
  if (!page) throw std::runtime_error((folder / "README.md").string() + ": cannot be written");
  return 0;
}

}  // namespace
}  // namespace skylight::sim

int main(int count, char** values) {
  if (count != 2) {
    std::fprintf(stderr, "usage: skylight_gallery FOLDER\n");
    return 2;
  }
  try {
    return skylight::sim::run(values[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "skylight_gallery: %s\n", error.what());
    return 1;
  }
}
