// Every key of the configuration that is the service's own (the tracker's: tracker_fields.cpp; a live
// camera's: source_fields.cpp): its range, its unit, and what it is for.
#include <algorithm>
#include <cmath>

#include "service/config.hpp"
#include "settings/fields.hpp"

namespace skylight {

using settings::Fields;

namespace service {

void describe(Fields& fields, FilterConfig& filter);
void describe(Fields& fields, CameraSourceConfig& source);
void describe(Fields& fields, FloorTag& tag);
void describe(Fields& fields, FloorConfig& floor);

namespace {

using settings::Rules;

constexpr std::string_view kIdPattern = "^[A-Za-z0-9_-]{1,64}$";
constexpr std::string_view kIdWords = "an id: 1 to 64 letters, digits, _ and -";

Rules id_rules(std::string_view help, bool required = true) {
  return {.pattern = kIdPattern, .pattern_words = kIdWords, .required = required, .help = help};
}

constexpr Rules kPath{
    .min_length = 1, .required = true, .help = "Relative to the configuration file's folder."};
constexpr Rules kLoop{.help = "Begins again at its end; times go on."};
constexpr Rules kStart{
    .min = 0,
    .max = 9e9,
    .unit = "s",
    .help = "Capture time of the first frame, Unix seconds. Absent: when the source is opened."};
constexpr Rules kPlace{.min = -1e4, .max = 1e4, .unit = "m"};
constexpr Rules kAngle{.min = -6.3, .max = 6.3, .unit = "rad"};
constexpr Rules kSurface{.min = -1,
                         .max = 5,
                         .unit = "m",
                         .help = "Height above the floor of the surface that the picture shows."};

Rules with_help(Rules rules, std::string_view help, bool required = false) {
  rules.help = help;
  rules.required = required;
  return rules;
}

bool is_loopback(std::string_view host) {
  // 127.0.0.0/8 as numbers: a name may begin with "127." too.
  const bool is_numbers = host.find_first_not_of("0123456789.") == std::string_view::npos;
  return host == "localhost" || host == "::1" || (is_numbers && host.starts_with("127."));
}

template <class T>
bool has_id(const std::vector<T>& list, std::string_view id) {
  return std::any_of(list.begin(), list.end(), [&](const T& each) { return each.id == id; });
}

std::string at(std::string_view list, std::size_t index, std::string_view key) {
  return std::string(list) + "[" + std::to_string(index) + "]." + std::string(key);
}

template <class T>
void check_ids(Fields& fields, std::string_view list_name, const std::vector<T>& list) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      fields.check(list[i].id != list[j].id, at(list_name, i, "id"),
                   "\"" + list[i].id + "\" is the id of " + std::string(list_name) + "[" + std::to_string(j) +
                       "] too");
    }
  }
}

void check_camera(Fields& fields, const Config& config, const std::string& path, const std::string& id) {
  fields.check(has_id(config.cameras, id), path, "no camera in cameras has the id \"" + id + "\"");
}

void check_tags_differ(Fields& fields, const Config& config, std::size_t first, std::size_t second) {
  const auto& a = config.robots[first].tag;
  const auto& b = config.robots[second].tag;
  if (!a || !b || a->id != b->id || a->family != b->family) return;
  fields.check(
      false, at("robots", second, "tag"),
      b->family + " " + std::to_string(b->id) + " is the tag of robots[" + std::to_string(first) + "] too");
}

void check_floor_tags(Fields& fields, const CameraConfig& camera) {
  for (std::size_t i = 0; i < camera.floor_tags.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const FloorTag& tag = camera.floor_tags[i];
      fields.check(
          tag.id != camera.floor_tags[j].id || tag.family != camera.floor_tags[j].family,
          at("floor_tags", i, "id"),
          tag.family + " " + std::to_string(tag.id) + " is floor_tags[" + std::to_string(j) + "] too");
    }
  }
}

const std::string* device_of(const CameraConfig& camera) {
  const auto* input = camera.source ? std::get_if<V4l2Input>(&camera.source->input) : nullptr;
  return input != nullptr ? &input->device : nullptr;
}

