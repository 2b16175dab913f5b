// What clients read: an immutable picture of everything, made after each frame.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "service/calibration/in_use.hpp"
#include "service/camera_agreement.hpp"
#include "service/floor_tag.hpp"
#include "service/sources/feed_status.hpp"
#include "tracker/camera_watch.hpp"
#include "tracker/tracker.hpp"

namespace skylight::service {

enum class SourceState : std::uint8_t { starting, running, ended, failed };

struct RobotSnapshot {
  std::shared_ptr<const RobotSpec> spec;
  RobotView view;
  int copies = 1;  ///< robots that share this one's appearance, itself included
};

/// Between these frames, both included, a camera hung elsewhere than its calibration says.
struct MovedSpan {
  Time from{};
  Time until = Time::max();
};

struct CameraSnapshot {
  std::string id;
  std::shared_ptr<const CameraModel> model;
  std::shared_ptr<const CalibrationInUse> calibration{};  ///< what the model was made from; never null
  std::uint64_t frames = 0;                               ///< tracked
  std::uint64_t dropped = 0;                              ///< not tracked, because a newer one was there
  std::uint64_t bad_frames = 0;                           ///< that could not be read or looked at
  double frame_rate_hz = 0.0;        ///< of the last second or so, 0 until there are two frames
  Time captured{};                   ///< of the newest frame
  cv::Mat image;                     ///< the newest frame; never written to
  std::optional<FeedStatus> feed{};  ///< of a live camera; its unreadable and overtaken count above too
  std::optional<CameraAgreement>
      agreement{};         ///< with the others that see the same robots; none: there are none
  bool disagrees = false;  ///< as an event has told
  std::optional<CameraWatchReport> hold{};  ///< whether it still hangs as it did; none: it is not watched
  std::optional<FloorFit> depth{};     ///< how its depth sees the floor; none: it has none, or it is not used
  double doubt_rad = 0.0;              ///< how far it counts as turned away from its calibration
  std::vector<MovedSpan> moved{};      ///< the oldest first
  std::vector<FloorTag> floor_tags{};  ///< by which it may be calibrated
};

struct Snapshot {
  std::uint64_t sequence = 0;  ///< counts the snapshots up
  Time captured{};             ///< of the newest frame, 0 before the first
  Time processed{};            ///< when the tracker was done with it
  double tracker_ms = 0.0;     ///< how long that took
  SourceState source = SourceState::starting;
  std::string source_error;  ///< why it failed, for people
  std::vector<RobotSnapshot> robots;
  std::vector<CameraSnapshot> cameras;

  const RobotSnapshot* robot(std::string_view id) const;
  const CameraSnapshot* camera(std::string_view id) const;
};

}  // namespace skylight::service
