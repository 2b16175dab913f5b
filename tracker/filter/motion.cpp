#include "tracker/filter/motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tracker/filter/measurements.hpp"

namespace skylight {

using motion::Gaussian6;
using motion::kModels;
using motion::LinearMeasurement;
using motion::Mixture;

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kLongUnobserved = 0.31;  // s; a detector at 10 Hz misses now and then
constexpr double kUsualSpeed = 0.3;       // m/s, one sigma, of what is seen first
constexpr double kUsualYawRate = 0.6;     // rad/s

double largest_sigma(const Gaussian6& g) {
  const double a = g.cov(0, 0);
  const double b = g.cov(1, 1);
  const double c = g.cov(0, 1);
  return std::sqrt(0.5 * (a + b) + std::hypot(0.5 * (a - b), c));
}

/// No faster than it can be.
void limit(Mixture& mixture, double speed, double yaw_rate) {
  for (Gaussian6& part : mixture.part) {
    const double now = part.mean.segment<2>(motion::kU).norm();
    if (now > speed) part.mean.segment<2>(motion::kU) *= speed / now;
    part.mean[motion::kW] = std::clamp(part.mean[motion::kW], -yaw_rate, yaw_rate);
  }
}

}  // namespace

MotionFilter::MotionFilter(const MotionFilterConfig& config) : config_(config) {
  if (const std::string wrong = check(config); !wrong.empty()) throw std::invalid_argument(wrong);
  bank_ = motion::model_bank(config);
  ahead_ = motion::bank_ahead(config);
}

void MotionFilter::reset() {
  records_.clear();
}

void MotionFilter::forget_camera(std::size_t camera) {
  if (records_.empty()) return;
  auto changed = std::make_shared<Record>(*records_.back());
  changed->after.cameras.forget_camera(camera);
  records_.back() = std::move(changed);
}

// ---- Events --------------------------------------------------------------------------------------------

FilterStep MotionFilter::update(Time captured, const std::optional<Observation>& observation) {
  Event event{.at = captured, .observation = {}, .velocity = {}};
  if (observation && motion::usable(*observation)) {
    event.observation = observation;
    event.observation->captured = captured;
  }
  const auto place = take(std::move(event));
  return step(place && records_[*place]->after.accepted);
}

bool MotionFilter::odometry(const BodyVelocity& velocity) {
  if (!motion::usable(velocity)) return false;
  const auto place = take({.at = velocity.at, .observation = {}, .velocity = velocity});
  return place && records_[*place]->after.accepted;
}

std::optional<std::size_t> MotionFilter::take(Event event) {
  if (!records_.empty() && event.at < records_.back()->event.at - from_seconds(config_.smoothing_lag_s))
    return std::nullopt;
  // Of one instant: odometry, then frames by camera, however they came. An empty frame says nothing beside
  // another.
  const auto earlier = [](const Event& a, const Event& b) {
    const auto rank = [](const Event& e) { return e.observation ? e.observation->camera + 1 : 0; };
    if (a.at != b.at) return a.at < b.at;
    if (a.velocity.has_value() != b.velocity.has_value()) return a.velocity.has_value();
    return rank(a) < rank(b);
  };
  auto after =
      std::upper_bound(records_.begin(), records_.end(), event,
                       [&](const Event& e, const auto& record) { return earlier(e, record->event); });
  if (!event.velocity) {
    if (!event.observation && after != records_.end() && (*after)->event.at == event.at) return std::nullopt;
    if (after != records_.begin()) {
      const Event& other = (*std::prev(after))->event;
      const bool beside = other.at == event.at && !other.velocity;
      if (beside && !event.observation) return std::nullopt;
      if (beside && !other.observation) after = records_.erase(std::prev(after));
    }
  }
  const auto place = static_cast<std::size_t>(after - records_.begin());
  records_.insert(after, nullptr);
  for (std::size_t i = place; i < records_.size(); ++i) {
    auto record = std::make_shared<Record>();
    record->event = i == place ? std::move(event) : records_[i]->event;
    record->after = run(record->event, i);
    records_[i] = std::move(record);
  }
  const std::size_t from_the_end = records_.size() - place;
  forget_old();
  if (from_the_end > records_.size()) return std::nullopt;
  return records_.size() - from_the_end;
}

