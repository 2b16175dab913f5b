#include "sim/scenario/scenario_file.hpp"

#include <utility>

#include "settings/fields.hpp"
#include "sim/scenario/scenario_checks.hpp"

namespace skylight::sim {

using settings::Fields;

void describe(Fields& fields, FloorSpec& floor) {
  fields.about("The floor within the walls.");
  fields.choice("material", floor.material,
                {{"plain", FloorMaterial::plain},
                 {"tiles", FloorMaterial::tiles},
                 {"speckle", FloorMaterial::speckle},
                 {"concrete", FloorMaterial::concrete},
                 {"picture", FloorMaterial::picture}},
                {.help = "What it is made of; picture repeats an image file."});
  fields.field("color_rgb", floor.color_rgb,
               {.min = 0, .max = 255, .help = "Red, green, blue as the sensor sees them."});
  fields.field("contrast", floor.contrast,
               {.min = 0, .max = 1, .help = "Strength of the material's pattern."});
  fields.field("tile_m", floor.tile_m,
               {.min = 0.02, .max = 10, .unit = "m", .help = "Edge of a tile (material tiles)."});
  fields.field("picture", floor.picture,
               {.help = "Image file (material picture), relative to the scenario file."});
  fields.field(
      "picture_width_m", floor.picture_width_m,
      {.min = 0.01, .max = 200, .unit = "m", .help = "Width of one copy of the picture on the floor."});
  fields.field("friction", floor.friction,
               {.min = 0, .max = 2, .help = "Factor on the tyres' friction; 1 is dry and clean."});
  fields.check((floor.material == FloorMaterial::picture) == !floor.picture.empty(), "picture",
               "an image file goes with the material picture, and only with it");
}

void describe(Fields& fields, RoomSpec& room) {
  fields.about("The room. The origin of `map` is on the floor in its middle, x along size_m[0].");
  fields.field("size_m", room.size_m,
               {.min = 0.5, .max = 200, .unit = "m", .help = "Extent of the floor along x and y."});
  fields.field("wall_height_m", room.wall_height_m,
               {.min = 0, .max = 10, .unit = "m", .help = "0: walls that stop robots but are not seen."});
  fields.field("wall_rgb", room.wall_rgb, {.min = 0, .max = 255, .help = "Red, green, blue of the walls."});
  fields.field("floor", room.floor);
}

void describe(Fields& fields, LightSpec& light) {
  fields.about("The light, which comes from above.");
  fields.field("level", light.level, {.min = 0, .max = 4, .help = "Factor on every colour; 0 is dark."});
  fields.field("gradient", light.gradient,
               {.min = 0, .max = 1, .help = "Change of the light across the room, as a share."});
  fields.field("gradient_deg", light.gradient_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "Direction in map towards which it grows."});
  fields.field("contact_shadow", light.contact_shadow,
               {.min = 0, .max = 1, .help = "Share of the light missing at a robot's foot."});
}

void describe(Fields& fields, SensorSpec& sensor) {
  fields.about("Noise of the image sensor by its photon-transfer curve. Defaults: Sony IMX290 at 0 dB.");
  fields.field("noise", sensor.noise, {.help = "Off: the exact mean, rounded."});
  fields.field("full_well_e", sensor.full_well_e,
               {.min = 100, .max = 1e6, .unit = "electrons", .help = "Electrons at full scale with gain 1."});
  fields.field(
      "read_noise_e", sensor.read_noise_e,
      {.min = 0, .max = 1000, .unit = "electrons", .help = "Noise in the dark, standard deviation."});
  fields.field(
      "gain", sensor.gain,
      {.min = 1, .max = 64, .help = "Analogue gain: fewer electrons for the same picture, so more noise."});
}

void describe(Fields& fields, DepthSpec& depth) {
  fields.about("Depth beside each image, millimetres along the optical axis.");
  fields.field("enabled", depth.enabled, {.help = "Whether the camera measures depth."});
  fields.field("noise", depth.noise, {.help = "Off: the exact depth, rounded."});
  fields.field("noise_floor_m", depth.noise_floor_m,
               {.min = 0, .max = 1, .unit = "m", .help = "Standard deviation at 0.4 m."});
  fields.field(
      "noise_growth_per_m", depth.noise_growth_per_m,
      {.min = 0, .max = 1, .unit = "1/m", .help = "Grows with the square of the distance beyond 0.4 m."});
  fields.field("max_range_m", depth.max_range_m,
               {.min = 0.1, .max = 65, .unit = "m", .help = "No reading (0) beyond."});
}