/// What the type cameras asks of the cameras, and what it cannot do.
void check_live(Fields& fields, const Config& config) {
  if (!std::holds_alternative<CamerasSource>(config.source.input)) return;
  fields.check(!config.cameras.empty(), "source.type", "is cameras, and there are none in cameras");
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    fields.check(config.cameras[i].source.has_value(), at("cameras", i, "source"),
                 "is missing: source.type is cameras");
    const std::string* device = device_of(config.cameras[i]);
    for (std::size_t j = 0; device != nullptr && j < i; ++j) {
      const std::string* other = device_of(config.cameras[j]);
      fields.check(other == nullptr || *other != *device, at("cameras", i, "source.device"),
                   "\"" + *device + "\" is the device of cameras[" + std::to_string(j) + "] too");
    }
  }
  for (std::size_t i = 0; i < config.appearances.size(); ++i) {
    fields.check(
        !config.appearances[i].cut_from_frame, at("appearances", i, "cut_from_frame"),
        "contradicts source.type cameras, whose first frame is another one each time: draw the box over "
        "the API (POST /api/v1/appearances)");
  }
}

/// What one section says of another.
void check_references(Fields& fields, const Config& config) {
  check_ids(fields, "cameras", config.cameras);
  check_ids(fields, "appearances", config.appearances);
  check_ids(fields, "robots", config.robots);
  const bool simulated = std::holds_alternative<SimulatorSource>(config.source.input);
  if (const auto* video = std::get_if<VideoSource>(&config.source.input)) {
    check_camera(fields, config, "source.camera", video->camera);
  } else if (const auto* folder = std::get_if<FolderSource>(&config.source.input)) {
    check_camera(fields, config, "source.camera", folder->camera);
  }
  check_live(fields, config);
  for (std::size_t i = 0; i < config.appearances.size(); ++i) {
    const auto& cut = config.appearances[i].cut_from_frame;
    if (!cut || (simulated && config.cameras.empty())) continue;  // then the scenario's cameras count
    check_camera(fields, config, at("appearances", i, "cut_from_frame.camera"), cut->camera);
  }
  for (std::size_t i = 0; i < config.robots.size(); ++i) {
    const auto& appearance = config.robots[i].appearance;
    const std::string path = at("robots", i, "appearance");
    const bool by_tag = config.robots[i].method.detector == DetectorKind::apriltag;
    fields.check(config.robots[i].tag || simulated || !by_tag, at("robots", i, "tag"),
                 "is missing: the detector apriltag needs it");
    for (std::size_t k = 0; k < i; ++k) check_tags_differ(fields, config, k, i);
    fields.check(appearance || simulated || by_tag, path,
                 "is missing: only a simulated robot brings its own");
    fields.check(!appearance || has_id(config.appearances, *appearance), path,
                 "no appearance in appearances has the id \"" + appearance.value_or("") + "\"");
  }
}

void describe_method(Fields& fields, MethodConfig& method) {
  fields.choice(
      "detector", method.detector,
      {{"orb", DetectorKind::orb},
       {"apriltag", DetectorKind::apriltag},
       {"homography", DetectorKind::homography}},
      {.help =
           "orb: features acquire, alignment of the picture tracks; the robot's tag, if it has one, takes "
           "over where that fails. apriltag: the tag alone. homography: find_object_2d's."});
  fields.field("filter", method.filter);
  fields.field("homography", method.homography, {.help = "Settings of the detector homography."});
}

}  // namespace

void describe(Fields& fields, ServerConfig& server) {
  fields.about("The one port for REST, page and stream.");
  fields.field("host", server.host,
               {.min_length = 1,
                .max_length = 255,
                .help = "Address or name to listen on. Any but this machine's own needs token_sha256."});
  fields.field("port", server.port, {.min = 0, .max = 65535, .help = "0: any free one."});
  fields.field("threads", server.threads, {.min = 1, .max = 64, .help = "Workers for REST requests."});
  fields.field("max_body_bytes", server.max_body_bytes,
               {.min = 1024, .max = 64 << 20, .unit = "bytes", .help = "Largest body of a request."});
  fields.field("token_sha256", server.token_sha256,
               {.pattern = "^[0-9a-f]{64}$",
                .pattern_words = "64 hex digits (0-9, a-f)",
                .help = "SHA-256 of the bearer token that writes need: printf %s \"$TOKEN\" | sha256sum."});
  fields.field("allowed_hosts", server.allowed_hosts,
               {.max_items = 100,
                .min_length = 1,
                .max_length = 255,
                .help = "Further names that requests may call this host."});
  fields.field("allowed_origins", server.allowed_origins,
               {.max_items = 100,
                .max_length = 300,
                .pattern = "^https?://[^/ ]+$",
                .pattern_words = "an origin such as https://lab.example:8443",
                .help = "Further pages that may write."});
  fields.check(is_loopback(server.host) || server.token_sha256, "host",
               "\"" + server.host + "\" can be reached from other machines: that needs server.token_sha256");
}

