#include "service/calibration/file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "settings/fields.hpp"

namespace skylight {

void describe(settings::Fields& fields, Intrinsics& intrinsics);  // service/tracker_fields.cpp

namespace service {

namespace fs = std::filesystem;
using settings::Fields;

void describe(Fields& fields, CalibratedPose& pose) {
  fields.about("Where the camera hangs: its optical frame (z forward, x right, y down) in map.");
  fields.field("position_m", pose.position_m, {.min = -1e4, .max = 1e4, .unit = "m", .required = true});
  fields.field("quaternion_xyzw", pose.quaternion_xyzw,
               {.min = -1.001, .max = 1.001, .required = true, .help = "Of length 1."});
  double length = 0.0;
  for (const double part : pose.quaternion_xyzw) length += part * part;
  fields.check(std::abs(std::sqrt(length) - 1.0) <= 1e-3, "quaternion_xyzw", "must be of length 1");
}

void describe(Fields& fields, CalibratedSigmas& sigmas) {
  fields.about("Standard deviations. 0: known exactly.");
  fields.field("focal_px", sigmas.focal_px, {.min = 0, .max = 1e6, .unit = "px", .help = "fx, fy."});
  fields.field("centre_px", sigmas.centre_px, {.min = 0, .max = 1e5, .unit = "px", .help = "cx, cy."});
  fields.field("distortion", sigmas.distortion, {.min = 0, .max = 1e3, .help = "As intrinsics.distortion."});
  fields.field("position_m", sigmas.position_m,
               {.min = 0, .max = 1000, .unit = "m", .help = "Along x, y, z of map."});
  fields.field("rotation_rad", sigmas.rotation_rad,
               {.min = 0, .max = 10, .unit = "rad", .help = "About x, y, z of map."});
}

void describe(Fields& fields, CalibrationSource& source) {
  fields.field("name", source.name, {.required = true});
  fields.field("used", source.used);
  fields.field("why_not", source.why_not);
  fields.field("error_px", source.error_px, {.min = 0, .unit = "px"});
}

void describe(Fields& fields, CalibrationStep& step) {
  fields.about("How it was found.");
  fields.field("made", step.made, {.help = "When: UTC, ISO 8601."});
  fields.field("from", step.from);
  fields.field("rms_px", step.rms_px, {.min = 0, .unit = "px", .help = "Reprojection error."});
  fields.field("rms_m", step.rms_m, {.min = 0, .unit = "m", .help = "The same on the floor."});
  fields.field("sources", step.sources);
}

namespace {

constexpr auto kSide = static_cast<std::size_t>(kCameraParameters);

CameraParameters sigmas_of(const CalibratedSigmas& s) {
  CameraParameters out;
  out << s.focal_px[0], s.focal_px[1], s.centre_px[0], s.centre_px[1],
      Eigen::Map<const Eigen::Matrix<double, 5, 1>>(s.distortion.data()),
      Eigen::Map<const Eigen::Vector3d>(s.position_m.data()),
      Eigen::Map<const Eigen::Vector3d>(s.rotation_rad.data());
  return out;
}

bool has_right_shape(const CalibrationFile& file) {
  return file.correlations.empty() ||
         (file.correlations.size() == kSide &&
          std::all_of(file.correlations.begin(), file.correlations.end(),
                      [](const std::vector<double>& row) { return row.size() == kSide; }));
}

/// Lists of numbers on one line each.
std::string with_short_lists(const std::string& text) {
  std::string out;
  bool quoted = false;  // what people write stays as it is
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') quoted = !quoted;
    if (quoted && text[i] == '\\') out += text[i++];
    const std::size_t end = text.find_first_of("[]{}\"", i + 1);
    if (quoted || text[i] != '[' || end == std::string::npos || text[end] != ']') {
      out += text[i];
      continue;
    }
    for (; i <= end; ++i) {
      if (text[i] == '\n') continue;
      if (text[i] != ' ') out += text[i];
      if (text[i] == ',') out += ' ';
    }
    --i;
  }
  return out;
}

fs::path version_path(const fs::path& file, int number) {
  fs::path name = file.stem();
  name += "." + std::to_string(number) + file.extension().string();
  return file.parent_path() / name;
}

void write_text(const fs::path& file, const std::string& text) {
  const fs::path unfinished = file.string() + ".new";
  {
    std::ofstream out(unfinished, std::ios::binary);
    out << text;
    if (!out.flush()) throw std::runtime_error(unfinished.string() + ": cannot be written");
  }
  std::error_code failed;
  fs::rename(unfinished, file, failed);
  if (failed) throw std::runtime_error(file.string() + ": cannot be written: " + failed.message());
}

/// What is there becomes the newest version; it stays until the new one takes its place.
std::optional<CalibrationVersion> keep(const fs::path& file) {
  std::error_code failed;
  if (!fs::exists(file, failed)) return std::nullopt;
  const auto versions = calibration_versions(file);
  const int number = versions.empty() ? 1 : versions.back().number + 1;
  const fs::path kept = version_path(file, number);
  fs::copy_file(file, kept, failed);
  if (failed) throw std::runtime_error(kept.string() + ": cannot be written: " + failed.message());
  return CalibrationVersion{number, kept};
}

}  // namespace

void describe(Fields& fields, CalibrationFile& file) {
  fields.about("What a camera is and where it hangs, by its calibration, and how well both are known.");
  fields.field("format", file.format,
               {.min = 1, .max = CalibrationFile::kFormat, .required = true, .help = "Of this file."});
  fields.field("note", file.note, {.help = "For people."});
  fields.field("intrinsics", file.intrinsics, {.required = true});
  fields.field("map_from_camera", file.map_from_camera,
               {.help = "Absent until the extrinsics are calibrated."});
  fields.field("sigmas", file.sigmas);
  fields.field("correlations", file.correlations,
               {.min = -1,
                .max = 1,
                .max_items = kSide,
                .help = "15 rows of 15: fx fy cx cy, five of distortion, position, rotation. Empty: none."});
  fields.field("intrinsics_made", file.intrinsics_made);
  fields.field("extrinsics_made", file.extrinsics_made);
  const bool shaped = has_right_shape(file);
  fields.check(shaped, "correlations", "must be 15 rows of 15 numbers, or empty");
  if (!shaped) return;
  const std::string wrong = skylight::check(uncertainty_of(file));
  fields.check(wrong.empty(), "correlations", wrong);
}

CalibrationFile read_calibration(const fs::path& file) {
  return settings::read<CalibrationFile>(settings::load(file));
}

std::string calibration_json(const CalibrationFile& calibration) {
  return with_short_lists(settings::write(calibration));
}

std::optional<CalibrationVersion> write_calibration(const fs::path& file,
                                                    const CalibrationFile& calibration) {
  const auto kept = keep(file);
  write_text(file, calibration_json(calibration) + "\n");
  return kept;
}

std::vector<CalibrationVersion> calibration_versions(const fs::path& file) {
  std::vector<CalibrationVersion> out;
  const std::string stem = file.stem().string() + ".";
  const std::string extension = file.extension().string();
  std::error_code failed;
  const fs::path folder = file.parent_path().empty() ? fs::path(".") : file.parent_path();
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(stem) || !name.ends_with(extension) ||
        name.size() <= stem.size() + extension.size())
      continue;
    const std::string middle = name.substr(stem.size(), name.size() - stem.size() - extension.size());
    int number = 0;
    const auto [end, error] = std::from_chars(middle.data(), middle.data() + middle.size(), number);
    if (error != std::errc() || end != middle.data() + middle.size() || number < 1) continue;
    out.push_back({number, version_path(file, number)});
  }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  return out;
}

