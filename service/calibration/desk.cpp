#include "service/calibration/desk.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>

#include "service/pipeline.hpp"

namespace skylight::service {
namespace {

namespace fs = std::filesystem;

/// Of a camera without a file, in memory.
constexpr std::size_t kMostEarlier = 100;

void check_change(const CameraSnapshot& camera, const CalibrationChange& change) {
  if (!change.document.map_from_camera)
    throw std::invalid_argument("map_from_camera: is missing: where camera '" + camera.id + "' hangs");
  const Intrinsics& now = camera.model->intrinsics();
  const Intrinsics& next = change.document.intrinsics;
  if (now.width_px != next.width_px || now.height_px != next.height_px)
    throw std::invalid_argument("intrinsics: is of pictures of " + std::to_string(next.width_px) + " x " +
                                std::to_string(next.height_px) + " px, camera '" + camera.id + "' has " +
                                std::to_string(now.width_px) + " x " + std::to_string(now.height_px) + " px");
  if (change.instead_of && *change.instead_of != tag_of(camera.calibration->document))
    throw CalibrationChanged("the calibration of camera '" + camera.id + "' is " +
                             tag_of(camera.calibration->document) + " by now, not " + *change.instead_of);
}

}  // namespace

std::string tag_of(const CalibrationFile& document) {
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a
  for (const char c : calibration_json(document)) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211ULL;
  }
  char text[24];
  std::snprintf(text, sizeof text, "\"%016llx\"", static_cast<unsigned long long>(hash));
  return text;
}

const CameraSnapshot& CalibrationDesk::camera_of(const Snapshot& snapshot, const std::string& id) {
  const CameraSnapshot* camera = snapshot.camera(id);
  if (camera == nullptr) throw NoSuchCalibration("there is no camera '" + id + "'");
  return *camera;
}

/// What is in use becomes a version, also where it came from the configuration and not from the file.
CalibrationKept CalibrationDesk::keep(const CameraSnapshot& camera, const CalibrationFile& document,
                                      CalibrationInUse& next) {
  CalibrationKept kept{.tag = tag_of(document), .stored = !next.file.empty()};
  if (!kept.stored) {
    next.earlier.push_back(camera.calibration->document);
    if (next.earlier.size() > kMostEarlier) next.earlier.erase(next.earlier.begin());
    kept.version = static_cast<int>(next.earlier.size());
    return kept;
  }
  try {
    std::error_code failed;
    if (!next.file.parent_path().empty()) fs::create_directories(next.file.parent_path(), failed);
    if (!fs::exists(next.file, failed)) write_calibration(next.file, camera.calibration->document);
    if (const auto before = write_calibration(next.file, document)) kept.version = before->number;
  } catch (const std::runtime_error&) {  // no path of this machine goes out
    throw CalibrationNotStored("camera '" + camera.id + "': its calibration file " +
                               next.file.filename().string() + " cannot be written");
  }
  return kept;
}

/// Its file says again what is in use.
void CalibrationDesk::take_back(const CameraSnapshot& camera) {
  if (camera.calibration->file.empty()) return;
  try {
    write_calibration(camera.calibration->file, camera.calibration->document);
  } catch (const std::runtime_error&) {  // the error that led here is the one to tell
  }
}

std::vector<CalibrationKept> CalibrationDesk::change(const std::vector<CalibrationChange>& changes) {
  const std::lock_guard changing(changing_);
  const auto snapshot = pipeline_.snapshot();
  for (const CalibrationChange& change : changes) check_change(camera_of(*snapshot, change.camera), change);
  std::vector<Recalibration> cameras;
  std::vector<CalibrationKept> kept;
  try {
    for (const CalibrationChange& change : changes) {
      const CameraSnapshot& camera = camera_of(*snapshot, change.camera);
      CalibrationInUse next{change.document, camera.calibration->file, camera.calibration->earlier};
      kept.push_back(keep(camera, change.document, next));
      cameras.push_back({change.camera, std::make_shared<const CalibrationInUse>(std::move(next))});
    }
    pipeline_.recalibrate(cameras);
  } catch (...) {
    for (const Recalibration& written : cameras) take_back(camera_of(*snapshot, written.camera));
    throw;
  }
  return kept;
}

std::vector<NumberedCalibration> CalibrationDesk::versions(const std::string& camera) const {
  const auto snapshot = pipeline_.snapshot();
  const CalibrationInUse& in_use = *camera_of(*snapshot, camera).calibration;
  if (!in_use.file.empty()) return read_versions(in_use.file);
  std::vector<NumberedCalibration> out;
  for (const CalibrationFile& earlier : in_use.earlier)
    out.push_back({static_cast<int>(out.size()) + 1, earlier});
  return out;
}

CalibrationFile CalibrationDesk::version(const std::string& camera, int number) const {
  for (NumberedCalibration& version : versions(camera)) {
    if (version.number == number) return std::move(version.document);
  }
  throw NoSuchCalibration("camera '" + camera + "' has no version " + std::to_string(number) +
                          " of its calibration that can be read");
}

CalibrationDesk::Restored CalibrationDesk::restore(const std::string& camera, std::optional<int> number) {
  const auto kept = versions(camera);
  if (kept.empty() && !number)
    throw NoSuchCalibration("no earlier calibration of camera '" + camera + "' is kept");
  const int which = number ? *number : kept.back().number;
  CalibrationFile document = version(camera, which);
  CalibrationKept now = change({{camera, document}}).front();
  return {which, std::move(document), std::move(now)};
}

}  // namespace skylight::service
