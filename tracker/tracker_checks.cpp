#include "tracker/tracker_checks.hpp"

#include <cmath>
#include <stdexcept>

namespace skylight {

void check_spec(const RobotSpec& spec) {
  if (spec.id.empty()) throw std::invalid_argument("a robot needs an id");
  const std::string name = "robot '" + spec.id + "': ";
  if (spec.detector == DetectorKind::apriltag) {
    if (!spec.tag) throw std::invalid_argument(name + "the detector apriltag needs a tag, and it has none");
  } else if (!spec.appearance) {
    throw std::invalid_argument(name + "it has no appearance");
  }
  if (spec.tag) {
    if (const std::string wrong = check(*spec.tag); !wrong.empty())
      throw std::invalid_argument(name + "tag." + wrong);
  }
  if (const std::string wrong = check(spec.filter); !wrong.empty()) throw std::invalid_argument(name + wrong);
  if (const std::string wrong = check(spec.homography); !wrong.empty())
    throw std::invalid_argument(name + wrong);
  if (spec.surface_height_m && !(*spec.surface_height_m >= -1.0 && *spec.surface_height_m <= 5.0)) {
    throw std::invalid_argument(name + "surface_height_m is " + std::to_string(*spec.surface_height_m) +
                                ", allowed -1 to 5");
  }
  if (spec.picture_mounting) {
    const Pose2& at = *spec.picture_mounting;
    if (!spec.appearance) throw std::invalid_argument(name + "picture_mounting without a picture");
    if (!(std::abs(at.x) <= 5.0 && std::abs(at.y) <= 5.0 && std::isfinite(at.yaw)))
      throw std::invalid_argument(name + "picture_mounting is " + std::to_string(at.x) + ", " +
                                  std::to_string(at.y) + " m, allowed -5 to 5");
  }
  if (spec.initial_pose && !(std::isfinite(spec.initial_pose->x) && std::isfinite(spec.initial_pose->y) &&
                             std::isfinite(spec.initial_pose->yaw))) {
    throw std::invalid_argument(name + "initial_pose is not finite");
  }
}

void check_calibration(const std::vector<CameraUncertainty>& calibration, std::size_t cameras) {
  if (!calibration.empty() && calibration.size() != cameras) {
    throw std::invalid_argument("calibration has " + std::to_string(calibration.size()) +
                                " entries, allowed none or one for each of the " + std::to_string(cameras) +
                                " cameras");
  }
  for (std::size_t i = 0; i < calibration.size(); ++i) {
    if (const std::string wrong = check(calibration[i]); !wrong.empty())
      throw std::invalid_argument("calibration[" + std::to_string(i) + "]: " + wrong);
  }
}

void check_recalibration(const std::vector<CameraModel>& cameras, std::size_t camera,
                         const CameraModel& model, const CameraUncertainty& uncertainty) {
  if (camera >= cameras.size()) {
    throw std::invalid_argument("there is no camera " + std::to_string(camera) + ", allowed 0 to " +
                                std::to_string(cameras.size() - 1));
  }
  const Intrinsics& before = cameras[camera].intrinsics();
  const Intrinsics& after = model.intrinsics();
  if (before.width_px != after.width_px || before.height_px != after.height_px) {
    throw std::invalid_argument("the camera's picture is " + std::to_string(before.width_px) + " x " +
                                std::to_string(before.height_px) + " px, its new calibration is for " +
                                std::to_string(after.width_px) + " x " + std::to_string(after.height_px));
  }
  if (const std::string wrong = check(uncertainty); !wrong.empty())
    throw std::invalid_argument("uncertainty: " + wrong);
}

void check_config(const TrackerConfig& config) {
  if (config.search.tile_px < 64 || config.search.tile_px > 4096) {
    throw std::invalid_argument("search.tile_px is " + std::to_string(config.search.tile_px) +
                                ", allowed 64 to 4096");
  }
  if (config.search.steps_per_frame < 1 || config.search.steps_per_frame > 100) {
    throw std::invalid_argument("search.steps_per_frame is " + std::to_string(config.search.steps_per_frame) +
                                ", allowed 1 to 100");
  }
  if (config.search.first_steps_per_frame < 1 || config.search.first_steps_per_frame > 100) {
    throw std::invalid_argument("search.first_steps_per_frame is " +
                                std::to_string(config.search.first_steps_per_frame) + ", allowed 1 to 100");
  }
  const auto at_least_one = [](const char* field, int value) {
    if (value < 1)
      throw std::invalid_argument(std::string(field) + " is " + std::to_string(value) + ", allowed 1 and up");
  };
  at_least_one("tags.look_interval", config.tags.look_interval);
  at_least_one("tags.sweep_interval", config.tags.sweep_interval);
  for (const FloorMask& mask : config.floor_masks) {
    if (const std::string wrong = check(mask); !wrong.empty())
      throw std::invalid_argument("floor mask '" + mask.name + "': " + wrong);
  }
  if (const std::string wrong = check(config.depth); !wrong.empty()) throw std::invalid_argument(wrong);
  if (config.audit_interval < 0) {
    throw std::invalid_argument("audit_interval is " + std::to_string(config.audit_interval) +
                                ", allowed 0 and up");
  }
}

void check_frame(const Frame& frame, const std::vector<CameraModel>& cameras) {
  if (frame.camera >= cameras.size()) {
    throw std::invalid_argument("frame of camera " + std::to_string(frame.camera) + ", there are " +
                                std::to_string(cameras.size()));
  }
  const Intrinsics& camera = cameras[frame.camera].intrinsics();
  if (frame.image.empty() || (frame.image.type() != CV_8UC1 && frame.image.type() != CV_8UC3)) {
    throw std::invalid_argument("a frame must have 8 bits and 1 or 3 channels");
  }
  if (frame.image.cols != camera.width_px || frame.image.rows != camera.height_px) {
    throw std::invalid_argument("the frame is " + std::to_string(frame.image.cols) + " x " +
                                std::to_string(frame.image.rows) + " px, the camera's intrinsics are for " +
                                std::to_string(camera.width_px) + " x " + std::to_string(camera.height_px));
  }
  if (!frame.depth.empty() && (frame.depth.type() != CV_16UC1 || frame.depth.size() != frame.image.size())) {
    throw std::invalid_argument("depth must have 16 bits, one channel and the image's size");
  }
}

}  // namespace skylight
