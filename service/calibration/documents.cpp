#include "service/calibration/documents.hpp"

#include <cmath>
#include <ctime>

#include "settings/document.hpp"

namespace skylight::service {

std::string utc_text(Time at) {
  const auto seconds = static_cast<std::time_t>(std::floor(to_seconds(at.time_since_epoch())));
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

void set_intrinsics(CalibrationFile& document, const calibration::IntrinsicsResult& result,
                    const std::vector<CalibrationSource>& unused, CalibrationStep step) {
  CameraUncertainty uncertainty = uncertainty_of(document);
  uncertainty.covariance.topRows<kCameraPosition>().setZero();
  uncertainty.covariance.leftCols<kCameraPosition>().setZero();
  uncertainty.covariance.topLeftCorner<kCameraPosition, kCameraPosition>() = result.covariance;
  document.intrinsics = result.intrinsics;
  set_uncertainty(document, uncertainty);
  step.rms_px = result.rms_px;
  for (const calibration::ViewResult& view : result.views)
    step.sources.push_back(
        {.name = view.name, .used = view.used, .why_not = view.why_not, .error_px = view.rms_px});
  step.sources.insert(step.sources.end(), unused.begin(), unused.end());
  document.intrinsics_made = std::move(step);
  document.extrinsics_made.reset();
}

void set_extrinsics(CalibrationFile& document, const calibration::CameraResult& result,
                    CalibrationStep step) {
  document.intrinsics = result.intrinsics;
  document.map_from_camera = calibrated_pose(result.map_from_camera);
  set_uncertainty(document, result.uncertainty);
  step.rms_px = result.rms_px;
  step.rms_m = result.rms_m;
  for (const calibration::PointResult& point : result.points)
    step.sources.push_back(
        {.name = point.name,
         .used = point.used,
         .why_not = point.why_not,
         .error_px = std::isfinite(point.residual_px.norm()) ? point.residual_px.norm() : 0.0});
  document.extrinsics_made = std::move(step);
}

std::vector<NumberedCalibration> read_versions(const std::filesystem::path& file) {
  std::vector<NumberedCalibration> out;
  for (const CalibrationVersion& version : calibration_versions(file)) {
    try {
      out.push_back({version.number, read_calibration(version.file)});
    } catch (const settings::Error&) {  // no calibration any more
    }
  }
  return out;
}

std::optional<CalibrationFile> before_extrinsics(const CalibrationFile& now,
                                                 const std::vector<NumberedCalibration>& versions) {
  if (!now.extrinsics_made) return now;
  const auto made = [](const CalibrationFile& file) {
    return file.intrinsics_made ? file.intrinsics_made->made : std::string();
  };
  for (auto earlier = versions.rbegin(); earlier != versions.rend(); ++earlier) {
    const CalibrationFile& document = earlier->document;
    if (!document.extrinsics_made && made(document) == made(now)) return document;
  }
  return std::nullopt;
}

}  // namespace skylight::service
