// What a scenario file says: room, light, cameras, robots and their motion programs, seed. Plain values with
// the defaults; scenario.cpp describes each key (range, unit, help) and checks what no single key can show.
//
// Keys carry their unit (_m, _mps, _deg, _s). Angles are degrees here, as people write them, and radians
// everywhere else in sim. `map` has its origin on the floor in the middle of the room, x along size_m[0].
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

#include "sim/camera/camera_model.hpp"
#include "tracker/types.hpp"

namespace skylight::sim {

/// Red, green, blue as a linear sensor sees them under the room's light, 0 to 255.
using Color = std::array<double, 3>;

enum class FloorMaterial : std::uint8_t { plain, tiles, speckle, concrete, picture };

struct FloorSpec {
  FloorMaterial material = FloorMaterial::tiles;
  Color color_rgb{128.0, 126.0, 120.0};
  double contrast = 0.35;      ///< strength of the pattern, 0 (flat) to 1
  double tile_m = 0.5;         ///< edge of a tile (material tiles)
  std::string picture;         ///< image file (material picture), repeated over the floor
  double picture_width_m = 1;  ///< width of one copy of the picture on the floor
  double friction = 1.0;       ///< factor on the robots' tyre friction, 0 to 2 (1: dry, clean)
};

struct RoomSpec {
  std::array<double, 2> size_m{6.0, 6.0};
  double wall_height_m = 0.3;
  Color wall_rgb{168.0, 164.0, 156.0};
  FloorSpec floor;
};

struct LightSpec {
  double level = 1.0;            ///< factor on every colour, 0 (dark) to 4
  double gradient = 0.08;        ///< change of the light across the room, as a share, half of it to each side
  double gradient_deg = 35.0;    ///< direction in `map` towards which it grows
  double contact_shadow = 0.55;  ///< share of the light missing right under a robot's edge, 0 to 1
};

/// Photon-transfer curve: at a mean of g grey levels, variance = gain_dn_per_e * g + (read noise in grey
/// levels)^2, with gain_dn_per_e = 255 * gain / full_well_e (EMVA Standard 1288, release 3.1, section 2.3).
struct SensorSpec {
  bool noise = true;
  double full_well_e = 14600.0;  ///< Sony IMX290 at 0 dB: 3.584 e- per 12-bit step (ZWO ASI290MM)
  double read_noise_e = 3.2;     ///< the same camera at 0 dB
  double gain = 1.0;             ///< analogue gain: full scale is full_well_e / gain electrons
};

/// Structured light: standard deviation = floor + growth * (z - 0.4 m)^2 (Nguyen, Izadi and Lovell, "Modeling
/// Kinect Sensor Noise for Improved 3D Reconstruction and Tracking", 3DIMPVT 2012, eq. 2).
struct DepthSpec {
  bool enabled = false;
  bool noise = true;
  double noise_floor_m = 0.0012;
  double noise_growth_per_m = 0.0019;  ///< 1/m
  double max_range_m = 10.0;           ///< no reading (0) beyond
};

struct CameraSpec {
  std::string id = "ceiling";
  std::array<double, 3> position_m{0.0, 0.0, 4.0};
  /// Roll, pitch, yaw (about fixed map x, y, z, in this order) away from a camera that looks straight down
  /// with its image's right side towards map x.
  std::array<double, 3> rpy_deg{0.0, 0.0, 0.0};
  int width_px = 1920;
  int height_px = 1080;
  Lens lens = Lens::brown_conrady;
  double fx_px = 700.0;
  double fy_px = 700.0;
  std::optional<double> cx_px;  ///< absent: (width_px - 1) / 2
  std::optional<double> cy_px;  ///< absent: (height_px - 1) / 2
  /// brown_conrady: k1 k2 p1 p2 k3; kannala_brandt: k1 k2 k3 k4 (the fifth unused).
  std::array<double, 5> distortion{-0.045, 0.010, 0.0004, -0.0003, 0.0};
  double frame_rate_hz = 30.0;
  double exposure_s = 0.008;
  double first_frame_s = 0.0;  ///< start of the first exposure after the scenario's start
  double vignetting = 0.15;    ///< share of light missing in the corners of the picture
  SensorSpec sensor;
  DepthSpec depth;
};

enum class RobotModelName : std::uint8_t { waffle_pi };

/// The picture on the robot's top plate.
struct PictureSpec {
  std::string file;               ///< image file (with alpha where it has holes); empty: drawn from the seed
  std::uint64_t seed = 0;         ///< 0: by the robot's place in the list, so that each differs
  std::optional<double> width_m;  ///< width of the picture on the plate; absent: the plate's width
};

struct StartSpec {
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_deg = 0.0;
};

// Motion programs. A robot does its steps one after the other and stands still after the last.
struct LineStep {
  double distance_m = 1.0;
  double speed_mps = 0.2;
};
struct ArcStep {
  double radius_m = 1.0;
  double angle_deg = 90.0;  ///< positive: to the left
  double speed_mps = 0.2;
};
struct TurnStep {
  double angle_deg = 90.0;  ///< on the spot; positive: to the left
  double rate_degps = 60.0;
};
struct WaypointsStep {
  std::vector<std::array<double, 2>> points_m;
  double speed_mps = 0.2;
  bool loop = false;  ///< from the last point on to the first, for ever
};
struct DriveStep {
  double v_mps = 0.0;
  double w_degps = 0.0;
  double for_s = 1.0;
};
struct StopStep {
  double for_s = 1.0;
};
struct ProgramStep;
struct RepeatStep {
  int times = 0;  ///< 0: for ever
  std::vector<ProgramStep> steps;
};
struct ProgramStep {
  std::variant<LineStep, ArcStep, TurnStep, WaypointsStep, DriveStep, StopStep, RepeatStep> action;
};

struct RobotSpec {
  std::string id;
  RobotModelName model = RobotModelName::waffle_pi;
  PictureSpec picture;
  StartSpec start;
  std::vector<ProgramStep> program;
};

struct Scenario {
  Scenario();  // in scenario.cpp: seen through, it makes g++ 12 warn of uninitialised strings

  std::string name;         ///< from the file's name where the file does not say
  std::string description;  ///< one line: what the scenario is for
  std::uint64_t seed = 1;
  double start_unix_s = 1700000000.0;  ///< Unix time of the scenario's start
  double duration_s = 0.0;             ///< 0: endless
  RoomSpec room;
  LightSpec light;
  std::vector<CameraSpec> cameras{CameraSpec{}};
  std::vector<RobotSpec> robots;
  std::filesystem::path folder;  ///< picture files are relative to it; the scenario file's folder, no key
};

/// The camera's own projection, and where it hangs. Columns of the rotation: image right, image down, away.
CameraModel camera_model(const CameraSpec& camera);
Eigen::Isometry3d map_from_camera(const CameraSpec& camera);

/// What single keys cannot show: ids used twice, robots outside the room or overlapping, cameras below the
/// floor, a step without exactly one motion. Throws std::invalid_argument naming the key path and the bound.
void validate(const Scenario& scenario);

}  // namespace skylight::sim
