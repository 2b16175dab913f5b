// The service's configuration: one JSON file (comments allowed), see deploy/skylight.sample.json and the
// schema beside it. Defaults live here, what is allowed stands in config_fields.cpp and tracker_fields.cpp.
//
// Layers, each over the one before: these defaults, the file, environment variables, flags. A variable is
// SKYLIGHT_ and the key path in capitals with two underscores between its steps (keys have single ones):
//   SKYLIGHT_SERVER__MAX_BODY_BYTES=65536     server.max_body_bytes
//   SKYLIGHT_ROBOTS__0__ID=seven              robots[0].id
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

#include "service/calibration/file.hpp"
#include "service/floor_tag.hpp"
#include "service/sources/live/kinds.hpp"
#include "settings/document.hpp"
#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"
#include "tracker/camera_uncertainty.hpp"
#include "tracker/camera_watch.hpp"
#include "tracker/tracker.hpp"

namespace skylight {
namespace settings {
class Fields;
}

// How the tracker's own settings read, for the Fields of settings/fields.hpp.
void describe(settings::Fields& fields, Intrinsics& intrinsics);
void describe(settings::Fields& fields, CalibrationSigmas& sigmas);
void describe(settings::Fields& fields, MotionFilterConfig& filter);
void describe(settings::Fields& fields, WindowFilterConfig& filter);
void describe(settings::Fields& fields, HomographyConfig& homography);
void describe(settings::Fields& fields, TagSpec& tag);
void describe(settings::Fields& fields, SearchConfig& search);
void describe(settings::Fields& fields, DepthConfig& depth);
void describe(settings::Fields& fields, CameraWatchConfig& watch);

namespace service {

struct ServerConfig {
  std::string host = "127.0.0.1";  ///< any address but this machine's own needs a token
  std::uint16_t port = 8080;       ///< 0: any free one
  std::size_t threads = 2;         ///< workers for REST requests
  std::size_t max_body_bytes = 1024 * 1024;
  std::optional<std::string> token_sha256{};  ///< 64 hex digits: SHA-256 of the bearer token
  std::vector<std::string> allowed_hosts{};
  std::vector<std::string> allowed_origins{};
};

struct SimulatorSource {
  std::string scenario = "demo";        ///< a name, or the path of a .json file
  std::optional<std::uint64_t> seed{};  ///< absent: the scenario's
  double speed = 1.0;                   ///< 1: real time
};

struct VideoSource {
  std::string path{};
  std::string camera{};  ///< id in Config::cameras
  bool loop = false;
  std::optional<double> start_s{};  ///< Unix seconds of the first frame; absent: when it is opened
};

struct FolderSource {
  std::string path{};  ///< images, taken in the order of their names
  std::string camera{};
  double frame_rate_hz = 30.0;
  bool loop = false;
  std::optional<double> start_s{};
};

/// Every camera brings its own: CameraConfig::source.
struct CamerasSource {};

struct SourceConfig {
  std::variant<SimulatorSource, VideoSource, FolderSource, CamerasSource> input{};
};

/// A camera of this machine; its pictures have the size that the camera is calibrated for.
struct V4l2Input {
  std::string device{};  ///< by preference under /dev/v4l/by-path, which stays the same
  PixelFormat format = PixelFormat::mjpg;
  double frame_rate_hz = 30.0;
  std::optional<int> exposure_us{};  ///< absent: automatic
  std::optional<int> gain{};         ///< in the device's units; absent: automatic
  int readout_us = 0;                ///< of a rolling shutter, first row to last
};

struct StreamInput {
  std::string url{};
  StreamTransport transport = StreamTransport::tcp;
  double open_timeout_s = 10.0;
};

enum class PostedClock : std::uint8_t { ours, own };

/// Pictures that another program posts.
struct PostedInput {
  PostedClock clock = PostedClock::ours;  ///< by which they are stamped; own: its offset is estimated
};

struct ReconnectConfig {
  double shortest_s = 0.5;  ///< between attempts; doubles up to the longest
  double longest_s = 10.0;
};

struct CameraSourceConfig {
  std::variant<V4l2Input, StreamInput, PostedInput> input{};
  double latency_s = 0.0;       ///< from the exposure to where a picture is dated, at the least
  double frozen_after_s = 2.0;  ///< of the same picture; 0: never
  double silence_s = 5.0;       ///< without a picture for so long it has failed
  ReconnectConfig reconnect{};
};

/// Exactly one of the two orientations, both of the optical frame (z forward, x right, y down) in `map`.
struct CameraPose {
  std::array<double, 3> position_m{};
  std::optional<std::array<double, 4>> quaternion_xyzw{};  ///< of length 1, to 0.001
  std::optional<std::array<double, 3>> rpy_rad{};          ///< about fixed x, y, z of `map`, in this order
};

/// A camera that looks straight down.
struct OverheadPose {
  double height_m = 0.0;               ///< above the floor
  std::array<double, 2> position_m{};  ///< in `map`
  double yaw_rad = 0.0;                ///< from map x to the right side of the picture, counter-clockwise
  std::optional<double> metres_per_pixel{};     ///< on the floor; instead of intrinsics
  std::optional<std::array<int, 2>> size_px{};  ///< of the picture, width and height; with metres_per_pixel
};

/// Exactly one of calibration, map_from_camera and overhead; without a calibration exactly one of intrinsics
/// and overhead.metres_per_pixel.
struct CameraConfig {
  std::string id{};
  std::optional<std::string> calibration{};  ///< file that `skylight calibrate` wrote; says all of the rest
  std::optional<CalibrationFile> calibrated{};  ///< what stands in its file, read by load_config()
  std::optional<Intrinsics> intrinsics{};
  std::optional<CameraPose> map_from_camera{};
  std::optional<OverheadPose> overhead{};
  std::optional<CalibrationSigmas> uncertainty{};  ///< absent: known exactly
  std::vector<FloorTag> floor_tags{};              ///< by which it may be calibrated by itself
  std::optional<CameraSourceConfig> source{};      ///< counts where Config::source is of the type cameras
};

/// A box drawn on the source's first frame.
struct CutConfig {
  std::string camera{};
  std::array<double, 4> box_px{};  ///< left column, top row, width, height: 3, 3, 2, 2 are the pixels 3 and 4
  double yaw_rad = 0.0;            ///< the robot's yaw in `map` in that frame
};

/// Exactly one of image and cut_from_frame; metres_per_pixel goes with image.
struct AppearanceConfig {
  std::string id{};
  std::optional<std::string> image{};
  std::optional<double> metres_per_pixel{};
  std::optional<CutConfig> cut_from_frame{};
  double surface_height_m = 0.0;
  std::array<double, 2> reference_point_m{};  ///< as in Picture: base_link from the picture's centre
};

struct InitialPose {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
};

/// Where a robot's picture is mounted.
struct PictureMounting {
  std::array<double, 2> position_m{};  ///< of its middle in base_link: forward, left
  double yaw_rad = 0.0;                ///< its way up from the robot's forward direction, counter-clockwise
};

struct FilterConfig {
  FilterSpec kind{};
};

/// How a robot is detected and filtered.
struct MethodConfig {
  DetectorKind detector = DetectorKind::orb;
  FilterConfig filter{};
  HomographyConfig homography{};
};

struct RobotConfig {
  std::string id{};
  std::optional<std::string>
      appearance;  ///< id in Config::appearances; absent: the scenario's (simulator), none (apriltag)
  std::optional<double> surface_height_m{};           ///< absent: the appearance's
  std::optional<PictureMounting> picture_mounting{};  ///< absent: as the appearance's reference point has it
  std::optional<TagSpec> tag{};                       ///< absent: the scenario's (simulator only), else none
  MethodConfig method{};  ///< starts as Config::tracker's; its keys stand in the robot itself
  std::optional<InitialPose> initial_pose{};
};

/// For all robots.
struct TrackingConfig {
  MethodConfig method{};  ///< its keys stand in the section itself
  SearchConfig search{};
  DepthConfig depth{};
  int audit_interval = TrackerConfig{}.audit_interval;
};

struct HistoryConfig {
  double max_age_s = 600.0;
  std::size_t max_entries = HistoryLimits{}.max_entries;
};

/// Whether cameras are watched for having been moved.
struct WatchConfig {
  bool enabled = true;
  bool recalibrate = false;      ///< a camera that was moved, by its floor_tags
  CameraWatchConfig settings{};  ///< its keys stand in the section itself
};

/// As FloorMask.
struct MaskConfig {
  std::string name{};
  std::vector<std::array<double, 2>> corners_m{};
};

struct FloorConfig {
  std::vector<MaskConfig> masks{};
};

struct PredictionConfig {
  double horizon_s = 2.0;
};

enum class LogLevel : std::uint8_t { trace, debug, info, warn, error };

struct LogConfig {
  LogLevel level = LogLevel::info;
};

struct Config {
  ServerConfig server{};
  SourceConfig source{};
  std::vector<CameraConfig> cameras{};  ///< empty with the simulator: the scenario's
  /// Folder for calibrations that are made while the service runs, of cameras that name no file of their
  /// own: <camera>.json. What is there counts instead of what the camera itself says. Absent: not kept.
  std::optional<std::string> calibration_dir{};
  std::vector<AppearanceConfig> appearances{};
  TrackingConfig tracker{};
  std::vector<RobotConfig> robots{};  ///< empty with the simulator: the scenario's
  WatchConfig camera_watch{};
  FloorConfig floor{};
  HistoryConfig history{};
  PredictionConfig prediction{};
  LogConfig log{};
};

/// A value over the file's: `assignment` is `key.path=value`, `origin` what errors call it.
struct Override {
  std::string assignment{};
  std::string origin = "--set";
};

struct ConfigLayers {
  std::optional<std::filesystem::path> file{};
  std::map<std::string, std::string> environment{};  ///< see skylight_environment()
  std::vector<Override> flags{};                     ///< in their order
};

/// The variables of this process that start with SKYLIGHT_, without those that are no configuration.
std::map<std::string, std::string> skylight_environment();

/// All layers together. Relative paths of files have become paths from the configuration file's folder
/// (without a file: from the working directory). Throws settings::Error, whose what() is one line for people.
Config load_config(const ConfigLayers& layers);

/// The JSON Schema of the configuration file, and a configuration as a file.
std::string config_schema();
std::string config_json(const Config& config);

/// Reads the calibrations that the cameras have in files, as load_config() does. Throws settings::Error.
void read_calibrations(Config& config);
/// The camera's file for its calibration, whether it is there or not; empty: it has none.
std::filesystem::path calibration_path(const Config& config, const CameraConfig& camera);
/// How well the camera is known by its calibration, or by what it says itself.
CameraUncertainty camera_uncertainty(const CameraConfig& camera);

/// What the tracker takes. The configuration has been checked by load_config().
CameraModel camera_model(const CameraConfig& camera);
FrameCut frame_cut(const AppearanceConfig& appearance);
/// `appearance` may be null for the detector apriltag.
RobotSpec robot_spec(const RobotConfig& robot, std::shared_ptr<const Appearance> appearance);
FloorMask floor_mask(const MaskConfig& mask);
TrackerConfig tracker_config(const Config& config);

/// The configuration that makes this robot: robot_spec()'s inverse.
RobotConfig robot_config(const RobotSpec& spec);

// For whoever reads or writes one of these alone (the REST resources).
void describe(settings::Fields& fields, CameraConfig& camera);
void describe(settings::Fields& fields, AppearanceConfig& appearance);
void describe(settings::Fields& fields, RobotConfig& robot);
void describe(settings::Fields& fields, Config& config);

}  // namespace service
}  // namespace skylight
