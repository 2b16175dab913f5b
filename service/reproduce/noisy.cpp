#include "service/reproduce/noisy.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "service/evaluation/random.hpp"
#include "service/reproduce/paper_frames.hpp"

namespace skylight::service::reproduce {
namespace {

std::optional<Observation> look(const ObservedFrame& frame, const WhiteNoise& noise, Random& random) {
  const bool missed = random.uniform() < noise.missed;
  const Eigen::Vector2d off = noise.sigma_m * random.normal2();
  const double turned = noise.sigma_rad * random.normal();
  if (missed || !frame.in_view) return std::nullopt;
  Observation seen;
  seen.captured = frame.captured;
  seen.pose = {frame.truth.x + off.x(), frame.truth.y + off.y(), wrap_angle(frame.truth.yaw + turned)};
  const double place = noise.sigma_m * noise.sigma_m;
  seen.covariance = Eigen::Vector3d(place, place, noise.sigma_rad * noise.sigma_rad).asDiagonal();
  return seen;
}

ObservedRun noisy(const ObservedRun& run, double rate_hz, const WhiteNoise& noise) {
  const double step = run.frame_rate_hz / rate_hz;
  const auto each = static_cast<std::size_t>(std::lround(step));
  if (each == 0 || std::abs(step - static_cast<double>(each)) > 1e-9)
    throw std::invalid_argument("a rate of " + std::to_string(rate_hz) + " Hz does not divide that of " +
                                run.route);
  ObservedRun out = run;
  out.frame_rate_hz = rate_hz;
  out.variants = {"noisy"};
  out.frames.clear();
  Random random(run.seed);
  for (std::size_t i = 0; i < run.frames.size(); i += each) {
    out.frames.push_back(run.frames[i]);
    out.frames.back().seen = {look(run.frames[i], noise, random)};
  }
  return out;
}

/// The detected point and where it truly is, m from the point below the camera.
struct SeenPoint {
  Eigen::Vector2d seen, truth;
};

std::optional<SeenPoint> point(const ObservedFrame& frame, std::size_t variant, double reference_m) {
  const auto& seen = frame.seen.at(variant);
  if (!seen) return std::nullopt;
  return SeenPoint{point_of(seen->pose, reference_m), point_of(frame.truth, reference_m)};
}

}  // namespace

Runs noisy(const Runs& runs, double rate_hz, const WhiteNoise& noise) {
  Runs out;
  for (const ObservedRun& run : runs) out.push_back(noisy(run, rate_hz, noise));
  return out;
}

double depth_error(const Runs& runs, std::string_view variant) {
  const double reference = reference_of(variant);
  double along = 0.0;
  double squares = 0.0;
  for (const ObservedRun& run : runs) {
    const std::size_t v = variant_index(run, variant);
    for (const ObservedFrame& frame : run.frames) {
      const auto p = point(frame, v, reference);
      if (!p) continue;
      along += (p->seen - p->truth).dot(p->truth);
      squares += p->truth.squaredNorm();
    }
  }
  return squares > 0.0 ? kPictureDepth * along / squares : 0.0;
}

Runs without_depth_error(Runs runs, std::string_view variant, double error_m) {
  const double reference = reference_of(variant);
  const double inwards = kPictureDepth / (kPictureDepth + error_m) - 1.0;
  for (ObservedRun& run : runs) {
    const std::size_t v = variant_index(run, variant);
    for (ObservedFrame& frame : run.frames) {
      const auto p = point(frame, v, reference);
      if (!p) continue;
      frame.seen[v]->pose.x += inwards * p->seen.x();
      frame.seen[v]->pose.y += inwards * p->seen.y();
    }
  }
  return runs;
}

}  // namespace skylight::service::reproduce
