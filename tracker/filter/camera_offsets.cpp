#include "tracker/filter/camera_offsets.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace skylight::motion {
namespace {

/// No calibration is finer than this, m and rad: weights of cameras that are known exactly are equal.
constexpr double kFinest = 5e-5;
constexpr double kContributes = 0.01;  // of the weight
constexpr std::size_t kNobody = ~std::size_t{0};
constexpr int kOutliers = 3;  // refused in a row that are no chance

Eigen::Matrix3d inverse(const Covariance3& covariance) {
  return (covariance + kFinest * kFinest * Eigen::Matrix3d::Identity()).inverse();
}

Covariance3 symmetric(const Covariance3& m) {
  return 0.5 * (m + m.transpose());
}

/// Of what is measured from what is expected, the yaw the shorter way.
Eigen::Vector3d difference(const LinearMeasurement& measured, const Vector6& mean) {
  Eigen::Vector3d off = measured.value - mean.head<3>();
  if (measured.yaw_period > 0.0) off[2] = std::remainder(off[2], measured.yaw_period);
  return off;
}

}  // namespace

void CameraOffsets::begin(const Observation& observation) {
  count_ = 1;
  reference_ = 0;
  parts_[0] = {.camera = observation.camera,
               .seen = observation.captured,
               .heard = observation.captured,
               .correlated = observation.correlated,
               .weight = Eigen::Matrix3d::Identity()};
  place_ = observation.pose.position();
}

bool CameraOffsets::present(const CameraPart& part, Time now) const {
  return part.refused < kOutliers && to_seconds(now - part.seen) <= kAlone;
}

// Where no camera sees the robot, all stays as it is.
void CameraOffsets::carry(Time from, Time to) {
  if (count_ < 2) return;
  const double share = 1.0 - std::exp(-to_seconds(to - from) / kGlide);
  std::array<Eigen::Matrix3d, kMost> aim;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  bool any = false;
  for (std::size_t i = 0; i < count_; ++i) {
    const bool counts = present(parts_[i], from);
    any = any || counts;
    aim[i] = counts ? inverse(parts_[i].correlated + parts_[i].spread) : Eigen::Matrix3d::Zero().eval();
    sum += aim[i];
  }
  if (!any) return;
  const Eigen::Matrix3d whole = sum.inverse();
  for (std::size_t i = 0; i < count_; ++i) parts_[i].weight += share * (whole * aim[i] - parts_[i].weight);
  choose_reference(to);
  forget(to);
}

// One that is gone ties nothing down: the one that is known best among those that are there does.
void CameraOffsets::choose_reference(Time now) {
  if (present(parts_[reference_], now)) return;
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < count_; ++i) {
    if (!present(parts_[i], now)) continue;
    if (!best || parts_[i].spread.trace() < parts_[*best].spread.trace()) best = i;
  }
  if (!best) return;
  const Covariance3 before = parts_[*best].spread;
  for (std::size_t i = 0; i < count_; ++i) parts_[i].spread += before;
  parts_[*best].spread.setZero();
  reference_ = *best;
}

void CameraOffsets::forget(Time now) {
  for (std::size_t i = count_; i-- > 0;) {
    if (i == reference_ || to_seconds(now - parts_[i].heard) <= kForget) continue;
    --count_;
    if (reference_ == count_) reference_ = i;
    std::swap(parts_[i], parts_[count_]);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < count_; ++k) sum += parts_[k].weight;
    const Eigen::Matrix3d whole = sum.inverse();
    for (std::size_t k = 0; k < count_; ++k) parts_[k].weight = (whole * parts_[k].weight).eval();
  }
}

CameraPart& CameraOffsets::meet(const Observation& observation, const Eigen::Vector2d& place) {
  const double moved = (place - place_).norm();
  place_ = place;
  const double share = std::min(1.0, moved / kReach);
  for (std::size_t i = 0; i < count_ && count_ > 1; ++i) {
    if (i == reference_) continue;
    parts_[i].spread += share * (parts_[i].correlated + parts_[reference_].correlated);
  }
  CameraPart& part = part_of(observation.camera);
  part.heard = observation.captured;
  part.correlated = observation.correlated;
  if (part.seen == Time{}) {
    part.offset = shift();
    part.spread = symmetric(correlated() + observation.correlated);
  }
  return part;
}

