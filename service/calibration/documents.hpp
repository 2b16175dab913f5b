// What a calibration found out, as the document that is kept of it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "service/calibration/extrinsics.hpp"
#include "service/calibration/file.hpp"

namespace skylight::service {

/// When, UTC, ISO 8601: "2026-03-01T12:30:00Z".
std::string utc_text(Time at);

/// Of an intrinsics calibration. Where the camera hangs, as `document` has it, was found with the lens
/// before: it stays, with its standard deviations, but is no calibration any more. `unused`: pictures without
/// a view. `step` is told when and from what; its errors and sources come from the result.
void set_intrinsics(CalibrationFile& document, const calibration::IntrinsicsResult& result,
                    const std::vector<CalibrationSource>& unused, CalibrationStep step);

/// Of an extrinsics calibration: pose, the lens as far as it was refined, uncertainty, what it was made from.
void set_extrinsics(CalibrationFile& document, const calibration::CameraResult& result, CalibrationStep step);

struct NumberedCalibration {
  int number = 0;
  CalibrationFile document;
};
/// The versions that are kept of a file, the oldest first, without those that somebody edited until they were
/// no calibration any more.
std::vector<NumberedCalibration> read_versions(const std::filesystem::path& file);

/// The intrinsics as their own pictures gave them, among the versions before `now` (the oldest first): points
/// of an earlier extrinsics calibration, perhaps the same, are not to count twice. `now` itself where it has
/// none; none where that version is lost.
std::optional<CalibrationFile> before_extrinsics(const CalibrationFile& now,
                                                 const std::vector<NumberedCalibration>& versions);

}  // namespace skylight::service
