#include "service/self_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>
#include <utility>

#include "service/calibration/documents.hpp"
#include "service/calibration/median.hpp"

namespace skylight::service {
namespace {

using calibration::CameraResult;
using calibration::SeeingCamera;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kCornerSigmaPx = 0.15;  // as skylight calibrate extrinsics has it
constexpr double kStillPx = 1.0;
constexpr std::size_t kFewestTags = 2;
constexpr double kMostRmsPx = 1.5;
constexpr double kMostFloorSigma = 0.010;  // m
constexpr Duration kApart = std::chrono::milliseconds(100);

std::string name_of(const FloorTag& tag) {
  return "tag " + tag.family + ":" + std::to_string(tag.id);
}

std::string number(double value, const char* format) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// The median of a tag's corners; throws where they do not stay in their place.
std::array<Pixel, 4> settled(const FloorTag& tag, const std::vector<std::array<Pixel, 4>>& seen) {
  std::array<Pixel, 4> out;
  for (std::size_t corner = 0; corner < 4; ++corner) {
    std::vector<double> u;
    std::vector<double> v;
    for (const auto& corners : seen) {
      u.push_back(corners[corner].x());
      v.push_back(corners[corner].y());
    }
    out[corner] = {calibration::median(u), calibration::median(v)};
    for (const auto& corners : seen) {
      const double off = (corners[corner] - out[corner]).norm();
      if (off > kStillPx)
        throw std::invalid_argument("a corner of " + name_of(tag) + " moves by " + number(off, "%.1f") +
                                    " px from frame to frame: the camera does not hang still");
    }
  }
  return out;
}

void check_result(const CameraResult& result) {
  if (result.rms_px > kMostRmsPx)
    throw std::invalid_argument("the tags' corners are " + number(result.rms_px, "%.1f") +
                                " px from where they should be, allowed " + number(kMostRmsPx, "%.1f"));
  if (!(result.worst_floor_sigma_m <= kMostFloorSigma))
    throw std::invalid_argument("the tags seen leave the floor unknown by " +
                                number(1e3 * result.worst_floor_sigma_m, "%.0f") + " mm, allowed " +
                                number(1e3 * kMostFloorSigma, "%.0f"));
}

}  // namespace

void FloorTagLooks::look(const cv::Mat& image, const CameraModel& camera) {
  ++frames_;
  std::set<std::string> families;
  for (const FloorTag& tag : tags_) families.insert(tag.family);
  for (const std::string& family : families) {
    for (const auto& sighting : calibration::find_tags(image, calibration::tag_dictionary(family), camera)) {
      for (std::size_t i = 0; i < tags_.size(); ++i) {
        if (tags_[i].family == family && tags_[i].id == sighting.id) corners_[i].push_back(sighting.corners);
      }
    }
  }
}

SeeingCamera FloorTagLooks::seen(const CalibrationFile& before) const {
  SeeingCamera camera{
      .name = "the camera",
      .intrinsics = before.intrinsics,
      .covariance = uncertainty_of(before).covariance.topLeftCorner<kCameraPosition, kCameraPosition>()};
  std::size_t tags = 0;
  for (const auto& [index, sightings] : corners_) {
    if (2 * static_cast<int>(sightings.size()) < frames_) continue;
    ++tags;
    const FloorTag& tag = tags_[index];
    const auto pixels = settled(tag, sightings);
    const auto places = calibration::tag_points(tag.size_m);
    for (std::size_t corner = 0; corner < 4; ++corner)
      camera.points.push_back({.name = name_of(tag) + ", corner " + std::to_string(corner + 1),
                               .sheet = index,
                               .at = {places[corner].x(), places[corner].y(), 0.0},
                               .pixel = pixels[corner],
                               .sigma_px = kCornerSigmaPx,
                               .group = static_cast<int>(index)});
  }
  if (tags < kFewestTags)
    throw std::invalid_argument("of " + std::to_string(tags_.size()) + " floor tags " + std::to_string(tags) +
                                " are seen, at least " + std::to_string(kFewestTags) + " are needed");
  return camera;
}

CameraResult FloorTagLooks::solve(const CalibrationFile& before) const {
  calibration::ExtrinsicsInput input;
  for (const FloorTag& tag : tags_)
    input.sheets.push_back({.name = name_of(tag),
                            .place = calibration::FloorPlace{tag.x_m, tag.y_m, tag.yaw_deg * kRadPerDeg},
                            .sigma_m = tag.place_sigma_m,
                            .sigma_rad = std::min(1.0, tag.place_sigma_m / (0.5 * tag.size_m))});
  input.cameras.push_back(seen(before));
  CameraResult result = std::move(calibration::calibrate_extrinsics(input).cameras.front());
  check_result(result);
  return result;
}

std::optional<Recalibrator::Outcome> Recalibrator::look(const cv::Mat& image, Time captured,
                                                        const CalibrationFile& before) {
  if (captured < next_) return std::nullopt;
  next_ = captured + kApart;
  try {
    looks_.look(image, camera_model(before));
    if (!looks_.enough()) return std::nullopt;
    const FloorTagLooks looks = std::exchange(looks_, FloorTagLooks(tags_));
    return Outcome{.result = looks.solve(before), .reason = {}};
  } catch (const std::exception& error) {
    wait_after(captured);
    return Outcome{.result = {}, .reason = error.what()};
  }
}

void Recalibrator::wait_after(Time captured) {
  next_ = captured + backoff_.next();
  looks_ = FloorTagLooks(tags_);
}

CalibrationFile recalibrated_document(const CalibrationFile& before, const CameraResult& result, Time now) {
  CalibrationFile out = before;
  set_extrinsics(out, result, {.made = utc_text(now), .from = "floor tags, by itself after it was moved"});
  return out;
}

Event recalibrated_event(const std::string& camera, const CalibrationFile& before,
                         const CameraResult& result) {
  const Eigen::Isometry3d was = pose_of(before.map_from_camera.value());
  const double moved_m = (result.map_from_camera.translation() - was.translation()).norm();
  const double degrees =
      Eigen::AngleAxisd(was.linear().transpose() * result.map_from_camera.linear()).angle() / kRadPerDeg;
  Json residuals = Json::array();
  for (const calibration::PointResult& point : result.points)
    residuals.push_back(
        {{"name", point.name},
         {"used", point.used},
         {"px", std::isfinite(point.residual_px.norm()) ? Json(point.residual_px.norm()) : Json(nullptr)}});
  return {.kind = "camera.recalibrated",
          .camera = camera,
          .message = "camera " + camera + " was calibrated again by its floor tags: it hangs " +
                     number(1e3 * moved_m, "%.1f") + " mm and " + number(degrees, "%.2f") +
                     " degrees from where it was, residuals " + number(result.rms_px, "%.2f") + " px",
          .data = {{"moved_m", moved_m},
                   {"degrees", degrees},
                   {"rms_px", result.rms_px},
                   {"rms_m", result.rms_m},
                   {"floor_sigma_m", result.worst_floor_sigma_m},
                   {"residuals", std::move(residuals)}}};
}

Event recalibration_failed_event(const std::string& camera, const std::string& reason) {
  return {.kind = "camera.recalibration_failed",
          .severity = Severity::warning,
          .camera = camera,
          .message = "camera " + camera + " could not be calibrated again by its floor tags: " + reason,
          .data = {{"reason", reason}}};
}

SelfCalibration::SelfCalibration(Pipeline& pipeline, CalibrationDesk& desk)
    : pipeline_(pipeline), desk_(desk), thread_([this] { run(); }) {}

SelfCalibration::~SelfCalibration() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void SelfCalibration::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    const auto snapshot = pipeline_.snapshot();
    for (const CameraSnapshot& camera : snapshot->cameras) attend(camera);
    lock.lock();
    wake_.wait_for(lock, kApart, [this] { return stopping_; });
  }
}

void SelfCalibration::attend(const CameraSnapshot& camera) {
  const bool moved = camera.hold && camera.hold->hold == CameraHold::moved;
  if (!moved || camera.floor_tags.empty()) {
    working_.erase(camera.id);
    return;
  }
  Recalibrator& work = working_.try_emplace(camera.id, camera.floor_tags).first->second;
  const CalibrationFile& before = camera.calibration->document;
  const auto outcome = work.look(camera.image, camera.captured, before);
  if (!outcome) return;
  std::string failed = outcome->reason;
  if (outcome->result) {
    try {
      desk_.change({{.camera = camera.id,
                     .document = recalibrated_document(before, *outcome->result, pipeline_.now()),
                     .instead_of = tag_of(before)}});
      pipeline_.events().add(recalibrated_event(camera.id, before, *outcome->result));
      return;
    } catch (const std::exception& error) {
      failed = error.what();
      work.wait_after(camera.captured);
    }
  }
  pipeline_.events().add(recalibration_failed_event(camera.id, failed));
}

}  // namespace skylight::service
