#include "tracker/tracker.hpp"

#include <algorithm>
#include <stdexcept>

#include "tracker/filter/motion.hpp"
#include "tracker/tracker_checks.hpp"
#include "tracker/tracker_impl.hpp"

namespace skylight {
namespace {

constexpr Duration kSettleSlack = std::chrono::milliseconds(110);  // a frame or more

constexpr std::string_view kNotWhereExpected =
    "not found where it was expected: covered, or unlike its picture";
constexpr std::string_view kSearching = "being searched for over the whole floor";
constexpr std::string_view kTakenPlace = "what looked like it is another robot that stands there";
constexpr std::string_view kMasked = "what looked like it lies where the floor is masked";
constexpr std::string_view kNoHomography = "too few matched points agree on a homography";

}  // namespace

Eigen::Vector2d seen_size_m(const RobotSpec& spec) {
  if (spec.appearance) return spec.appearance->size_m();
  return Eigen::Vector2d::Constant(spec.tag ? spec.tag->size_m : 0.0);
}

Eigen::Vector2d seen_centre_m(const RobotSpec& spec) {
  if (spec.appearance)
    return spec.picture_mounting ? spec.picture_mounting->position() : spec.appearance->centre_m();
  return spec.tag ? spec.tag->mounting.position() : Eigen::Vector2d(0.0, 0.0);
}

double seen_height_m(const RobotSpec& spec) {
  if (spec.appearance) return spec.surface_height_m.value_or(spec.appearance->picture().surface_height_m);
  return spec.tag ? spec.tag->height_m : 0.0;
}

void run_in_order(std::size_t count, const std::function<void(std::size_t)>& task) {
  for (std::size_t i = 0; i < count; ++i) task(i);
}

std::map<int, HomographyFeatures> Tracker::Impl::shared_features(const Frame& frame) const {
  std::map<int, HomographyFeatures> features;
  for (const auto& track : tracks) {
    if (!track->homography) continue;
    const int count = track->homography->config().features;
    if (!features.contains(count)) features.emplace(count, extract_homography_features(frame.image, count));
  }
  return features;
}

void Tracker::Impl::detect(Track& track, const Frame& frame,
                           const std::map<int, HomographyFeatures>& features) const {
  track.observed.reset();
  track.searched = false;
  track.covered = false;
  track.held = false;
  track.reason = {};
  if (track.homography) {
    const auto& scene = features.at(track.homography->config().features);
    track.observed = track.of_robot(track.homography->detect(
        frame, scene, cameras[frame.camera], track.surface_height_m(),
        depth != nullptr && config.depth.correct_homography ? &depth->floor : nullptr));
    if (!track.observed) track.reason = kNoHomography;
    const bool known = track.state != TrackState::searching && track.state != TrackState::lost;
    if (track.observed && !known && any_covers(config.floor_masks, track.observed->pose.position())) {
      track.observed.reset();
      track.reason = kMasked;
    }
    return;
  }
  if (track.spec.initial_pose && !track.last_measured && track.prior.empty()) {
    track.prior.place(*track.spec.initial_pose, frame.captured);
  }
  track.expected = track.prior.at(frame.captured, frame.camera);
  if (track.expected) {
    if (!track.tag) {
      detect_orb(track, frame);
    } else if (!track.orb) {
      detect_tag(track, frame);
    } else {
      detect_both(track, frame);
    }
  } else {
    track.reason = kSearching;
    track.searched = true;
    track.heading.forget();
  }
}

void Tracker::Impl::detect_orb(Track& track, const Frame& frame) const {
  const CameraModel& camera = cameras[frame.camera];
  const double height = track.surface_height_m();
  const Pose2& at = track.expected->pose;
  const auto pixel = camera.pixel_from_map({at.x, at.y, height});
  if (!pixel || !camera.sees(*pixel)) {
    track.reason = kOutOfView;
    return;
  }
  Prior prior = *track.expected;
  if (track.mounting) prior.pose = track.mounting->appearance_at(prior.pose);
  std::optional<Observation> found = track.orb->detect_near(frame, camera, prior, height);
  track.observed = track.of_robot(found);
  if (!found) {
    track.reason = kNotWhereExpected;
    return;
  }
  if (config.audit_interval > 0 && ++track.frames_since_audit >= config.audit_interval) {
    track.frames_since_audit = 0;
    if (auto better = track.orb->audit(frame, camera, *found, height))
      track.observed = track.of_robot(better);
  }
}

// Robots without an expectation share a bounded number of steps per frame, each in its turn.
void Tracker::Impl::search(const Frame& frame) {
  std::vector<Track*> waiting;
  for (const auto& track : tracks) {
    if (track->searched && track->orb) waiting.push_back(track.get());
  }
  if (waiting.empty()) return;
  const bool nobody = std::none_of(tracks.begin(), tracks.end(),
                                   [](const auto& track) { return track->expected.has_value(); });
  const auto steps =
      static_cast<std::size_t>(nobody ? config.search.first_steps_per_frame : config.search.steps_per_frame);
  for (std::size_t step = 0; step < steps; ++step) {
    Track& track = *waiting[search_turn++ % waiting.size()];
    if (!track.observed && !track.held) search_step(track, frame);
  }
}

void Tracker::Impl::search_step(Track& track, const Frame& frame) const {
  if (depth != nullptr && search_blobs(track, frame)) return;
  const CameraModel& camera = cameras[frame.camera];
  const double height = track.surface_height_m();
  const Intrinsics& in = camera.intrinsics();
  Eigen::Matrix2d metres_by_px;
  if (!camera.plane_from_pixel({in.cx_px, in.cy_px}, height, &metres_by_px)) return;
  const double robot_px =
      track.spec.appearance->size_m().norm() / std::sqrt(std::abs(metres_by_px.determinant()));
  const auto tile = track.sweep.next(
      frame.image.size(), config.search.tile_px, static_cast<int>(std::ceil(robot_px)),
      [&](const cv::Rect& part) { return any_covers(config.floor_masks, camera, part, height); });
  if (!tile) return;
  const auto allowed = [this](const Eigen::Vector2d& place) {
    return !any_covers(config.floor_masks, place);
  };
  track.observed = track.of_robot(track.orb->find_in(frame, camera, *tile, height, allowed));
  check_height(track, frame);
}

// Two robots cannot stand in one place: whose tag is there has it, else who was tracked there, else who fits
// better.
void Tracker::Impl::refuse_taken_places() {
  for (const auto& a : tracks) {
    for (const auto& b : tracks) {
      if (a == b || !a->observed || !b->observed) continue;
      const double apart = (a->observed->pose.position() - b->observed->pose.position()).norm();
      const double least = 0.5 * std::min(seen_size_m(a->spec).minCoeff(), seen_size_m(b->spec).minCoeff());
      if (apart >= least) continue;
      const bool a_by_tag = a->observed->source == PoseSource::apriltag;
      const bool b_by_tag = b->observed->source == PoseSource::apriltag;
      bool a_stays = a->searched != b->searched ? b->searched : a->observed->score >= b->observed->score;
      if (a_by_tag != b_by_tag) a_stays = a_by_tag;  // a tag tells who it is
      Track& loser = a_stays ? *b : *a;
      loser.observed.reset();
      loser.reason = kTakenPlace;
    }
  }
}

// What the camera's calibration leaves unknown of the track's observation.
Covariance3 Tracker::Impl::correlated(const Track& track, const Frame& frame) const {
  if (config.calibration.empty()) return Covariance3::Zero();
  const bool by_tag = track.observed->source == PoseSource::apriltag;
  const double height = by_tag ? track.tag->tag().height_m : track.surface_height_m();
  const auto floor = floor_covariance(cameras[frame.camera], config.calibration[frame.camera],
                                      track.observed->pose.position(), height);
  return floor.value_or(Covariance3::Zero());  // none at the very edge of what the lens's model holds for
}

RobotReport Tracker::Impl::update(Track& track, const Frame& frame) const {
  if (track.observed) {
    track.reason = {};
    track.observed->correlated = correlated(track, frame);
    if (track.searched) track.sweep.restart();
    if (track.observed->source == PoseSource::apriltag) {
      track.heading.settle();
    } else {
      track.heading.apply(*track.observed,
                          track.expected ? std::optional(track.expected->pose) : std::nullopt);
    }
    track.prior.observe(*track.observed);
    track.last_measured = track.observed;
    track.may_be = Estimate{.pose = track.observed->pose, .covariance = track.observed->covariance};
  }
  RobotReport report{.id = track.spec.id, .reason = track.reason, .measured = track.observed};
  if (another_camera_sees(track, frame)) {
    report.state = track.state;
    report.filtered = estimate_at(track, frame.captured);
    track.reason = {};
    return report;
  }
  FilterStep step = track.filter->update(frame.captured, track.observed);
  if (step.accepted) track.last_accepted = {.camera = frame.camera, .at = frame.captured};
  const bool unseen = step.state == TrackState::predicting || step.state == TrackState::lost;
  if (track.covered && unseen) step.state = TrackState::occluded;
  track.state = step.state;
  report.state = step.state;
  report.filtered = step.estimate;
  if (step.estimate && step.estimate->at != frame.captured)
    report.filtered = estimate_at(track, frame.captured);
  track.history.append({.captured = frame.captured,
                        .state = step.state,
                        .measured = track.observed,
                        .filtered = step.estimate});
  settle(track);
  return report;
}

// A camera that does not see the robot, while another one does, tells nothing of it: it may stand beside what
// this one sees, or be covered from there alone.
bool Tracker::Impl::another_camera_sees(const Track& track, const Frame& frame) {
  return !track.observed && track.state == TrackState::tracking && track.last_accepted &&
         track.last_accepted->camera != frame.camera &&
         std::chrono::abs(frame.captured - track.last_accepted->at) < from_seconds(motion::kGapAfter);
}

std::optional<Estimate> Tracker::Impl::estimate_at(const Track& track, Time at) {
  auto estimate = track.filter->predict(at);
  return estimate ? estimate : track.filter->smoothed(at);
}

// Smoothing looks back over the whole lag: done for half a lag's frames at a time.
void Tracker::Impl::settle(Track& track) {
  const Duration lag = track.filter->smoothing_lag();
  const HistoryView history = track.history.view();
  if (lag <= Duration::zero() || history.settled() == history.size()) return;
  const Time newest = history.newest().captured;
  const Time first = history[history.settled()].captured;
  if (newest - first < lag + lag / 2 - kSettleSlack) return;
  track.history.settle(track.filter->smoothed_from(first), newest - lag);
}

Track* Tracker::Impl::find(std::string_view id) const {
  const auto at =
      std::find_if(tracks.begin(), tracks.end(), [&](const auto& track) { return track->spec.id == id; });
  return at == tracks.end() ? nullptr : at->get();
}

Tracker::Tracker(std::vector<CameraModel> cameras, const TrackerConfig& config, Executor executor)
    : impl_(std::make_unique<Impl>()) {
  if (cameras.empty() || cameras.size() > kMostCameras) {
    throw std::invalid_argument("a tracker of " + std::to_string(cameras.size()) + " cameras, allowed 1 to " +
                                std::to_string(kMostCameras));
  }
  check_config(config);
  check_calibration(config.calibration, cameras.size());
  impl_->cameras = std::move(cameras);
  impl_->config = config;
  impl_->executor = std::move(executor);
}

Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

const std::vector<CameraModel>& Tracker::cameras() const {
  return impl_->cameras;
}

CameraUncertainty Tracker::uncertainty(std::size_t camera) const {
  return impl_->config.calibration.empty() ? CameraUncertainty{} : impl_->config.calibration.at(camera);
}

void Tracker::recalibrate(std::size_t camera, const CameraModel& model,
                          const CameraUncertainty& uncertainty) {
  check_recalibration(impl_->cameras, camera, model, uncertainty);
  impl_->cameras[camera] = model;
  impl_->config.calibration.resize(impl_->cameras.size());
  impl_->config.calibration[camera] = uncertainty;
  for (const auto& track : impl_->tracks) track->filter->forget_camera(camera);
  if (!impl_->depths.empty()) impl_->depths[camera].reset();
}

void Tracker::add(const RobotSpec& spec) {
  check_spec(spec);
  if (impl_->find(spec.id) != nullptr)
    throw std::invalid_argument("robot '" + spec.id + "' is there already");
  impl_->check_tag_is_free(spec);
  impl_->tracks.push_back(std::make_unique<Track>(spec, impl_->config));
  // Second opinions are dear: robots added together must not all ask for theirs in one frame.
  if (impl_->config.audit_interval > 0) {
    impl_->tracks.back()->frames_since_audit =
        static_cast<int>(impl_->tracks.size() * 7 % static_cast<std::size_t>(impl_->config.audit_interval));
  }
  impl_->tracks.back()->frames_since_tag_look =
      static_cast<int>(impl_->tracks.size() * 7 % static_cast<std::size_t>(impl_->config.tags.look_interval));
  impl_->choose_families();
}

bool Tracker::change(const RobotSpec& spec) {
  Track* track = impl_->find(spec.id);
  if (track == nullptr) return false;
  check_spec(spec);
  impl_->check_tag_is_free(spec);
  auto changed = std::make_unique<Track>(spec, impl_->config);
  changed->history = std::move(track->history);
  changed->prior = track->prior;
  changed->last_measured = track->last_measured;
  changed->last_accepted = track->last_accepted;
  changed->may_be = track->may_be;
  changed->state = track->state;
  changed->reason = track->reason;
  if (spec.appearance == track->spec.appearance) changed->measured_height = track->measured_height;
  // What the change does not touch carries on: only another filter has to calibrate anew.
  if (spec.filter == track->spec.filter) changed->filter = std::move(track->filter);
  if (spec.appearance && spec.appearance == track->spec.appearance &&
      spec.picture_mounting == track->spec.picture_mounting)
    changed->heading = track->heading;
  for (auto& slot : impl_->tracks) {
    if (slot.get() == track) {
      slot = std::move(changed);
      break;
    }
  }
  impl_->choose_families();
  return true;
}

bool Tracker::remove(std::string_view id) {
  const bool removed =
      std::erase_if(impl_->tracks, [&](const auto& track) { return track->spec.id == id; }) > 0;
  impl_->choose_families();
  return removed;
}

std::vector<RobotSpec> Tracker::robots() const {
  std::vector<RobotSpec> specs;
  for (const auto& track : impl_->tracks) specs.push_back(track->spec);
  return specs;
}

std::vector<RobotReport> Tracker::process(const Frame& frame) {
  check_frame(frame, impl_->cameras);
  // 1. What all robots share of this frame.
  impl_->learn_floor(frame);
  const auto features = impl_->shared_features(frame);
  // 2. Each robot is looked for where it is expected.
  impl_->executor(impl_->tracks.size(), [&](std::size_t i) {
    impl_->detect(*impl_->tracks[i], frame, features);
    if (impl_->depth != nullptr) impl_->notice_leaving(*impl_->tracks[i], frame);
  });
  // 3. Those that are expected nowhere are searched, a bounded share per frame.
  impl_->search(frame);
  impl_->search_tags(frame);
  if (impl_->depth != nullptr) {
    for (const auto& track : impl_->tracks) impl_->look_for_cover(*track, frame);
  }
  // 4. One place, one robot.
  impl_->refuse_taken_places();
  // 5. Filter and history.
  std::vector<RobotReport> reports;
  reports.reserve(impl_->tracks.size());
  for (const auto& track : impl_->tracks) reports.push_back(impl_->update(*track, frame));
  return reports;
}

bool Tracker::odometry(std::string_view id, const BodyVelocity& velocity) {
  Track* track = impl_->find(id);
  return track != nullptr && track->filter->odometry(velocity);
}

std::vector<RobotView> Tracker::views() const {
  std::vector<RobotView> views;
  views.reserve(impl_->tracks.size());
  for (const auto& track : impl_->tracks) {
    views.push_back({.id = track->spec.id,
                     .state = track->state,
                     .reason = track->reason,
                     .history = track->history.view(),
                     .filter = track->filter->clone(),
                     .last_measured = track->last_measured,
                     .measured_height = track->measured_height});
  }
  return views;
}

}  // namespace skylight
