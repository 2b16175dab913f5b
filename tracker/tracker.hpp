// One tracker per robot over shared frame work: frames in, poses out.
//
// No thread, clock, file or socket in here. process() is called by one thread; what it hands out
// (reports, history views, filters) are values that other threads may keep.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracker/appearance.hpp"
#include "tracker/camera.hpp"
#include "tracker/camera_uncertainty.hpp"
#include "tracker/depth/surface.hpp"
#include "tracker/detect/homography.hpp"
#include "tracker/detect/orb_detector.hpp"
#include "tracker/detect/tag_detector.hpp"
#include "tracker/filter/filters.hpp"
#include "tracker/floor_mask.hpp"
#include "tracker/history.hpp"
#include "tracker/motion_prior.hpp"

namespace skylight {

/// orb: features acquire, alignment of the picture tracks; where the robot has a tag too, that takes over
/// when the picture is refused, or is contradicted by the tag. apriltag: the tag alone. homography: the
/// paper's pipeline, which knows of no tags.
enum class DetectorKind : std::uint8_t { orb, apriltag, homography };

struct RobotSpec {
  std::string id;                                ///< not empty, unique in a tracker
  std::shared_ptr<const Appearance> appearance;  ///< the detector apriltag does without
  std::optional<double>
      surface_height_m;  ///< of this robot's picture, where a payload raises it; none: the appearance's
  /// The picture's middle in base_link, and its way up from the robot's forward direction, counter-clockwise,
  /// -5 to 5 m; none: as the appearance's reference point has it.
  std::optional<Pose2> picture_mounting;
  std::optional<TagSpec> tag;  ///< unique in a tracker; the detector apriltag needs it
  DetectorKind detector = DetectorKind::orb;
  FilterSpec filter;
  HomographyConfig homography;
  std::optional<Pose2> initial_pose;  ///< where it stands at the first frame, if known
};

/// Forward and left extent of what is seen of a robot: its picture, else its tag. Metres.
Eigen::Vector2d seen_size_m(const RobotSpec& spec);
/// The middle of that in base_link, and its height above the floor.
Eigen::Vector2d seen_centre_m(const RobotSpec& spec);
double seen_height_m(const RobotSpec& spec);

struct SearchConfig {
  int tile_px =
      256;  ///< side of the part of a frame that one step of a whole-floor search looks at, 64 to 4096
  int steps_per_frame = 1;        ///< tiles looked at per frame, over all robots that are searched: 1 to 100
  int first_steps_per_frame = 3;  ///< the same while no robot is tracked that this could hold up: 1 to 100
};

/// Robots with a tag.
struct TagConfig {
  TagFinderConfig finder;
  TagPoseConfig pose;
  int look_interval = 15;   ///< frames between looks at the tag of a robot whose picture is tracked, 1 and up
  int sweep_interval = 10;  ///< frames between tiles that are searched for the tag of a robot whose picture
                            ///< is tracked where its tag is not seen, 1 and up
};

struct TrackerConfig {
  OrbDetectorConfig orb;
  TagConfig tags;
  MotionPriorConfig prior;
  SearchConfig search;
  DepthConfig depth;  ///< of frames that have any
  HistoryLimits history;
  /// How well each camera is known, in their order; empty: exactly. It goes into every observation
  /// (`correlated`) and every published covariance.
  std::vector<CameraUncertainty> calibration;
  /// Where robots are not searched for. One that is tracked may drive through and stays tracked.
  std::vector<FloorMask> floor_masks;
  int audit_interval = 60;  ///< frames between second opinions on a tracked robot, 0: never
};

/// Runs task(0) ... task(count - 1), in any order and in parallel if it likes, and returns when all are
/// done. Results do not depend on it.
using Executor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& task)>;
void run_in_order(std::size_t count, const std::function<void(std::size_t)>& task);

/// What one frame told about one robot.
struct RobotReport {
  std::string id;
  TrackState state = TrackState::searching;
  std::string_view reason;                ///< in words, why there is no observation; empty if there is one
  std::optional<Observation> measured{};  ///< what this frame shows
  /// Of the frame's instant; where a frame came later than another camera's, with all that came since.
  std::optional<Estimate> filtered{};
};

/// Everything known of one robot up to a frame; a value to keep and to read from any thread.
struct RobotView {
  std::string id;
  TrackState state = TrackState::searching;
  std::string_view reason;
  HistoryView history;
  std::shared_ptr<const Filter> filter;  ///< as it was after that frame: predict() from it
  std::optional<Observation> last_measured{};
  SurfaceHeight measured_height{};  ///< of what is seen of it, by depth, over the frames that observed it
};

class Tracker {
 public:
  static constexpr std::size_t kMostCameras = 64;

  /// Throws std::invalid_argument for no camera, too many, or a setting out of range.
  explicit Tracker(std::vector<CameraModel> cameras, const TrackerConfig& config = {},
                   Executor executor = run_in_order);
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  const std::vector<CameraModel>& cameras() const;
  /// How well a camera is known; zero: exactly. `camera` is less than cameras().size().
  CameraUncertainty uncertainty(std::size_t camera) const;

  /// A camera hangs elsewhere, or is known better or worse: from the next frame on. What is known of the
  /// robots stays. Throws std::invalid_argument for a camera that is not there, another picture size, or an
  /// uncertainty that is none; nothing has changed then.
  void recalibrate(std::size_t camera, const CameraModel& model, const CameraUncertainty& uncertainty);

  /// Throws std::invalid_argument: no id, no appearance, an id or a tag that is taken, settings out of range.
  void add(const RobotSpec& spec);
  /// Replaces a robot's settings; its history stays, and so does its filter's state where the filter's
  /// settings stay. False where there is no such robot; throws as add().
  bool change(const RobotSpec& spec);
  bool remove(std::string_view id);
  std::vector<RobotSpec> robots() const;

  /// One frame, in the order of capture per camera. Throws std::invalid_argument for a frame that cannot
  /// be looked at (no such camera, empty, another size or type than the camera's): nothing has changed then.
  std::vector<RobotReport> process(const Frame& frame);

  /// What a robot says of its own motion, at its time by the cameras' clock. False where there is no such
  /// robot, or its filter did not use it.
  bool odometry(std::string_view id, const BodyVelocity& velocity);

  std::vector<RobotView> views() const;

  /// How the floor lies in a camera's depth; none before it gave any. Throws std::out_of_range.
  std::optional<FloorFit> floor_fit(std::size_t camera) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight
