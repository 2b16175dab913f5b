// Where calibrations of a running service are changed: written down with their versions, and taken into use.
#pragma once

#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "service/calibration/documents.hpp"
#include "service/calibration/in_use.hpp"

namespace skylight::service {

class Pipeline;
struct CameraSnapshot;
struct Snapshot;

/// Somebody else changed it meanwhile.
struct CalibrationChanged : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// A file cannot be written; all cameras and files keep what they had (a file that was written before this
/// one is written back).
struct CalibrationNotStored : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// There is no camera, or no version of its calibration, of that name or number.
struct NoSuchCalibration : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Names a calibration by what it says: equal where the documents are, an entity tag with its quotes.
std::string tag_of(const CalibrationFile& document);

struct CalibrationChange {
  std::string camera;
  CalibrationFile document;
  /// The tag of what it is to take the place of; absent: whatever is in use.
  std::optional<std::string> instead_of{};
};

/// What became of a change.
struct CalibrationKept {
  std::string tag;      ///< of what is in use now
  bool stored = false;  ///< in a file; else it is lost when the service ends
  int version = 0;      ///< as which the one before is kept
};

/// From any thread; changes go one after the other.
class CalibrationDesk {
 public:
  explicit CalibrationDesk(Pipeline& pipeline) : pipeline_(pipeline) {}

  /// Writes each document to its camera's file, if it has one, and takes all of them into use between the
  /// same two frames. Throws, and nothing is in use then: NoSuchCalibration (no such camera),
  /// std::invalid_argument (it does not say where the camera hangs, or is of pictures of another size),
  /// CalibrationChanged, CalibrationNotStored, std::runtime_error (the service is stopping).
  std::vector<CalibrationKept> change(const std::vector<CalibrationChange>& changes);

  /// What was in use before, the oldest first (of a file: read_versions()). Throws NoSuchCalibration (no such
  /// camera).
  std::vector<NumberedCalibration> versions(const std::string& camera) const;
  /// Throws too where the version is not there.
  CalibrationFile version(const std::string& camera, int number) const;

  struct Restored {
    int number = 0;
    CalibrationFile document;
    CalibrationKept kept;
  };
  /// Puts a version (absent: the newest) back into use; what was in use becomes a version. Throws as
  /// version() and change().
  Restored restore(const std::string& camera, std::optional<int> number);

 private:
  static const CameraSnapshot& camera_of(const Snapshot& snapshot, const std::string& id);
  static CalibrationKept keep(const CameraSnapshot& camera, const CalibrationFile& document,
                              CalibrationInUse& next);
  static void take_back(const CameraSnapshot& camera);

  Pipeline& pipeline_;
  std::mutex changing_;
};

}  // namespace skylight::service