void describe(Fields& fields, CameraSpec& camera) {
  fields.about("A fixed camera. Pixels: the centre of the top-left one is (0, 0).");
  fields.field("id", camera.id,
               {.min_length = 1,
                .max_length = 64,
                .pattern = "^[A-Za-z0-9_-]+$",
                .pattern_words = "letters, digits, _ and -",
                .help = "Name, unlike any other camera's."});
  fields.field("position_m", camera.position_m,
               {.min = -200,
                .max = 200,
                .unit = "m",
                .help = "Optical centre in map: x, y, and the height above the floor."});
  fields.field("rpy_deg", camera.rpy_deg,
               {.min = -360,
                .max = 360,
                .unit = "deg",
                .help = "Roll, pitch, yaw about map x, y, z, in this order, away from straight down with the "
                        "image's right side towards map x."});
  fields.field("width_px", camera.width_px,
               {.min = 16, .max = 8192, .unit = "px", .help = "Width of the picture."});
  fields.field("height_px", camera.height_px,
               {.min = 16, .max = 8192, .unit = "px", .help = "Height of the picture."});
  fields.choice("lens", camera.lens,
                {{"brown_conrady", Lens::brown_conrady}, {"kannala_brandt", Lens::kannala_brandt}},
                {.help = "brown_conrady: pinhole with distortion; kannala_brandt: fisheye."});
  fields.field("fx_px", camera.fx_px, {.min = 10, .max = 1e5, .unit = "px", .help = "Focal length along x."});
  fields.field("fy_px", camera.fy_px, {.min = 10, .max = 1e5, .unit = "px", .help = "Focal length along y."});
  fields.field(
      "cx_px", camera.cx_px,
      {.min = 0, .max = 8191, .unit = "px", .help = "Principal point; absent: the picture's middle."});
  fields.field(
      "cy_px", camera.cy_px,
      {.min = 0, .max = 8191, .unit = "px", .help = "Principal point; absent: the picture's middle."});
  fields.field(
      "distortion", camera.distortion,
      {.min = -10, .max = 10, .help = "brown_conrady: k1 k2 p1 p2 k3; kannala_brandt: k1 k2 k3 k4 and 0."});
  fields.field("frame_rate_hz", camera.frame_rate_hz,
               {.min = 0.01, .max = 1000, .unit = "Hz", .help = "Frames a second."});
  fields.field("exposure_s", camera.exposure_s,
               {.above = 0, .max = 10, .unit = "s", .help = "Exposure of each frame, all rows at once."});
  fields.field("first_frame_s", camera.first_frame_s,
               {.min = 0,
                .max = 3600,
                .unit = "s",
                .help = "Start of the first exposure after the scenario's start."});
  fields.field("vignetting", camera.vignetting,
               {.min = 0, .max = 1, .help = "Share of the light missing in the picture's corners."});
  fields.field("sensor", camera.sensor);
  fields.field("depth", camera.depth);
}

void describe(Fields& fields, PictureSpec& picture) {
  fields.about("The picture on a robot's top plate: drawn from a seed, or an image file.");
  fields.field(
      "file", picture.file,
      {.help = "Image file, relative to the scenario file; its up is the robot's front. Absent: drawn."});
  fields.field(
      "seed", picture.seed,
      {.help =
           "Of the drawn picture; 0: by the robot's place in the list. Equal seeds make identical robots."});
  fields.field("width_m", picture.width_m,
               {.min = 0.01,
                .max = 10,
                .unit = "m",
                .help = "Width on the plate, at most the plate's; absent: the plate's."});
}

void describe(Fields& fields, StartSpec& start) {
  fields.about("Where base_link stands at the start, in map.");
  fields.field("x_m", start.x_m, {.min = -200, .max = 200, .unit = "m"});
  fields.field("y_m", start.y_m, {.min = -200, .max = 200, .unit = "m"});
  fields.field("yaw_deg", start.yaw_deg,
               {.min = -360, .max = 360, .unit = "deg", .help = "Counter-clockwise from map x."});
}

void describe(Fields& fields, LineStep& step) {
  fields.field("distance_m", step.distance_m,
               {.above = 0, .max = 1000, .unit = "m", .help = "Straight ahead."});
  fields.field("speed_mps", step.speed_mps, {.above = 0, .max = 10, .unit = "m/s"});
}

void describe(Fields& fields, ArcStep& step) {
  fields.field("radius_m", step.radius_m,
               {.above = 0, .max = 1000, .unit = "m", .help = "Of the circle that base_link drives."});
  fields.field(
      "angle_deg", step.angle_deg,
      {.min = -36000, .max = 36000, .unit = "deg", .help = "Positive to the left, negative to the right."});
  fields.field("speed_mps", step.speed_mps, {.above = 0, .max = 10, .unit = "m/s"});
  fields.check(step.angle_deg != 0.0, "angle_deg", "must not be 0");
}

void describe(Fields& fields, TurnStep& step) {
  fields.field(
      "angle_deg", step.angle_deg,
      {.min = -36000, .max = 36000, .unit = "deg", .help = "Positive to the left, negative to the right."});
  fields.field("rate_degps", step.rate_degps, {.above = 0, .max = 720, .unit = "deg/s"});
  fields.check(step.angle_deg != 0.0, "angle_deg", "must not be 0");
}