int restore_calibration(const fs::path& file, std::optional<int> version) {
  const auto versions = calibration_versions(file);
  if (versions.empty()) throw std::runtime_error(file.string() + ": no versions of it were kept");
  const int number = version.value_or(versions.back().number);
  const auto at = std::find_if(versions.begin(), versions.end(),
                               [number](const CalibrationVersion& each) { return each.number == number; });
  if (at == versions.end())
    throw std::runtime_error(file.string() + ": there is no version " + std::to_string(number) +
                             "; there are " + std::to_string(versions.front().number) + " to " +
                             std::to_string(versions.back().number));
  read_calibration(at->file);  // refuses what is no calibration
  std::ifstream in(at->file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  keep(file);
  write_text(file, text);
  return number;
}

CameraUncertainty uncertainty_of(const CalibrationFile& calibration) {
  const CameraParameters sigma = sigmas_of(calibration.sigmas);
  CameraUncertainty out;
  for (std::size_t i = 0; i < kSide; ++i) {
    for (std::size_t j = 0; j < kSide; ++j) {
      const auto row = static_cast<Eigen::Index>(i);
      const auto column = static_cast<Eigen::Index>(j);
      const double correlation =
          i == j ? 1.0 : (calibration.correlations.empty() ? 0.0 : calibration.correlations[i][j]);
      out.covariance(row, column) = correlation * sigma[row] * sigma[column];
    }
  }
  return out;
}

void set_uncertainty(CalibrationFile& calibration, const CameraUncertainty& uncertainty) {
  const CameraParameters sigma = uncertainty.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  CalibratedSigmas& s = calibration.sigmas;
  s.focal_px = {sigma[kFocalX], sigma[kFocalY]};
  s.centre_px = {sigma[kCentreX], sigma[kCentreY]};
  std::copy_n(sigma.data() + kDistortion, 5, s.distortion.begin());
  std::copy_n(sigma.data() + kCameraPosition, 3, s.position_m.begin());
  std::copy_n(sigma.data() + kCameraRotation, 3, s.rotation_rad.begin());
  calibration.correlations.clear();
  if (uncertainty.covariance.isDiagonal(0.0)) return;
  calibration.correlations.assign(kSide, std::vector<double>(kSide, 0.0));
  for (Eigen::Index i = 0; i < kCameraParameters; ++i) {
    for (Eigen::Index j = 0; j < kCameraParameters; ++j) {
      const double scale = sigma[i] * sigma[j];
      double& out = calibration.correlations[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      out = i == j ? 1.0 : (scale > 0.0 ? std::clamp(uncertainty.covariance(i, j) / scale, -1.0, 1.0) : 0.0);
    }
  }
}

Eigen::Isometry3d pose_of(const CalibratedPose& pose) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translation() << pose.position_m[0], pose.position_m[1], pose.position_m[2];
  const auto& [x, y, z, w] = pose.quaternion_xyzw;
  out.linear() = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
  return out;
}

CalibratedPose calibrated_pose(const Eigen::Isometry3d& map_from_camera) {
  const Eigen::Quaterniond q(map_from_camera.linear());
  const auto& t = map_from_camera.translation();
  return {.position_m = {t.x(), t.y(), t.z()}, .quaternion_xyzw = {q.x(), q.y(), q.z(), q.w()}};
}

CalibrationFile calibration_of(const CameraModel& camera, const CameraUncertainty& uncertainty) {
  CalibrationFile out;
  out.intrinsics = camera.intrinsics();
  out.map_from_camera = calibrated_pose(camera.map_from_camera());
  set_uncertainty(out, uncertainty);
  return out;
}

CameraModel camera_model(const CalibrationFile& calibration) {
  return {calibration.intrinsics, pose_of(calibration.map_from_camera.value())};
}

}  // namespace service
}  // namespace skylight
