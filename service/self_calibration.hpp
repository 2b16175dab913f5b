// A camera that was bumped finds out by itself where it hangs, from tags on the floor at known places.
//
// In several of its newest frames the tags are looked for, the median of each corner over the frames that
// show it is taken, and the pose is solved as `skylight calibrate extrinsics` does
// (calibration/extrinsics.hpp); the lens is refined as far as its calibration leaves it open. It is taken
// into use only if all of this holds:
//  - no corner is further than 1 px from its median: the camera hangs still;
//  - at least two tags are seen, each in at least half of the frames;
//  - the corners are 1.5 px (root mean square) or less from where they should be seen;
//  - every place on the floor in the picture is known to 10 mm (one standard deviation): the tags determine
//    it. A single tag in a corner of the picture does not.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "service/calibration/desk.hpp"
#include "service/calibration/extrinsics.hpp"
#include "service/calibration/tags.hpp"
#include "service/floor_tag.hpp"
#include "service/pipeline.hpp"
#include "service/sources/live/backoff.hpp"

namespace skylight::service {

/// What frames of one camera, taken while it hung still, show of the tags.
class FloorTagLooks {
 public:
  static constexpr int kFrames = 8;

  explicit FloorTagLooks(std::vector<FloorTag> tags) : tags_(std::move(tags)) {}

  /// CV_8UC1 or CV_8UC3. `camera`: for its lens.
  void look(const cv::Mat& image, const CameraModel& camera);
  bool enough() const { return frames_ >= kFrames; }

  /// `before`: the calibration until now. Throws std::invalid_argument saying which of the rules above does
  /// not hold.
  calibration::CameraResult solve(const CalibrationFile& before) const;

 private:
  calibration::SeeingCamera seen(const CalibrationFile& before) const;

  std::vector<FloorTag> tags_;
  int frames_ = 0;
  std::map<std::size_t, std::vector<std::array<Pixel, 4>>> corners_;  ///< by index of the tag
};

/// For one camera, while it counts as moved: looks at frames until there are enough of them, tries, and
/// where that fails tries again after a while (2 s, doubling to 60 s).
class Recalibrator {
 public:
  explicit Recalibrator(std::vector<FloorTag> tags) : tags_(std::move(tags)), looks_(tags_) {}

  struct Outcome {
    std::optional<calibration::CameraResult> result;  ///< absent: it failed
    std::string reason;                               ///< why it failed
  };
  /// None where there is nothing to tell yet. Frames closer together than 0.1 s are passed over.
  std::optional<Outcome> look(const cv::Mat& image, Time captured, const CalibrationFile& before);
  /// What came out could not be used: as where it failed.
  void wait_after(Time captured);

 private:
  std::vector<FloorTag> tags_;
  FloorTagLooks looks_;
  Backoff backoff_{std::chrono::seconds(2), std::chrono::seconds(60)};
  Time next_{};
};

/// The document of a camera that was calibrated so, and the events that tell of it.
CalibrationFile recalibrated_document(const CalibrationFile& before, const calibration::CameraResult& result,
                                      Time now);
Event recalibrated_event(const std::string& camera, const CalibrationFile& before,
                         const calibration::CameraResult& result);
Event recalibration_failed_event(const std::string& camera, const std::string& reason);

/// Does so for all cameras of a pipeline that have floor tags, on a thread of its own.
class SelfCalibration {
 public:
  SelfCalibration(Pipeline& pipeline, CalibrationDesk& desk);
  ~SelfCalibration();
  SelfCalibration(const SelfCalibration&) = delete;
  SelfCalibration& operator=(const SelfCalibration&) = delete;

 private:
  void run();
  void attend(const CameraSnapshot& camera);

  Pipeline& pipeline_;
  CalibrationDesk& desk_;
  std::map<std::string, Recalibrator> working_;  ///< by camera, of the thread alone
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace skylight::service
