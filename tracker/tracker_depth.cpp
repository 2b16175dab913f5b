// What depth adds to the tracker, where a frame has any: poses at the wrong height are refused, what hides a
// robot is told from its being gone, and searches look at things of its height and size first.
#include <algorithm>
#include <stdexcept>

#include "tracker/tracker_impl.hpp"

namespace skylight {
namespace {

constexpr std::string_view kWrongHeight =
    "what looked like it is not at its height above the floor: no robot, or its height is set wrong";
constexpr std::string_view kHeightNotClear =
    "something that looks like it is seen: whether it is as high as the robot is not clear yet";
constexpr std::string_view kCovered = "covered: something higher than it is seen where it is expected";
constexpr std::string_view kLeft = "not where it was expected: the floor is seen there; searched for";
constexpr std::size_t kBlobsThenTile = 3;    // steps of a search: two at blobs, then a tile
constexpr double kLargestBlob = 4.0;         // of the surface's area: robots may stand close together
constexpr double kLargestAroundATag = 60.0;  // a tag tells nothing of how large its robot is
constexpr double kOneRobot = 1.5;            // of its area: with more there may be another one beside it
constexpr double kWellKnown = 0.3;  // m, standard deviation up to which the filter knows where to look

}  // namespace

// Without depth this is all that happens: one question for each frame.
void Tracker::Impl::learn_floor(const Frame& frame) {
  depth = nullptr;
  if (frame.depth.empty() || !config.depth.use) return;
  depths.resize(cameras.size());
  auto& here = depths[frame.camera];
  if (!here)
    here = std::make_unique<CameraDepth>(CameraDepth{.floor = {cameras[frame.camera], config.depth}});
  here->floor.learn(frame.depth);
  here->heights.release();
  if (here->floor.fit().known) depth = here.get();
}

// An observation at a place where depth shows another height is none. What was not followed there before is
// held back until its height is clear, and meanwhile followed.
void Tracker::Impl::check_height(Track& track, const Frame& frame) const {
  if (depth == nullptr || !track.observed || track.homography) return;  // the baseline is left as it is
  const bool by_tag = track.observed->source == PoseSource::apriltag;
  const Surface& surface = by_tag ? track.tag_surface : track.surface;
  const Eigen::Vector2d place = track.observed->pose.position();
  const double within = 0.5 * seen_size_m(track.spec).minCoeff();  // nothing else can stand so near
  const bool followed = track.expected && (place - track.expected->pose.position()).norm() <= within;
  if (!followed) track.height_check = {};
  track.held = false;
  const SurfaceLook look = look_at(depth->floor, frame.depth, surface, track.observed->pose);
  if (!tells(look)) return;
  const HeightCheck::Answer answer = track.height_check.add(look, surface.height_m, depth->floor);
  if (answer == HeightCheck::Answer::right) {
    if (!by_tag || !track.spec.appearance) track.measured_height.add(look, depth->floor.fit().uneven_m);
    return;
  }
  track.held = answer == HeightCheck::Answer::open;
  track.reason = track.held ? kHeightNotClear : kWrongHeight;
  if (track.held) {
    track.prior.observe(*track.observed);
  } else if (followed && !track.height_check.passed()) {
    forget_place(track);
  }
  track.observed.reset();
}

void Tracker::Impl::forget_place(Track& track) {
  track.prior.forget();
  track.heading.forget();
}

// What was found where it was expected is judged. Where it was not found, and the floor is seen in its place,
// there is no need to wait until it is searched for.
void Tracker::Impl::notice_leaving(Track& track, const Frame& frame) const {
  check_height(track, frame);
  if (track.observed || track.held || !track.expected || track.homography ||
      another_camera_sees(track, frame))
    return;
  if (!empty(look_at(depth->floor, frame.depth, track.surface, track.expected->pose))) return;
  track.expected.reset();
  forget_place(track);
  track.searched = true;
  track.reason = kLeft;
}

// It may be where its filter carries it, as long as that knows; then where it was thought to be last. Where
// the floor is seen at all such places it is gone, and nothing that these spread to later hides it.
void Tracker::Impl::look_for_cover(Track& track, const Frame& frame) const {
  if (track.observed || !track.may_be) return;
  const auto carried = track.filter->predict(frame.captured);
  if (carried && carried->covariance.topLeftCorner<2, 2>().trace() < kWellKnown * kWellKnown)
    track.may_be = carried;
  const Whereabouts seen = whereabouts(depth->floor, frame.depth, track.surface, track.may_be->pose,
                                       track.may_be->covariance.topLeftCorner<2, 2>());
  if (gone(seen)) track.may_be.reset();
  track.covered = skylight::covered(seen);
  if (track.covered) track.reason = kCovered;
}

// Blobs of the robot's height and size on which no robot was seen in this frame.
std::vector<Blob> Tracker::Impl::free_blobs(const Track& track, const Frame& frame) const {
  if (depth->heights.empty()) depth->heights = height_map(depth->floor, frame.depth);
  const Eigen::Vector2d size = seen_size_m(track.spec);
  std::vector<Blob> blobs =
      find_blobs(depth->floor, depth->heights,
                 {.height_m = track.surface_height_m(),
                  .size_m = size,
                  .largest = track.spec.appearance ? kLargestBlob : kLargestAroundATag});
  std::erase_if(blobs, [&](const Blob& blob) {
    return blob.area_m2 < kOneRobot * size.prod() &&
           std::any_of(tracks.begin(), tracks.end(), [&](const auto& other) {
             if (!other->observed) return false;
             const Pose2& pose = other->observed->pose;
             const Eigen::Vector2d middle =
                 pose.position() + Eigen::Rotation2Dd(pose.yaw) * seen_centre_m(other->spec);
             return (middle - blob.place_m).norm() < 0.5 * size.minCoeff();
           });
  });
  return blobs;
}

// Looks at blobs instead of a tile, as many as a tile has room for, each in its turn. False where it is a
// tile's turn, or there are none.
bool Tracker::Impl::search_blobs(Track& track, const Frame& frame) const {
  if (track.search_steps++ % kBlobsThenTile == kBlobsThenTile - 1) return false;
  const std::vector<Blob> blobs = free_blobs(track, frame);
  int room_px = config.search.tile_px * config.search.tile_px;
  const auto allowed = [this](const Eigen::Vector2d& place) {
    return !any_covers(config.floor_masks, place);
  };
  for (std::size_t i = 0; i < blobs.size() && room_px > 0 && !track.observed && !track.held; ++i) {
    const Blob& blob = blobs[track.blob_turn++ % blobs.size()];
    room_px -= blob.part_px.area();
    track.observed = track.of_robot(
        track.orb->find_in(frame, cameras[frame.camera], blob.part_px, track.surface_height_m(), allowed));
    check_height(track, frame);
  }
  return !blobs.empty();
}

// The same for tags: the blobs of all robots whose tag is searched for.
std::vector<cv::Rect> Tracker::Impl::tag_blobs(const Frame& frame) {
  if (tag_search_steps++ % kBlobsThenTile == kBlobsThenTile - 1) return {};
  std::vector<cv::Rect> all;
  for (const auto& track : tracks) {
    if (!track->tag || !track->searched || track->observed) continue;
    for (const Blob& blob : free_blobs(*track, frame)) {
      if (std::find(all.begin(), all.end(), blob.part_px) == all.end()) all.push_back(blob.part_px);
    }
  }
  std::vector<cv::Rect> parts;
  int room_px = config.search.tile_px * config.search.tile_px;
  while (parts.size() < all.size() && room_px > 0) {
    parts.push_back(all[tag_blob_turn++ % all.size()]);
    room_px -= parts.back().area();
  }
  return parts;
}

std::optional<FloorFit> Tracker::floor_fit(std::size_t camera) const {
  if (camera >= impl_->cameras.size())
    throw std::out_of_range("there is no camera " + std::to_string(camera));
  if (camera >= impl_->depths.size() || !impl_->depths[camera]) return std::nullopt;
  return impl_->depths[camera]->floor.fit();
}

}  // namespace skylight