CameraPart& CameraOffsets::part_of(std::size_t camera) {
  const auto end = parts_.begin() + static_cast<std::ptrdiff_t>(count_);
  auto part =
      std::find_if(parts_.begin(), end, [&](const CameraPart& each) { return each.camera == camera; });
  if (part != end) return *part;
  if (count_ < kMost) {
    ++count_;
  } else {
    part = std::min_element(parts_.begin(), end, [&](const CameraPart& a, const CameraPart& b) {
      return is_reference(a.camera) != is_reference(b.camera) ? is_reference(b.camera) : a.heard < b.heard;
    });
  }
  *part = {.camera = camera};
  return *part;
}

LinearMeasurement CameraOffsets::corrected(const CameraPart& part, LinearMeasurement measured) {
  measured.value -= part.offset;
  measured.noise += part.spread;
  return measured;
}

void CameraOffsets::accepted(CameraPart& part, const LinearMeasurement& measured, const Gaussian6& predicted,
                             Time at) {
  const bool first = part.seen == Time{};
  part.seen = at;
  part.refused = 0;
  if (is_reference(part.camera) || part.spread.isZero(0.0)) return;
  LinearMeasurement own = measured;
  own.value -= part.offset;
  const Eigen::Vector3d innovation = difference(own, predicted.mean);
  const Covariance3 of_it = part.spread + predicted.cov.topLeftCorner<3, 3>() + measured.noise;
  const Eigen::Matrix3d gain = part.spread * of_it.inverse();
  part.offset += gain * innovation;
  const Eigen::Matrix3d left = Eigen::Matrix3d::Identity() - gain;
  part.spread =
      symmetric(left * part.spread * left.transpose() + gain * (of_it - part.spread) * gain.transpose());
  if (first) take_over(part);
}

// What a camera said by its old calibration is worth nothing once it speaks by the new one.
void CameraOffsets::take_over(CameraPart& part) {
  for (std::size_t i = 0; i < count_; ++i) {
    if (parts_[i].camera != kNobody) continue;
    part.weight += parts_[i].weight;
    parts_[i].weight.setZero();
    parts_[i].seen = Time{};
  }
}

void CameraOffsets::refused(CameraPart& part, const LinearMeasurement& measured, const Gaussian6& predicted) {
  ++part.refused;
  part.said = difference(measured, predicted.mean);
}

void CameraOffsets::forget_camera(std::size_t camera) {
  for (std::size_t i = 0; i < count_; ++i) {
    if (parts_[i].camera == camera) parts_[i].camera = kNobody;
  }
}

Eigen::Vector3d CameraOffsets::shift() const {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  if (count_ < 2) return parts_[0].offset;
  for (const CameraPart& part : parts()) out += part.weight * part.offset;
  return out;
}

Covariance3 CameraOffsets::correlated() const {
  if (count_ < 2) return parts_[0].correlated;
  Covariance3 out = Covariance3::Zero();
  for (const CameraPart& part : parts())
    out += part.weight * (part.correlated + part.spread) * part.weight.transpose();
  return symmetric(out);
}

CameraSet CameraOffsets::contributing() const {
  CameraSet out = 0;
  for (const CameraPart& part : parts()) {
    if (part.camera != kNobody && part.weight.topLeftCorner<2, 2>().trace() >= 2.0 * kContributes)
      out |= camera_bit(part.camera);
  }
  return out;
}

std::vector<CameraOpinion> CameraOffsets::opinions(Time now) const {
  std::vector<CameraOpinion> out;
  for (const CameraPart& part : parts()) {
    if (part.camera == kNobody || to_seconds(now - part.heard) > kAlone) continue;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
    for (const CameraPart& other : parts()) {
      if (&other == &part || !present(other, now)) continue;
      const Eigen::Matrix3d weight = inverse(other.correlated + other.spread);
      sum += weight;
      weighted += weight * other.offset;
    }
    CameraOpinion opinion{.camera = part.camera, .refused = part.refused};
    if (!sum.isZero(0.0)) {
      const Covariance3 of_others = sum.inverse();
      const Eigen::Vector3d off = (part.refused > 0 ? part.said : part.offset) - of_others * weighted;
      const Covariance3 expected = of_others + inverse(part.correlated + part.spread).inverse();
      opinion.off_m = off.head<2>();
      opinion.sigmas = std::sqrt(off.head<2>().dot(expected.topLeftCorner<2, 2>().inverse() * off.head<2>()));
    }
    out.push_back(opinion);
  }
  return out;
}

}  // namespace skylight::motion
