// A camera's calibration as a file: JSON that people can read and edit, comments allowed. Versions are kept:
// writing room.json leaves what was there as room.1.json, room.2.json and so on, the highest the newest.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tracker/camera.hpp"
#include "tracker/camera_uncertainty.hpp"

namespace skylight::settings {
class Fields;
}

namespace skylight::service {

/// The optical frame (z forward, x right, y down) in `map`.
struct CalibratedPose {
  std::array<double, 3> position_m{};
  std::array<double, 4> quaternion_xyzw{0.0, 0.0, 0.0, 1.0};  ///< of length 1, to 0.001
};

/// Standard deviations of the fifteen parameters of tracker/camera_uncertainty.hpp.
struct CalibratedSigmas {
  std::array<double, 2> focal_px{};
  std::array<double, 2> centre_px{};
  std::array<double, 5> distortion{};
  std::array<double, 3> position_m{};    ///< along the axes of `map`
  std::array<double, 3> rotation_rad{};  ///< about the axes of `map`
};

/// A picture or point that the calibration was made from.
struct CalibrationSource {
  std::string name{};
  bool used = true;
  std::string why_not{};  ///< where it was not used
  double error_px = 0.0;  ///< root mean square of a view; a point's distance
};

struct CalibrationStep {
  std::string made{};  ///< when: UTC, ISO 8601
  std::string from{};  ///< the board, or what lay on the floor
  double rms_px = 0.0;
  std::optional<double> rms_m{};
  std::vector<CalibrationSource> sources{};
};

struct CalibrationFile {
  static constexpr int kFormat = 1;

  int format = kFormat;
  std::string note{};  ///< whatever people write
  Intrinsics intrinsics{.width_px = 1, .height_px = 1, .fx_px = 1.0, .fy_px = 1.0};
  std::optional<CalibratedPose> map_from_camera{};  ///< absent: where it hangs is not yet known
  CalibratedSigmas sigmas{};
  /// 15 x 15, in the order of the sigmas; empty: none.
  std::vector<std::vector<double>> correlations{};
  std::optional<CalibrationStep> intrinsics_made{};
  std::optional<CalibrationStep> extrinsics_made{};
};

void describe(settings::Fields& fields, CalibrationFile& calibration);

/// Throws settings::Error naming file, line, key and range.
CalibrationFile read_calibration(const std::filesystem::path& file);
std::string calibration_json(const CalibrationFile& calibration);

struct CalibrationVersion {
  int number = 0;
  std::filesystem::path file;
};

/// Writes it whole or not at all, and keeps what was there as the version that is returned; none where
/// nothing was there. Throws std::runtime_error naming the file.
std::optional<CalibrationVersion> write_calibration(const std::filesystem::path& file,
                                                    const CalibrationFile& calibration);

/// The versions that were kept of a file, oldest first.
std::vector<CalibrationVersion> calibration_versions(const std::filesystem::path& file);

/// Puts a version (absent: the newest) back; what was there becomes a version itself. Returns the number that
/// was restored. Throws settings::Error where the version is no calibration, std::runtime_error where there
/// is none.
int restore_calibration(const std::filesystem::path& file, std::optional<int> version);

// Between the file and the tracker.
CameraUncertainty uncertainty_of(const CalibrationFile& calibration);
void set_uncertainty(CalibrationFile& calibration, const CameraUncertainty& uncertainty);
Eigen::Isometry3d pose_of(const CalibratedPose& pose);
CalibratedPose calibrated_pose(const Eigen::Isometry3d& map_from_camera);
/// The calibration that says no more than this: where nobody calibrated, or somebody wrote it down.
CalibrationFile calibration_of(const CameraModel& camera, const CameraUncertainty& uncertainty);
/// Of a calibration that has its pose.
CameraModel camera_model(const CalibrationFile& calibration);

}  // namespace skylight::service