void describe(Fields& fields, SimulatorSource& source) {
  fields.field(
      "scenario", source.scenario,
      {.min_length = 1, .help = "Name of a scenario that comes along, or the path of a .json file."});
  fields.field("seed", source.seed, {.help = "Absent: the scenario's own."});
  fields.field("speed", source.speed, {.min = 0.01, .max = 100, .help = "Simulated seconds per second."});
}

void describe(Fields& fields, VideoSource& source) {
  fields.field("path", source.path, kPath);
  fields.field("camera", source.camera, id_rules("Id of the camera that took it."));
  fields.field("loop", source.loop, kLoop);
  fields.field("start_s", source.start_s, kStart);
}

void describe(Fields& fields, FolderSource& source) {
  fields.field("path", source.path, kPath);
  fields.field("camera", source.camera, id_rules("Id of the camera that took them."));
  fields.field(
      "frame_rate_hz", source.frame_rate_hz,
      {.above = 0, .max = 1000, .unit = "Hz", .help = "Images per second, in the order of their names."});
  fields.field("loop", source.loop, kLoop);
  fields.field("start_s", source.start_s, kStart);
}

void describe(Fields& fields, SourceConfig& source) {
  fields.about("Where frames come from.");
  fields.variant("type", source.input,
                 {{"simulator", "The built-in simulator."},
                  {"video", "A video file."},
                  {"folder", "A folder of images, or of an RGB-D recording in TUM's layout."},
                  {"cameras", "Live: what cameras[].source say."}});
}

void describe(Fields&, CamerasSource&) {}

void describe(Fields& fields, CameraPose& pose) {
  fields.about("Where the camera stands: its optical frame (z forward, x right, y down) in map.");
  fields.field("position_m", pose.position_m, with_help(kPlace, "x, y, z in map.", true));
  fields.field("quaternion_xyzw", pose.quaternion_xyzw,
               {.min = -1.001, .max = 1.001, .help = "Of length 1."});
  fields.field(
      "rpy_rad", pose.rpy_rad,
      with_help(
          kAngle,
          "Roll, pitch, yaw about fixed x, y, z of map, in this order. Straight down is [3.14159, 0, yaw]."));
  fields.exactly_one_of({"quaternion_xyzw", "rpy_rad"});
  if (pose.quaternion_xyzw) {
    const auto& [x, y, z, w] = *pose.quaternion_xyzw;
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    fields.check(std::abs(length - 1.0) <= 1e-3, "quaternion_xyzw",
                 "has the length " + std::to_string(length) + ", allowed 0.999 to 1.001");
  }
}

void describe(Fields& fields, OverheadPose& pose) {
  fields.about("A camera that looks straight down.");
  fields.field(
      "height_m", pose.height_m,
      {.min = 0.1, .max = 100, .unit = "m", .required = true, .help = "Of the camera above the floor."});
  fields.field("position_m", pose.position_m,
               with_help(kPlace, "x, y in map of the place below the camera."));
  fields.field("yaw_rad", pose.yaw_rad,
               with_help(kAngle, "From map x to the right side of the picture, counter-clockwise."));
  fields.field("metres_per_pixel", pose.metres_per_pixel,
               {.min = 1e-5,
                .max = 1,
                .unit = "m",
                .help = "On the floor; instead of intrinsics, where these are unknown."});
  fields.field("size_px", pose.size_px,
               {.min = 1,
                .max = Intrinsics::kLargestSide,
                .unit = "px",
                .help = "Width and height; with metres_per_pixel."});
  fields.check(pose.metres_per_pixel.has_value() == pose.size_px.has_value(), "",
               "metres_per_pixel and size_px go together");
}

