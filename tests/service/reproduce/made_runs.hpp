// Observed runs made by hand, so that what comes out of them can be worked out on paper.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "service/reproduce/paper_frames.hpp"
#include "service/reproduce/replay.hpp"

namespace skylight::service::reproduce::test {

/// Frame i of a run at `rate_hz`.
inline Time at(int i, double rate_hz = 10.0) {
  return Time{from_seconds(1000.0 + i / rate_hz)};
}

inline ObservedRun empty_run(const std::string& route, std::uint64_t seed = 1) {
  return {.route = route,
          .seed = seed,
          .frame_rate_hz = 10.0,
          .width_px = 100,
          .height_px = 100,
          .variants = {"vertical", "ray"}};
}

/// An observation of base_link.
inline std::optional<Observation> seen(int i, const Pose2& pose) {
  Observation out;
  out.captured = at(i);
  out.pose = pose;
  out.covariance = Covariance3::Identity() * 1e-4;
  return out;
}

/// Adds a frame; an observation that is not given was not made.
inline void add(ObservedRun& run, const Pose2& truth, const std::optional<Pose2>& vertical,
                const std::optional<Pose2>& ray) {
  const int i = static_cast<int>(run.frames.size());
  const auto made = [&](const std::optional<Pose2>& pose) { return pose ? seen(i, *pose) : std::nullopt; };
  run.frames.push_back({at(i), truth, true, 1.0, {made(vertical), made(ray)}});
}

/// Gives back what it sees, `off` metres to the left of base_link, once it has seen `after` frames.
class Echo final : public Filter {
 public:
  explicit Echo(double off = 0.0, int after = 0) : off_(off), after_(after) {}
  FilterStep update(Time captured, const std::optional<Observation>& observation) override {
    if (after_-- > 0 || !observation) return {};
    const Eigen::Vector2d at =
        observation->pose.position() + Eigen::Rotation2Dd(observation->pose.yaw) * Eigen::Vector2d(0, off_);
    FilterStep step;
    step.estimate = Estimate{.at = captured, .pose = {at.x(), at.y(), observation->pose.yaw}};
    return step;
  }
  bool odometry(const BodyVelocity&) override { return false; }
  std::optional<Estimate> predict(Time) const override { return std::nullopt; }
  Duration smoothing_lag() const override { return {}; }
  std::optional<Estimate> smoothed(Time) const override { return std::nullopt; }
  std::vector<Estimate> smoothed_from(Time) const override { return {}; }
  void reset() override {}
  std::unique_ptr<Filter> clone() const override { return std::make_unique<Echo>(*this); }

 private:
  double off_;
  int after_;
};

inline Filtering echo(double off = 0.0, int after = 0) {
  return {.make = [off, after] { return std::make_unique<Echo>(off, after); }};
}

}  // namespace skylight::service::reproduce::test