/// How far back smoothed estimates reach: beyond the lag, so that they may be asked for now and then.
Time MotionFilter::smoothed_since() const {
  return records_.back()->event.at - from_seconds(1.5 * config_.smoothing_lag_s);
}

/// Kept: what a late event may need before it, and the snapshot before that.
void MotionFilter::forget_old() {
  const Time oldest = smoothed_since() - from_seconds(config_.entry_s + 2.0 * motion::kGapAfter);
  auto keep = std::upper_bound(records_.begin(), records_.end(), oldest,
                               [](Time at, const auto& record) { return at < record->event.at; });
  if (keep != records_.begin()) --keep;
  records_.erase(records_.begin(), keep);
}

MotionFilter::Track MotionFilter::run(const Event& event, std::size_t before) const {
  Track track;
  if (before > 0) {
    const Record& last = *records_[before - 1];
    track = last.after;
    track.accepted = track.restarted = track.took_gap = false;
    track.offset.setZero();
    track.spread.setZero();
    track.turned = 0.0;
    carry(track, last.event.at, event.at);
  }
  if (event.velocity) {
    take_velocity(track, *event.velocity);
  } else if (event.observation) {
    see(track, *event.observation);
    if (!track.accepted) miss(track, event.at, before);
  } else {
    miss(track, event.at, before);
  }
  return track;
}

/// Long unobserved, models switch as robots do.
const motion::ModelBank& MotionFilter::bank_for(Time last_accepted, Time to) const {
  return to_seconds(to - last_accepted) > kLongUnobserved ? ahead_ : bank_;
}

void MotionFilter::carry(Track& track, Time from, Time to) const {
  if (track.phase != Phase::calibrating && track.phase != Phase::running) return;
  track.cameras.carry(from, to);
  const double dt = to_seconds(to - from);
  const motion::ModelBank& bank = bank_for(track.last_accepted, to);
  track.main = motion::predict(bank, track.main, dt);
  if (track.gap) track.gap = std::make_shared<const Mixture>(motion::predict(bank, *track.gap, dt));
}

// ---- Observations --------------------------------------------------------------------------------------

void MotionFilter::see(Track& track, const Observation& observation) const {
  const bool known = track.phase == Phase::calibrating || track.phase == Phase::running;
  // What is between two cameras is no noise of the detector's: one of them is judged.
  const bool judged = !known || track.cameras.is_reference(observation.camera);
  if (judged) track.noise.see(observation);
  track.scale = track.noise.scale(config_.max_noise_scale);
  if (!known) {
    begin(track, observation);
  } else {
    see_tracked(track, observation);
  }
}

void MotionFilter::begin(Track& track, const Observation& observation) const {
  const LinearMeasurement seen = motion::pose_measurement(observation, track.scale);
  Gaussian6 start;
  start.mean << seen.value, 0.0, 0.0, 0.0;
  start.cov.setZero();
  start.cov.topLeftCorner<3, 3>() = seen.noise;
  const double speed = std::min(kUsualSpeed, config_.max_speed_mps);
  const double turning = std::min(kUsualYawRate, config_.max_yaw_rate_radps);
  start.cov.diagonal().tail<3>() << speed * speed, 1e-4, turning * turning;
  if (config_.holonomic) start.cov(motion::kS, motion::kS) = speed * speed;
  track.main.part.fill(start);
  Gaussian6 fast = start;
  const double half = 0.5 * config_.max_speed_mps;
  fast.cov.diagonal().tail<3>() << half * half, config_.holonomic ? half * half : 1e-4,
      0.25 * config_.max_yaw_rate_radps * config_.max_yaw_rate_radps;
  track.main.part[motion::kManoeuvring] = fast;
  fast.cov(motion::kS, motion::kS) = half * half;
  track.main.part[motion::kSideways] = fast;
  track.main.weight = {0.25, 0.3, 0.3, 0.12, 0.03};
  track.gap.reset();
  track.phase = config_.calibration_observations > 1 ? Phase::calibrating : Phase::running;
  track.last_accepted = observation.captured;
  track.accepted_count = 1;
  track.turns = std::max(1, observation.heading_turns);
  track.accepted = track.restarted = true;
  track.candidate = {};
  track.cameras.begin(observation);
  track.offset.setZero();
  track.spread.setZero();
}