void describe(Fields& fields, CameraConfig& camera) {
  fields.about("A fixed camera: lens and sensor (intrinsics), and where it stands.");
  fields.field("id", camera.id, id_rules("Name of the camera."));
  fields.field(
      "calibration", camera.calibration,
      {.min_length = 1,
       .help =
           "File that skylight calibrate wrote, relative to the configuration file's folder: lens, "
           "place and how well both are known. Instead of all other keys but id, floor_tags and source."});
  fields.field("intrinsics", camera.intrinsics);
  fields.field("map_from_camera", camera.map_from_camera);
  fields.field("overhead", camera.overhead, {.help = "Instead of map_from_camera."});
  fields.field("uncertainty", camera.uncertainty, {.help = "Absent: known exactly."});
  fields.field(
      "floor_tags", camera.floor_tags,
      {.max_items = 1000,
       .help = "By which it is calibrated again where it was moved and camera_watch.recalibrate says so; "
               "at least two, far apart."});
  check_floor_tags(fields, camera);
  fields.field("source", camera.source, {.help = "Counts where source.type is cameras."});
  fields.exactly_one_of({"calibration", "map_from_camera", "overhead"});
  fields.check(!(camera.calibration && (camera.intrinsics || camera.uncertainty)), "calibration",
               "says intrinsics and uncertainty itself: give only the file");
  const bool scaled = camera.overhead && camera.overhead->metres_per_pixel;
  fields.check(camera.intrinsics || scaled || camera.calibration, "intrinsics",
               "is missing, and there is no overhead.metres_per_pixel");
  fields.check(!(camera.intrinsics && scaled), "overhead.metres_per_pixel",
               "contradicts intrinsics: give only one");
}

void describe(Fields& fields, CutConfig& cut) {
  fields.about("A box drawn on the source's first frame.");
  fields.field("camera", cut.camera, id_rules("Id of the camera."));
  fields.field("box_px", cut.box_px,
               {.min = 0,
                .max = Intrinsics::kLargestSide,
                .unit = "px",
                .required = true,
                .help = "Left column, top row, width, height; [3, 3, 2, 2] are the pixels 3 and 4."});
  fields.field("yaw_rad", cut.yaw_rad, with_help(kAngle, "The robot's yaw in map in that frame."));
  fields.check(cut.box_px[2] >= 8 && cut.box_px[3] >= 8, "box_px", "is less than 8 px wide or high");
}

void describe(Fields& fields, AppearanceConfig& appearance) {
  fields.about("What a robot looks like from above. Robots that look the same share one.");
  fields.field("id", appearance.id, id_rules("Name of the appearance."));
  fields.field(
      "image", appearance.image,
      {.min_length = 1,
       .help = "Picture from above, the robot's front up; relative to the configuration file's folder."});
  fields.field("metres_per_pixel", appearance.metres_per_pixel,
               {.min = 1e-5, .max = 0.1, .unit = "m", .help = "Scale of the image."});
  fields.field("cut_from_frame", appearance.cut_from_frame,
               {.help = "Instead of image; the camera gives the scale."});
  fields.field("surface_height_m", appearance.surface_height_m, kSurface);
  fields.field(
      "reference_point_m", appearance.reference_point_m,
      {.min = -5, .max = 5, .unit = "m", .help = "base_link from the picture's centre: forward, left."});
  fields.exactly_one_of({"image", "cut_from_frame"});
  fields.check(!appearance.image || appearance.metres_per_pixel, "metres_per_pixel",
               "is missing: the scale of image");
  fields.check(!(appearance.cut_from_frame && appearance.metres_per_pixel), "metres_per_pixel",
               "contradicts cut_from_frame: the camera gives the scale");
}

void describe(Fields& fields, InitialPose& pose) {
  fields.about("Where the robot stands at the first frame, in map.");
  fields.field("x_m", pose.x_m, with_help(kPlace, "", true));
  fields.field("y_m", pose.y_m, with_help(kPlace, "", true));
  fields.field("yaw_rad", pose.yaw_rad, kAngle);
}

void describe(Fields& fields, FilterConfig& filter) {
  fields.variant("type", filter.kind,
                 {{"motion", "Several ways of moving at once, with odometry, smoothing and prediction."},
                  {"window", "The paper's window filter."}});
}

void describe(Fields& fields, PictureMounting& mounting) {
  fields.about("Where this robot's picture lies, known better than from the picture.");
  fields.field("position_m", mounting.position_m,
               {.min = -5,
                .max = 5,
                .unit = "m",
                .required = true,
                .help = "The picture's middle in base_link: forward, left."});
  fields.field("yaw_rad", mounting.yaw_rad,
               {.min = -6.3,
                .max = 6.3,
                .unit = "rad",
                .help = "Its way up from the robot's forward direction, counter-clockwise."});
}

