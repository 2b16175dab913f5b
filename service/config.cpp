#include "service/config.hpp"

#include <algorithm>
#include <cctype>

#include <unistd.h>

#include "settings/fields.hpp"

namespace skylight::service {
namespace {

constexpr std::string_view kPrefix = "SKYLIGHT_";

/// Variables that other parts of the repository read: where the tests find their data.
constexpr std::array kNoConfiguration{std::string_view("SKYLIGHT_SHARED_DATA")};

/// "SKYLIGHT_ROBOTS__0__ID" as "robots[0].id".
std::string key_path(std::string_view variable) {
  std::string path;
  std::string_view rest = variable.substr(kPrefix.size());
  while (true) {
    const std::size_t end = rest.find("__");
    const std::string_view step = rest.substr(0, end);
    const bool is_index = !step.empty() && std::all_of(step.begin(), step.end(),
                                                       [](unsigned char c) { return std::isdigit(c) != 0; });
    if (is_index) {
      path += "[" + std::string(step) + "]";
    } else {
      if (!path.empty()) path += '.';
      std::transform(step.begin(), step.end(), std::back_inserter(path),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    }
    if (end == std::string_view::npos) return path;
    rest.remove_prefix(end + 2);
  }
}

/// The variable's value over the document. A name without "__" would only be a whole section: the likelier
/// cause is a single underscore.
void set_variable(settings::Document& document, const std::string& name, const std::string& value) {
  if (name.find("__") == std::string::npos) {
    throw settings::Error(name, 0, "",
                          "names no key: write the path with two underscores between its steps, as in "
                          "SKYLIGHT_SERVER__PORT");
  }
  settings::set(document, key_path(name), value, name);
}

class Resolver {
 public:
  explicit Resolver(const std::optional<std::filesystem::path>& file) {
    if (file) folder_ = file->parent_path();
  }
  void operator()(std::string& path) const {
    const std::filesystem::path given(path);
    if (given.is_relative()) path = (folder_ / given).lexically_normal().string();
  }

 private:
  std::filesystem::path folder_;
};

void resolve_paths(Config& config, const Resolver& resolve) {
  if (auto* simulator = std::get_if<SimulatorSource>(&config.source.input)) {
    const std::string& scenario = simulator->scenario;
    const bool is_file = scenario.ends_with(".json") || scenario.find('/') != std::string::npos;
    if (is_file) resolve(simulator->scenario);
  } else if (auto* video = std::get_if<VideoSource>(&config.source.input)) {
    resolve(video->path);
  } else if (auto* folder = std::get_if<FolderSource>(&config.source.input)) {
    resolve(folder->path);
  }
  for (AppearanceConfig& appearance : config.appearances) {
    if (appearance.image) resolve(*appearance.image);
  }
  for (CameraConfig& camera : config.cameras) {
    if (camera.calibration) resolve(*camera.calibration);
  }
  if (config.calibration_dir) resolve(*config.calibration_dir);
}

/// Straight down: x right, y down in the picture, so that map z is -z of the camera.
Eigen::Isometry3d isometry(const OverheadPose& pose) {
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  map_from_camera.translation() << pose.position_m[0], pose.position_m[1], pose.height_m;
  const Eigen::Vector3d straight_down(1.0, -1.0, -1.0);
  map_from_camera.linear() = Eigen::AngleAxisd(pose.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
                             straight_down.asDiagonal();
  return map_from_camera;
}

Eigen::Isometry3d isometry(const CameraPose& pose) {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  if (pose.quaternion_xyzw) {
    const auto& [x, y, z, w] = *pose.quaternion_xyzw;
    rotation = Eigen::Quaterniond(w, x, y, z).normalized();
  } else {
    const auto& [roll, pitch, yaw] = pose.rpy_rad.value();
    rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
               Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  }
  Eigen::Isometry3d map_from_camera = Eigen::Isometry3d::Identity();
  map_from_camera.linear() = rotation.toRotationMatrix();
  map_from_camera.translation() << pose.position_m[0], pose.position_m[1], pose.position_m[2];
  return map_from_camera;
}

/// A pinhole whose focal length gives the scale on the floor.
Intrinsics scaled_intrinsics(const OverheadPose& pose) {
  const auto& [width, height] = pose.size_px.value();
  const double focal_px = pose.height_m / pose.metres_per_pixel.value();
  return {.width_px = width,
          .height_px = height,
          .fx_px = focal_px,
          .fy_px = focal_px,
          .cx_px = (width - 1) / 2.0,
          .cy_px = (height - 1) / 2.0};
}

}  // namespace

std::map<std::string, std::string> skylight_environment() {
  std::map<std::string, std::string> variables;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    const std::string_view text(*entry);
    const std::size_t equals = text.find('=');
    if (!text.starts_with(kPrefix) || equals == std::string_view::npos) continue;
    const std::string_view name = text.substr(0, equals);
    if (std::find(kNoConfiguration.begin(), kNoConfiguration.end(), name) != kNoConfiguration.end()) continue;
    variables.emplace(name, text.substr(equals + 1));
  }
  return variables;
}

std::filesystem::path calibration_path(const Config& config, const CameraConfig& camera) {
  if (camera.calibration) return *camera.calibration;
  if (!config.calibration_dir) return {};
  return std::filesystem::path(*config.calibration_dir) / (camera.id + ".json");
}

void read_calibrations(Config& config) {
  for (CameraConfig& camera : config.cameras) {
    const std::filesystem::path file = calibration_path(config, camera);
    std::error_code unknown;
    if (file.empty() || (!camera.calibration && !std::filesystem::exists(file, unknown))) continue;
    camera.calibrated.reset();
    CalibrationFile read = read_calibration(file);
    if (!read.map_from_camera)
      throw settings::Error(file.string(), 0, "map_from_camera",
                            "is missing: run skylight calibrate extrinsics");
    if (!camera.calibration) {  // the camera says itself how large its pictures are
      const Intrinsics said = camera_model(camera).intrinsics();
      if (said.width_px != read.intrinsics.width_px || said.height_px != read.intrinsics.height_px)
        throw settings::Error(file.string(), 0, "intrinsics",
                              "is of pictures of " + std::to_string(read.intrinsics.width_px) + " x " +
                                  std::to_string(read.intrinsics.height_px) + " px, camera '" + camera.id +
                                  "' has " + std::to_string(said.width_px) + " x " +
                                  std::to_string(said.height_px) + " px");
    }
    camera.calibrated = std::move(read);
  }
}

Config load_config(const ConfigLayers& layers) {
  settings::Document document =
      layers.file ? settings::load(*layers.file) : settings::parse("{}", "configuration");
  for (const auto& [name, value] : layers.environment) set_variable(document, name, value);
  for (const Override& flag : layers.flags) settings::set(document, flag.assignment, flag.origin);
  auto config = settings::read<Config>(document);
  resolve_paths(config, Resolver(layers.file));
  read_calibrations(config);
  return config;
}

std::string config_schema() {
  return settings::schema<Config>("Skylight configuration");
}

std::string config_json(const Config& config) {
  return settings::write(config);
}

CameraModel camera_model(const CameraConfig& camera) {
  if (camera.calibration || camera.calibrated) return camera_model(camera.calibrated.value());
  const Intrinsics intrinsics =
      camera.intrinsics ? *camera.intrinsics : scaled_intrinsics(camera.overhead.value());
  return {intrinsics,
          camera.overhead ? isometry(*camera.overhead) : isometry(camera.map_from_camera.value())};
}

CameraUncertainty camera_uncertainty(const CameraConfig& camera) {
  return camera.calibrated ? uncertainty_of(*camera.calibrated)
                           : camera_uncertainty(camera.uncertainty.value_or(CalibrationSigmas{}));
}

FrameCut frame_cut(const AppearanceConfig& appearance) {
  const CutConfig& cut = appearance.cut_from_frame.value();
  const auto& [left, top, width, height] = cut.box_px;
  return {.box_px = cv::Rect2d(left - 0.5, top - 0.5, width,
                               height),  // outer edges: half a pixel before the centre
          .yaw = cut.yaw_rad,
          .surface_height_m = appearance.surface_height_m};
}

RobotSpec robot_spec(const RobotConfig& robot, std::shared_ptr<const Appearance> appearance) {
  RobotSpec spec{.id = robot.id,
                 .appearance = std::move(appearance),
                 .surface_height_m = robot.surface_height_m,
                 .picture_mounting = std::nullopt,
                 .tag = robot.tag,
                 .detector = robot.method.detector,
                 .filter = robot.method.filter.kind,
                 .homography = robot.method.homography,
                 .initial_pose = std::nullopt};
  if (const auto& mounting = robot.picture_mounting)
    spec.picture_mounting =
        Pose2{mounting->position_m[0], mounting->position_m[1], wrap_angle(mounting->yaw_rad)};
  if (robot.initial_pose) {
    spec.initial_pose =
        Pose2{robot.initial_pose->x_m, robot.initial_pose->y_m, wrap_angle(robot.initial_pose->yaw_rad)};
  }
  return spec;
}

RobotConfig robot_config(const RobotSpec& spec) {
  RobotConfig robot{
      .id = spec.id, .appearance = std::nullopt, .surface_height_m = spec.surface_height_m, .tag = spec.tag};
  if (spec.appearance) robot.appearance = spec.appearance->id();
  if (const auto& at = spec.picture_mounting)
    robot.picture_mounting = PictureMounting{{at->x, at->y}, at->yaw};
  robot.method.detector = spec.detector;
  robot.method.filter.kind = spec.filter;
  robot.method.homography = spec.homography;
  if (spec.initial_pose)
    robot.initial_pose = InitialPose{spec.initial_pose->x, spec.initial_pose->y, spec.initial_pose->yaw};
  return robot;
}

FloorMask floor_mask(const MaskConfig& mask) {
  FloorMask out{.name = mask.name, .corners = {}};
  for (const auto& [x, y] : mask.corners_m) out.corners.emplace_back(x, y);
  return out;
}

TrackerConfig tracker_config(const Config& config) {
  TrackerConfig tracker;
  tracker.search = config.tracker.search;
  tracker.depth = config.tracker.depth;
  tracker.audit_interval = config.tracker.audit_interval;
  for (const MaskConfig& mask : config.floor.masks) tracker.floor_masks.push_back(floor_mask(mask));
  tracker.history = {.max_age = from_seconds(config.history.max_age_s),
                     .max_entries = config.history.max_entries};
  const bool calibrated =
      std::any_of(config.cameras.begin(), config.cameras.end(),
                  [](const CameraConfig& camera) { return camera.uncertainty || camera.calibrated; });
  for (const CameraConfig& camera : config.cameras) {
    if (!calibrated) continue;
    tracker.calibration.push_back(camera_uncertainty(camera));
  }
  return tracker;
}

}  // namespace skylight::service
