// What a motion filter tells: the step, predictions, smoothed poses. How it comes to know it: motion.cpp.
#include <algorithm>
#include <cmath>

#include "tracker/filter/imm_smoother.hpp"
#include "tracker/filter/motion.hpp"

namespace skylight {

using motion::Gaussian6;
using motion::kModels;
using motion::LinearMeasurement;
using motion::Mixture;

FilterStep MotionFilter::step(bool accepted) const {
  FilterStep out;
  out.accepted = accepted;
  if (records_.empty()) return out;
  const Record& newest = *records_.back();
  switch (newest.after.phase) {
    case Phase::searching:
      out.state = TrackState::searching;
      return out;
    case Phase::calibrating:
      out.state = TrackState::calibrating;
      return out;
    case Phase::lost:
      out.state = TrackState::lost;
      return out;
    case Phase::running:
      break;
  }
  // Odometry between frames changes nothing of what the last frame said.
  const bool now = newest.event.velocity
                       ? newest.event.at - newest.after.last_accepted < from_seconds(motion::kGapAfter)
                       : newest.after.accepted;
  out.state = now ? TrackState::tracking : TrackState::predicting;
  out.estimate = predict(newest.event.at);
  return out;
}

/// `track`: as it was at the event nearest before.
Estimate MotionFilter::publish(Time at, const Gaussian6& state, const Track& track) const {
  const double yaw = state.mean[motion::kYaw];
  const double u = state.mean[motion::kU];
  const double s = state.mean[motion::kS];
  Estimate out;
  out.at = at;
  const Eigen::Vector3d shift = track.cameras.shift();
  out.pose = {state.mean[motion::kX] + shift.x(), state.mean[motion::kY] + shift.y(),
              wrap_angle(yaw + shift.z())};
  out.velocity = {u * std::cos(yaw) - s * std::sin(yaw), u * std::sin(yaw) + s * std::cos(yaw),
                  state.mean[motion::kW]};
  out.covariance = state.cov.topLeftCorner<3, 3>();
  const double bias = config_.observation_bias_m;
  const double yaw_bias = config_.observation_bias_rad;
  out.covariance.diagonal() += Eigen::Vector3d(bias * bias, bias * bias, yaw_bias * yaw_bias);
  out.covariance += track.cameras.correlated();
  out.cameras = track.cameras.contributing();
  return out;
}

std::optional<Estimate> MotionFilter::predict(Time at) const {
  if (records_.empty() || at < records_.back()->event.at) return std::nullopt;
  const Record& newest = *records_.back();
  if (newest.after.phase != Phase::running) return std::nullopt;
  const Mixture& from = newest.after.gap ? *newest.after.gap : newest.after.main;
  return publish(at, motion::collapse(motion::predict(ahead_, from, to_seconds(at - newest.event.at))),
                 newest.after);
}

std::optional<std::array<double, kModels>> MotionFilter::model_probabilities() const {
  if (records_.empty() || records_.back()->after.phase != Phase::running) return std::nullopt;
  const Track& track = records_.back()->after;
  return track.gap ? track.gap->weight : track.main.weight;
}

std::vector<CameraOpinion> MotionFilter::opinions() const {
  if (records_.empty() || records_.back()->after.phase != Phase::running) return {};
  return records_.back()->after.cameras.opinions(records_.back()->event.at);
}

/// The events that tell of the robot at `at`: from the last one not after it until the track ends or begins
/// anew. None where the robot was not known then.
std::optional<MotionFilter::Stretch> MotionFilter::stretch(Time at) const {
  const auto known = [this](std::size_t i) {
    const Phase phase = records_[i]->after.phase;
    return phase == Phase::running || phase == Phase::calibrating;
  };
  const auto next = std::upper_bound(records_.begin(), records_.end(), at,
                                     [](Time t, const auto& record) { return t < record->event.at; });
  if (next == records_.begin()) return std::nullopt;
  Stretch out;
  out.first = static_cast<std::size_t>(next - records_.begin()) - 1;
  if (!known(out.first)) return std::nullopt;
  out.last = out.first;
  while (out.last + 1 < records_.size() && known(out.last + 1) && !records_[out.last + 1]->after.restarted)
    ++out.last;
  // After its last event a track that ended tells nothing more.
  if (out.last == out.first && records_[out.first]->event.at != at) return std::nullopt;
  return out;
}

/// From the stretch's last event back to `at`; each(time, filtered, future, turned, track) at every event and
/// at `at`.
template <typename Each>
void MotionFilter::look_back(const Stretch& events, Time at, const Each& each) const {
  const auto branch = [](const Track& track, bool gap) -> const Mixture& {
    return gap && track.gap ? *track.gap : track.main;
  };
  bool gap = true;
  Mixture filtered = branch(records_[events.last]->after, gap);
  motion::Future future = motion::no_future(filtered);
  double turned = 0.0;
  each(records_[events.last]->event.at, filtered, future, turned, records_[events.last]->after);
  for (std::size_t i = events.last; i > events.first; --i) {
    const Record& here = *records_[i];
    if (here.after.accepted) motion::add(future, measurement(i), motion::collapse(filtered).mean);
    if (here.after.turned != 0.0) motion::turn_back(future, here.after.turned);
    turned += here.after.turned;
    gap = here.after.took_gap || (gap && here.after.gap != nullptr);
    const Record& before = *records_[i - 1];
    filtered = branch(before.after, gap);
    const motion::ModelBank& bank = bank_for(before.after.last_accepted, here.event.at);
    Time from = before.event.at;
    if (at > from) {
      filtered = motion::predict(bank, filtered, to_seconds(at - from));
      from = at;
    }
    const double dt = to_seconds(here.event.at - from);
    if (dt > 0.0) future = motion::back(bank, filtered, dt, future);
    each(from, filtered, future, turned, before.after);
  }
}

std::vector<Estimate> MotionFilter::smoothed_from(Time from) const {
  std::vector<Estimate> out;
  if (records_.empty()) return out;
  const Time oldest = smoothed_since();
  const auto events = stretch(records_.back()->event.at);
  if (!events) return out;
  Stretch all{.first = events->last, .last = events->last};
  while (all.first > 0 && records_[all.first - 1]->event.at >= std::max(from, oldest) &&
         !records_[all.first]->after.restarted)
    --all.first;
  look_back(
      all, records_[all.first]->event.at,
      [&](Time at, const Mixture& filtered, const motion::Future& future, double turned, const Track& track) {
        if (at < std::max(from, oldest) || (!out.empty() && out.back().at == at)) return;
        Gaussian6 state = motion::combine(filtered, future);
        state.mean[motion::kYaw] += turned;
        out.push_back(publish(at, state, track));
      });
  std::reverse(out.begin(), out.end());
  return out;
}

std::optional<Estimate> MotionFilter::smoothed(Time at) const {
  if (records_.empty() || at > records_.back()->event.at || at < smoothed_since()) return std::nullopt;
  const auto events = stretch(at);
  if (!events) return std::nullopt;
  std::optional<Estimate> out;
  look_back(
      *events, at,
      [&](Time t, const Mixture& filtered, const motion::Future& future, double turned, const Track& track) {
        if (t != at) return;
        Gaussian6 state = motion::combine(filtered, future);
        state.mean[motion::kYaw] += turned;
        out = publish(at, state, track);
      });
  return out;
}

/// An observation as it was used.
LinearMeasurement MotionFilter::pose_as_used(const Record& record) {
  LinearMeasurement out = motion::pose_measurement(*record.event.observation, record.after.scale);
  out.value -= record.after.offset;
  out.noise += record.after.spread;
  return out;
}

/// What event i told, as it was used.
LinearMeasurement MotionFilter::measurement(std::size_t i) const {
  const Event& event = records_[i]->event;
  if (!event.velocity) return pose_as_used(*records_[i]);
  const std::optional<Time> last = i > 0 ? records_[i - 1]->after.last_odometry : std::nullopt;
  return motion::velocity_measurement(*event.velocity,
                                      last ? to_seconds(event.at - *last) : motion::kOdometryMemory);
}

}  // namespace skylight
