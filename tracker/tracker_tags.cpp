// The tags of the robots: looked at where a robot is expected, compared with its picture, searched for.
#include <algorithm>
#include <stdexcept>

#include "tracker/tracker_impl.hpp"

namespace skylight {
namespace {

constexpr int kRefusalsInARow = 5;  // of a picture, until it rests while the tag is seen
constexpr int kPictureRests = 10;   // frames between its next chances

}  // namespace

void Tracker::Impl::detect_tag(Track& track, const Frame& frame) const {
  const CameraModel& camera = cameras[frame.camera];
  const Eigen::Vector2d at = track.tag->middle_m(track.expected->pose);
  const auto pixel = camera.pixel_from_map({at.x(), at.y(), track.tag->tag().height_m});
  if (!pixel || !camera.sees(*pixel)) {
    track.reason = kOutOfView;
    return;
  }
  const TagObservation seen = track.tag->detect_near(*tags, frame, camera, *track.expected);
  track.observed = seen.observation;
  track.reason = seen.refused;
}

// The picture first, for its pose is the finer one while nothing covers it; the tag where that refuses. A
// picture that was refused again and again rests while the tag is seen.
void Tracker::Impl::detect_both(Track& track, const Frame& frame) const {
  const bool rests = track.picture_refusals >= kRefusalsInARow && track.picture_refusals % kPictureRests != 0;
  if (rests) {
    detect_tag(track, frame);
    if (track.observed) {
      ++track.picture_refusals;
      return;
    }
  }
  detect_orb(track, frame);
  if (track.observed) {
    track.picture_refusals = 0;
    compare_with_tag(track, frame);
    return;
  }
  ++track.picture_refusals;
  track.frames_since_tag_look = config.tags.look_interval;  // the next picture that fits is checked at once
  if (rests) return;
  const std::string_view why = track.reason;
  detect_tag(track, frame);
  if (!track.observed) track.reason = why;
}

// A look at the tag of a robot whose picture was found: where they contradict each other the tag is right,
// for it tells who it is.
void Tracker::Impl::compare_with_tag(Track& track, const Frame& frame) const {
  if (++track.frames_since_tag_look < config.tags.look_interval) return;
  const TagObservation seen = track.tag->detect_near(*tags, frame, cameras[frame.camera],
                                                     {track.observed->pose, track.expected->radius_m});
  track.unconfirmed = !seen.observation;
  const bool drifted = seen.observation && contradict(*track.observed, *seen.observation);
  if (drifted) track.observed = seen.observation;
  track.frames_since_tag_look = drifted ? config.tags.look_interval : 0;
}

// How many tiles of this frame are searched for tags: as many as for pictures while a robot with a tag is
// searched for, one now and then while one is tracked by a picture whose tag is not there.
std::size_t Tracker::Impl::tag_steps() {
  bool lost = false;
  bool doubted = false;
  bool nobody = true;
  for (const auto& track : tracks) {
    nobody = nobody && !track->expected;
    if (!track->tag) continue;
    lost = lost || (track->searched && !track->observed);
    doubted = doubted || (track->observed && track->unconfirmed);
  }
  if (lost) {
    return static_cast<std::size_t>(nobody ? config.search.first_steps_per_frame
                                           : config.search.steps_per_frame);
  }
  if (!doubted || ++frames_since_tag_sweep < config.tags.sweep_interval) return 0;
  frames_since_tag_sweep = 0;
  return 1;
}

// In the middle of the picture; `largest` receives the widest tag's.
double Tracker::Impl::smallest_tag_px(const Frame& frame, double& largest) const {
  const CameraModel& camera = cameras[frame.camera];
  const Intrinsics& in = camera.intrinsics();
  double smallest = 0.0;
  for (const auto& track : tracks) {
    if (!track->tag) continue;
    const auto at = camera.plane_from_pixel({in.cx_px, in.cy_px}, track->tag->tag().height_m);
    const auto edge = at ? track->tag->edge_px(camera, *at) : std::nullopt;
    if (!edge) continue;
    smallest = smallest > 0.0 ? std::min(smallest, *edge) : *edge;
    largest = std::max(largest, *edge);
  }
  return smallest;
}

bool Tracker::Impl::no_tag_is_searched_in(const cv::Rect& part, const CameraModel& camera) const {
  return std::all_of(tracks.begin(), tracks.end(), [&](const auto& track) {
    return !track->tag || any_covers(config.floor_masks, camera, part, track->tag->tag().height_m);
  });
}

// One pass over a tile serves all robots with tags.
void Tracker::Impl::search_tags(const Frame& frame) {
  if (!tags) return;
  const std::size_t steps = tag_steps();
  double largest = 0.0;
  const double smallest = steps > 0 ? smallest_tag_px(frame, largest) : 0.0;
  if (smallest <= 0.0) return;
  tag_sweeps.resize(cameras.size());
  for (std::size_t step = 0; step < steps; ++step) {
    std::vector<cv::Rect> parts;
    if (depth != nullptr) parts = tag_blobs(frame);
    if (parts.empty()) {
      const auto tile = tag_sweeps[frame.camera].next(
          frame.image.size(), config.search.tile_px, static_cast<int>(2.0 * largest) + 1,
          [&](const cv::Rect& part) { return no_tag_is_searched_in(part, cameras[frame.camera]); });
      if (!tile) return;
      parts.push_back(*tile);
    }
    for (const cv::Rect& part : parts) {
      // Half the magnification of a look: a tag that is missed now is seen in the next round.
      for (const FoundTag& found : tags->find(frame.image, {part, 2.0 * smallest})) {
        for (const auto& track : tracks) {
          if (track->tag && track->tag->is(found)) take_tag(*track, found, frame);
        }
      }
    }
  }
}

void Tracker::Impl::take_tag(Track& track, const FoundTag& found, const Frame& frame) const {
  const bool is_tracked_by_tag =
      track.observed && (track.observed->source == PoseSource::apriltag || !track.unconfirmed);
  if (is_tracked_by_tag) return;
  const TagObservation seen = track.tag->observe(found, frame, cameras[frame.camera]);
  if (!seen.observation) {
    if (!track.observed) track.reason = seen.refused;
    return;
  }
  if (any_covers(config.floor_masks, seen.observation->pose.position())) {
    if (!track.observed) track.reason = "its tag lies where the floor is masked";
    return;
  }
  track.observed = seen.observation;
  track.reason = {};
  track.unconfirmed = false;
  check_height(track, frame);
}

void Tracker::Impl::choose_families() {
  std::vector<std::string> families;
  for (const auto& track : tracks) {
    if (track->tag) families.push_back(track->tag->tag().family);
  }
  std::sort(families.begin(), families.end());
  families.erase(std::unique(families.begin(), families.end()), families.end());
  if (families == families_of_tags) return;
  tags.reset();
  if (!families.empty()) tags.emplace(families, config.tags.finder);
  families_of_tags = std::move(families);
}

void Tracker::Impl::check_tag_is_free(const RobotSpec& spec) const {
  if (!spec.tag) return;
  for (const auto& track : tracks) {
    const auto& other = track->spec.tag;
    if (track->spec.id == spec.id || !other || other->id != spec.tag->id || other->family != spec.tag->family)
      continue;
    throw std::invalid_argument("robot '" + spec.id + "': its tag, " + other->family + " " +
                                std::to_string(other->id) + ", is that of robot '" + track->spec.id +
                                "' already");
  }
}

}  // namespace skylight