void describe(Fields& fields, RobotConfig& robot) {
  fields.about(
      "One robot. Its detector and filter are those of the section tracker, but for what it says itself.");
  fields.field("id", robot.id, id_rules("Name of the robot."));
  fields.field("appearance", robot.appearance,
               id_rules("Id of its appearance. A simulated robot may leave it to the scenario; the detector "
                        "apriltag needs none.",
                        false));
  fields.field("surface_height_m", robot.surface_height_m,
               with_help(kSurface, "Where a payload raises this robot's surface; absent: the appearance's."));
  fields.field(
      "picture_mounting", robot.picture_mounting,
      {.help = "Absent: as the appearance's reference_point_m has it. skylight calibrate robot tells it."});
  fields.field("tag", robot.tag, {.help = "Absent: none; with the simulator, the scenario's."});
  describe_method(fields, robot.method);
  fields.field("initial_pose", robot.initial_pose);
}

void describe(Fields& fields, TrackingConfig& tracker) {
  fields.about("How robots are detected and filtered, unless they say otherwise.");
  describe_method(fields, tracker.method);
  fields.field("search", tracker.search);
  fields.field("depth", tracker.depth);
  fields.field("audit_interval", tracker.audit_interval,
               {.min = 0,
                .max = 1000000,
                .unit = "frames",
                .help = "Between second opinions on a tracked robot; 0: never."});
}

void describe(Fields& fields, HistoryConfig& history) {
  fields.about("Poses kept in memory, per robot.");
  fields.field("max_age_s", history.max_age_s, {.min = 1, .max = 86400, .unit = "s"});
  fields.field("max_entries", history.max_entries, {.min = 1, .max = 10'000'000});
}

void describe(Fields& fields, WatchConfig& watch) {
  fields.about(
      "Whether each camera still hangs as it did: fixed features of the floor against their places.");
  fields.field("enabled", watch.enabled, {.help = "false: cameras are not watched."});
  fields.field("recalibrate", watch.recalibrate,
               {.help = "true: a camera that was moved is calibrated by its floor_tags, where it has some."});
  fields.check(watch.enabled || !watch.recalibrate, "recalibrate",
               "needs cameras to be watched: enabled is false");
  describe(fields, watch.settings);
}

void describe(Fields& fields, PredictionConfig& prediction) {
  fields.field(
      "horizon_s", prediction.horizon_s,
      {.min = 0, .max = 60, .unit = "s", .help = "How far beyond the data a pose may be asked for."});
}

void describe(Fields& fields, LogConfig& log) {
  fields.choice("level", log.level,
                {{"trace", LogLevel::trace},
                 {"debug", LogLevel::debug},
                 {"info", LogLevel::info},
                 {"warn", LogLevel::warn},
                 {"error", LogLevel::error}},
                {.help = "The least that is logged."});
}

void describe(Fields& fields, Config& config) {
  fields.about("Configuration of the skylight service.");
  std::optional<std::string> schema;  // editors find the schema by it
  fields.field("$schema", schema, {.help = "Path or address of this schema, for editors."});
  fields.field("server", config.server);
  fields.field("source", config.source);
  fields.field("cameras", config.cameras,
               {.max_items = 64, .help = "With the simulator, empty: the scenario's."});
  fields.field("calibration_dir", config.calibration_dir,
               {.min_length = 1,
                .help = "Folder in which calibrations made over the API are kept, CAMERA.json each, of "
                        "cameras that name no file of their own; what is there counts instead of what the "
                        "camera itself says. Absent: they are lost when the service ends."});
  fields.field("appearances", config.appearances, {.max_items = 10000});
  fields.field("tracker", config.tracker);
  RobotConfig prototype;
  prototype.method = config.tracker.method;
  fields.list("robots", config.robots, prototype,
              {.max_items = 10000, .help = "With the simulator, empty: the scenario's."});
  fields.field("camera_watch", config.camera_watch);
  fields.field("floor", config.floor);
  fields.field("history", config.history);
  fields.field("prediction", config.prediction);
  fields.field("log", config.log);
  check_references(fields, config);
}

}  // namespace service
}  // namespace skylight
