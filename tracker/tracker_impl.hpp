// What a Tracker is made of; for its own .cpp files.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracker/depth/blobs.hpp"
#include "tracker/depth/height_check.hpp"
#include "tracker/depth/whereabouts.hpp"
#include "tracker/heading.hpp"
#include "tracker/mounting.hpp"
#include "tracker/search.hpp"
#include "tracker/tracker.hpp"

namespace skylight {

inline constexpr std::string_view kOutOfView = "outside this camera's picture";

// One robot: its detector, what the detector needs from frame to frame, filter and history.
struct Track {
  Track(const RobotSpec& robot, const TrackerConfig& config)
      : spec(robot),
        prior(config.prior),
        heading(robot.appearance ? robot.appearance->heading_turns() : 1, seen_centre_m(robot)),
        filter(make_filter(robot.filter)),
        history(config.history) {
    if (robot.appearance && robot.picture_mounting)
      mounting.emplace(*robot.appearance, *robot.picture_mounting);
    make_detector(config);
    if (spec.appearance) surface = surface_of(*spec.appearance, surface_height_m());
    if (spec.appearance && spec.picture_mounting) {
      const Eigen::Rotation2Dd turn(spec.picture_mounting->yaw);
      for (Eigen::Vector2d& place : surface.places_m)
        place = spec.picture_mounting->position() + turn * (place - spec.appearance->centre_m());
    }
    if (spec.tag)
      tag_surface = surface_of(Eigen::Vector2d::Constant(spec.tag->size_m), spec.tag->mounting.position(),
                               spec.tag->height_m);
    if (!spec.appearance) surface = tag_surface;
  }

  void make_detector(const TrackerConfig& config) {
    orb.reset();
    homography.reset();
    tag.reset();
    if (spec.detector == DetectorKind::orb) orb.emplace(spec.appearance, config.orb);
    if (spec.detector == DetectorKind::homography) homography.emplace(spec.appearance, spec.homography);
    if (spec.tag && spec.detector != DetectorKind::homography) tag.emplace(*spec.tag, config.tags.pose);
  }

  double surface_height_m() const { return seen_height_m(spec); }
  /// What a detector of the picture tells, as an observation of this robot.
  std::optional<Observation> of_robot(std::optional<Observation> seen) const {
    return seen && mounting ? mounting->of_base(*seen) : seen;
  }

  RobotSpec spec;
  std::optional<OrbDetector> orb;
  std::optional<HomographyDetector> homography;
  std::optional<TagDetector> tag;
  MotionPrior prior;
  HeadingResolver heading;
  std::optional<Mounting> mounting;  ///< none: the picture lies as its appearance says
  Sweep sweep;
  std::unique_ptr<Filter> filter;
  PoseHistory history;
  std::optional<Observation> last_measured;
  struct Accepted {
    std::size_t camera = 0;
    Time at{};
  };
  std::optional<Accepted> last_accepted;  ///< by the filter
  int frames_since_audit = 0;
  int frames_since_tag_look = 0;
  int picture_refusals = 0;  ///< in a row
  bool unconfirmed = false;  ///< its picture is tracked where its tag was looked for and not seen

  Surface surface;  ///< what depth is asked for: of its picture, else of its tag
  Surface tag_surface;
  SurfaceHeight measured_height;
  HeightCheck height_check;        ///< of what is seen in its place since that looked like it
  std::optional<Estimate> may_be;  ///< where it was seen or thought to be last; none: gone from there
  std::size_t search_steps = 0;    ///< whose turn: blobs or a tile
  std::size_t blob_turn = 0;       ///< which of the blobs is looked at first

  // Of the frame at hand.
  std::optional<Prior> expected;
  std::optional<Observation> observed;
  bool searched = false;  ///< observed (or not) by the whole-floor search
  bool held = false;      ///< something looks like it of which the height is not clear yet
  std::string_view reason;
  TrackState state = TrackState::searching;
  bool covered = false;
};

// Of a camera with depth.
struct CameraDepth {
  FloorDepth floor;
  cv::Mat heights;  ///< of the frame at hand, made when the first search asks; empty until then
};

struct Tracker::Impl {
  std::vector<CameraModel> cameras;
  TrackerConfig config;
  Executor executor;
  std::vector<std::unique_ptr<Track>> tracks;
  std::size_t search_turn = 0;    ///< which of the searched robots goes first
  std::optional<TagFinder> tags;  ///< of all robots' families; none where no robot has a tag
  std::vector<Sweep> tag_sweeps;  ///< by camera: one search for all tags
  std::vector<std::string> families_of_tags;
  int frames_since_tag_sweep = 0;
  std::vector<std::unique_ptr<CameraDepth>> depths;  ///< by camera; empty until the first frame with depth
  CameraDepth* depth = nullptr;      ///< of the frame at hand; null where it has none that helps
  std::size_t tag_search_steps = 0;  ///< whose turn: blobs or a tile
  std::size_t tag_blob_turn = 0;

  std::map<int, HomographyFeatures> shared_features(const Frame& frame) const;
  void detect(Track& track, const Frame& frame, const std::map<int, HomographyFeatures>& features) const;
  void detect_orb(Track& track, const Frame& frame) const;
  void detect_tag(Track& track, const Frame& frame) const;
  void detect_both(Track& track, const Frame& frame) const;
  void compare_with_tag(Track& track, const Frame& frame) const;
  void search(const Frame& frame);
  void search_step(Track& track, const Frame& frame) const;
  void learn_floor(const Frame& frame);
  void check_height(Track& track, const Frame& frame) const;
  static void forget_place(Track& track);
  void notice_leaving(Track& track, const Frame& frame) const;
  void look_for_cover(Track& track, const Frame& frame) const;
  std::vector<Blob> free_blobs(const Track& track, const Frame& frame) const;
  bool search_blobs(Track& track, const Frame& frame) const;
  std::vector<cv::Rect> tag_blobs(const Frame& frame);
  void search_tags(const Frame& frame);
  void take_tag(Track& track, const FoundTag& found, const Frame& frame) const;
  std::size_t tag_steps();
  bool no_tag_is_searched_in(const cv::Rect& part, const CameraModel& camera) const;
  double smallest_tag_px(const Frame& frame, double& largest) const;
  void choose_families();
  void check_tag_is_free(const RobotSpec& spec) const;
  void refuse_taken_places();
  Covariance3 correlated(const Track& track, const Frame& frame) const;
  RobotReport update(Track& track, const Frame& frame) const;
  static bool another_camera_sees(const Track& track, const Frame& frame);
  static std::optional<Estimate> estimate_at(const Track& track, Time at);
  static void settle(Track& track);
  Track* find(std::string_view id) const;
};

}  // namespace skylight