void MotionFilter::see_tracked(Track& track, const Observation& observation) const {
  const LinearMeasurement told = motion::pose_measurement(observation, track.scale);
  const Gaussian6 expected = motion::collapse(track.main);
  motion::CameraPart& part = track.cameras.meet(observation, expected.mean.head<2>());
  track.offset = part.offset;
  track.spread = part.spread;
  const LinearMeasurement seen = motion::CameraOffsets::corrected(part, told);
  const int turns = std::max(1, observation.heading_turns);
  if (turns < track.turns) turn_to(track, seen.value[2] - expected.mean[motion::kYaw], seen.yaw_period);
  const Mixture* best = &track.main;
  motion::Innovation innovation = motion::innovation(track.main, seen);
  if (track.gap) {
    const motion::Innovation other = motion::innovation(*track.gap, seen);
    if (other.log_density > innovation.log_density) {
      best = track.gap.get();
      innovation = other;
    }
  }
  const Gaussian6 before = motion::collapse(*best);
  Mixture corrected = *best;
  if (!(innovation.distance2 <= config_.gate) || !motion::correct(corrected, seen)) {
    if (track.turned != 0.0) {
      motion::turn(track.main, -track.turned);
      track.gap.reset();
      track.turned = 0.0;
    }
    motion::CameraOffsets::refused(part, told, before);
    refuse(track, observation);
    return;
  }
  track.cameras.accepted(part, told, before, observation.captured);
  track.took_gap = best != &track.main;
  track.main = corrected;
  limit(track.main, config_.max_speed_mps, config_.max_yaw_rate_radps);
  track.gap.reset();
  track.turns = std::min(track.turns, turns);
  track.accepted = true;
  track.last_accepted = observation.captured;
  track.candidate = {};
  ++track.accepted_count;
  if (track.accepted_count >= config_.calibration_observations) track.phase = Phase::running;
}

/// Now it is known better which way is forward: turned to the nearest of the headings that looked alike.
void MotionFilter::turn_to(Track& track, double ahead, double period) const {
  const double one = kTwoPi / track.turns;
  track.turned = std::round(std::remainder(ahead, period) / one) * one;
  if (track.turned == 0.0) return;
  motion::turn(track.main, track.turned);
  if (!track.gap) return;
  Mixture turned = *track.gap;
  motion::turn(turned, track.turned);
  track.gap = std::make_shared<const Mixture>(turned);
}

void MotionFilter::refuse(Track& track, const Observation& observation) const {
  Candidate& candidate = track.candidate;
  bool agrees = candidate.count > 0;
  if (agrees) {
    const double dt = std::abs(to_seconds(observation.captured - candidate.last.captured));
    Covariance3 noise = observation.covariance + candidate.last.covariance;
    if (observation.camera != candidate.last.camera)
      noise += observation.correlated + candidate.last.correlated;
    const double reach = config_.max_speed_mps * dt + 4.0 * std::sqrt(noise(0, 0) + noise(1, 1));
    agrees = (observation.pose.position() - candidate.last.pose.position()).norm() <= reach;
  }
  candidate.count = agrees ? candidate.count + 1 : 1;
  candidate.last = observation;
  const bool calibrating = track.phase == Phase::calibrating;
  if (candidate.count < (calibrating ? 2 : config_.reacquire_observations)) return;
  const int count = candidate.count;
  begin(track, observation);
  if (calibrating) return;
  track.accepted_count = count;
  if (count >= config_.calibration_observations) track.phase = Phase::running;
}