void describe(Fields& fields, WaypointsStep& step) {
  fields.field("points_m", step.points_m,
               {.min = -200,
                .max = 200,
                .unit = "m",
                .min_items = 1,
                .max_items = 10000,
                .required = true,
                .help = "Places in map, [x, y] each."});
  fields.field("speed_mps", step.speed_mps, {.above = 0, .max = 10, .unit = "m/s"});
  fields.field("loop", step.loop, {.help = "From the last point on to the first, for ever."});
}

void describe(Fields& fields, DriveStep& step) {
  fields.field("v_mps", step.v_mps, {.min = -10, .max = 10, .unit = "m/s", .help = "Forward speed."});
  fields.field("w_degps", step.w_degps,
               {.min = -720, .max = 720, .unit = "deg/s", .help = "Yaw rate, positive to the left."});
  fields.field("for_s", step.for_s, {.above = 0, .max = 604800, .unit = "s", .help = "How long."});
}

void describe(Fields& fields, StopStep& step) {
  fields.field("for_s", step.for_s, {.above = 0, .max = 604800, .unit = "s", .help = "How long."});
}

void describe(Fields& fields, RepeatStep& step) {
  fields.field("times", step.times, {.min = 0, .max = 1e6, .help = "0: for ever."});
  fields.field("steps", step.steps,
               {.min_items = 1, .max_items = 1000, .required = true, .help = "What is repeated."});
}

void describe(Fields& fields, ProgramStep& step) {
  fields.about("One step of a motion program.");
  fields.variant("do", step.action,
                 {{"line", "Straight ahead for a distance."},
                  {"arc", "Along a circle."},
                  {"turn", "On the spot."},
                  {"waypoints", "From place to place by pure pursuit."},
                  {"drive", "Constant speed and yaw rate for a time, not steered by where the robot is."},
                  {"stop", "Stand still."},
                  {"repeat", "Other steps, again and again."}},
                 {.required = true, .help = "What the robot does."});
}

void describe(Fields& fields, RobotSpec& robot) {
  fields.about("A robot. After the last step of its program it stands still.");
  fields.field("id", robot.id,
               {.min_length = 1,
                .max_length = 64,
                .pattern = "^[A-Za-z0-9_-]+$",
                .pattern_words = "letters, digits, _ and -",
                .required = true,
                .help = "Name, unlike any other robot's."});
  fields.choice("model", robot.model, {{"waffle_pi", RobotModelName::waffle_pi}},
                {.help = "Kind of robot; waffle_pi: TurtleBot3 Waffle Pi."});
  fields.field("picture", robot.picture);
  fields.field("start", robot.start);
  fields.field("program", robot.program, {.max_items = 1000, .help = "What it does, step by step."});
}

void describe(Fields& fields, Scenario& scenario) {
  fields.about("A scenario of Skylight's simulator: a room, cameras, robots and what they do.");
  std::string ignored_schema_reference;
  fields.field("$schema", ignored_schema_reference, {.help = "For editors: where this schema lies."});
  fields.field("name", scenario.name, {.max_length = 100, .help = "Absent: the file's name."});
  fields.field("description", scenario.description,
               {.max_length = 400, .help = "One line: what the scenario is for."});
  fields.field("seed", scenario.seed, {.help = "Fixes floor and noise; the same seed gives the same bytes."});
  fields.field("start_unix_s", scenario.start_unix_s,
               {.min = 0, .max = 4e9, .unit = "s", .help = "Unix time of the start."});
  fields.field("duration_s", scenario.duration_s,
               {.min = 0, .max = 604800, .unit = "s", .help = "0: endless."});
  fields.field("room", scenario.room);
  fields.field("light", scenario.light);
  fields.field("cameras", scenario.cameras,
               {.min_items = 1, .max_items = 16, .help = "What is seen from where."});
  fields.field("robots", scenario.robots, {.max_items = 500, .help = "Who drives about."});
  const auto problem = find_problem(scenario);
  fields.check(!problem, problem ? problem->path : "", problem ? problem->message : "");
}

Scenario load_scenario(const std::filesystem::path& file) {
  auto scenario = settings::read<Scenario>(settings::load(file));
  if (scenario.name.empty()) scenario.name = file.stem().string();
  scenario.folder = file.parent_path();
  return scenario;
}

Scenario parse_scenario(std::string_view text, const std::string& name) {
  auto scenario = settings::read<Scenario>(settings::parse(text, name));
  if (scenario.name.empty()) scenario.name = name;
  return scenario;
}

std::string scenario_schema() {
  return settings::schema<Scenario>("Skylight scenario");
}

std::string write_scenario(const Scenario& scenario) {
  return settings::write(scenario);
}

void validate(const Scenario& scenario) {
  try {
    parse_scenario(write_scenario(scenario), scenario.name);
  } catch (const settings::Error& error) {
    throw std::invalid_argument(error.key_path.empty() ? error.message
                                                       : error.key_path + ": " + error.message);
  }
}

}  // namespace skylight::sim