// ---- Gaps ----------------------------------------------------------------------------------------------

void MotionFilter::miss(Track& track, Time at, std::size_t before) const {
  if (track.phase != Phase::calibrating && track.phase != Phase::running) return;
  const double gap = to_seconds(at - track.last_accepted);
  if (!track.gap && gap >= motion::kGapAfter && track.phase == Phase::running)
    track.gap = judged_again(track.last_accepted, at, before);
  const Gaussian6 now = motion::collapse(track.gap ? *track.gap : track.main);
  if (gap <= config_.max_gap_s && largest_sigma(now) <= config_.max_sigma_m) return;
  track.phase = track.phase == Phase::running ? Phase::lost : Phase::searching;
  track.gap.reset();
  track.candidate = {};
}

/// The mixture at `at` if the last entry_s before the last accepted observation were of a robot that was
/// being covered; none where the detector is so coarse that this makes no difference, or the track too young.
std::shared_ptr<const Mixture> MotionFilter::judged_again(Time last_accepted, Time at,
                                                          std::size_t before) const {
  if (config_.entry_bias_m <= 0.0 || config_.entry_s <= 0.0) return nullptr;
  const Time entry = last_accepted - from_seconds(config_.entry_s);
  std::size_t first = before;
  std::size_t seen = 0;
  while (first > 0 && records_[first - 1]->event.at > entry) {
    --first;
    const Record& record = *records_[first];
    if (record.after.restarted) return nullptr;
    if (record.event.observation && record.after.accepted) {
      ++seen;
      if (record.event.observation->covariance(0, 0) > config_.entry_bias_m * config_.entry_bias_m)
        return nullptr;
    }
  }
  if (first == 0 || seen == 0) return nullptr;
  const Record* last = records_[first - 1].get();
  if (last->after.phase != Phase::running) return nullptr;
  Mixture mixture = last->after.main;
  for (std::size_t i = first; i < before; ++i) {
    const Record& record = *records_[i];
    mixture = motion::predict(bank_, mixture, to_seconds(record.event.at - last->event.at));
    last = &record;
    if (!record.after.accepted) continue;
    if (record.event.velocity) {
      motion::correct(mixture, motion::velocity_measurement(*record.event.velocity, motion::kOdometryMemory));
      continue;
    }
    LinearMeasurement measured = pose_as_used(record);
    const double ramp = to_seconds(record.event.at - entry) / config_.entry_s;
    const double bias = ramp * config_.entry_bias_m;
    // Errors that stay together do not average: each weighs as one of `seen`.
    measured.noise.topLeftCorner<2, 2>().diagonal().array() += bias * bias * static_cast<double>(seen);
    measured.noise(2, 2) += 9.0 * bias * bias * static_cast<double>(seen);
    motion::correct(mixture, measured);
  }
  return std::make_shared<const Mixture>(motion::predict(bank_, mixture, to_seconds(at - last->event.at)));
}

void MotionFilter::take_velocity(Track& track, const BodyVelocity& velocity) const {
  if (track.phase != Phase::calibrating && track.phase != Phase::running) return;
  const double since =
      track.last_odometry ? to_seconds(velocity.at - *track.last_odometry) : motion::kOdometryMemory;
  track.last_odometry = velocity.at;
  const LinearMeasurement said = motion::velocity_measurement(velocity, since);
  if (motion::innovation(track.main, said).distance2 <= config_.gate)
    track.accepted = motion::correct(track.main, said);
  if (track.gap && motion::innovation(*track.gap, said).distance2 <= config_.gate) {
    Mixture corrected = *track.gap;
    track.accepted = motion::correct(corrected, said) || track.accepted;
    track.gap = std::make_shared<const Mixture>(corrected);
  }
}

}  // namespace skylight
