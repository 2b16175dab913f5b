#include "sim/imager.hpp"

#include <algorithm>
#include <numbers>

#include "sim/camera/camera_model.hpp"
#include "sim/camera/depth.hpp"
#include "sim/camera/noise.hpp"

namespace skylight::sim {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

bool is_fixed(const Stage& stage, std::size_t actor) {
  const auto one = stage.actor(actor);
  return one.kind == ActorKind::thing && !stage.things()[one.index].pushable;
}

PoseAt poses_around(const Stage& stage, Duration middle) {
  return [&stage, middle](std::size_t actor, double since_midpoint) -> std::optional<Pose2> {
    const BodyState state = stage.timeline().at(actor, middle + from_seconds(since_midpoint));
    if (!state.present) return std::nullopt;
    return state.pose;
  };
}

}  // namespace

Imager::Imager(const Scenario& scenario, std::size_t camera, const FloorTexture& floor)
    : spec_(scenario.cameras.at(camera)),
      seed_(scenario.seed),
      index_(camera),
      start_(from_seconds(scenario.start_unix_s)),
      renderer_(scenario, spec_, floor),
      exposure_(spec_, scenario.light.flicker),
      delivery_(spec_, scenario.seed, camera) {}

Duration Imager::next_middle() const {
  const Duration begin =
      from_seconds(spec_.first_frame_s) + from_seconds(static_cast<double>(sequence_) / spec_.frame_rate_hz);
  return begin + reach();
}

Duration Imager::reach() const {
  const double readout = spec_.shutter == Shutter::rolling ? spec_.readout_s : 0.0;
  return from_seconds(0.5 * (spec_.exposure_s + readout));
}

void Imager::bump(const BumpAction& action) {
  const auto turn = [&](std::size_t i, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(action.by_deg[i] * kRadians, axis);
  };
  Eigen::Isometry3d pose = renderer_.camera().map_from_camera();
  pose.linear() = (turn(2, Eigen::Vector3d::UnitZ()) * turn(1, Eigen::Vector3d::UnitY()) *
                   turn(0, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix() *
                  pose.linear();
  pose.translation() += 1e-3 * Eigen::Vector3d(action.by_mm[0], action.by_mm[1], action.by_mm[2]);
  renderer_.move_camera(pose);
}

void Imager::freeze(const FreezeAction& action, Duration at) {
  frozen_.push_back({at, at + from_seconds(action.for_s)});
}

void Imager::black_out(const BlackoutAction& action, Duration at) {
  black_.push_back({at, at + from_seconds(action.for_s)});
}

std::optional<Shot> Imager::shoot(const Stage& stage, const Lighting& lighting, Cast& cast) {
  const Duration middle = next_middle();
  const std::uint64_t sequence = sequence_++;
  const Delivered delivered = delivery_.deliver(sequence, middle);
  const auto now = [middle](const Interval& interval) { return interval.holds(middle); };
  if (delivered.lost || std::any_of(black_.begin(), black_.end(), now)) return std::nullopt;

  Shot shot;
  shot.frame.camera = index_;
  shot.frame.sequence = sequence;
  dress(stage, cast, middle);
  if (!last_.image.empty() && std::any_of(frozen_.begin(), frozen_.end(), now)) {
    shot.frame.image = last_.image.clone();
    shot.frame.depth = last_.depth.clone();
  } else {
    draw(stage, lighting, middle, shot.frame);
    last_ = {.image = shot.frame.image, .depth = shot.frame.depth};  // whoever gets the frame only reads it
  }
  shot.frame.captured = start_ + delivered.stamp;
  shot.delivered = start_ + delivered.at;
  for (std::size_t i = 0; i < stage.robots().size(); ++i)
    shot.truth.push_back(truth_of(stage, cast, i, middle));
  return shot;
}

/// Tells the renderer who came, went, or looks otherwise than before.
void Imager::dress(const Stage& stage, Cast& cast, Duration middle) {
  const std::size_t count = stage.actor_count();
  std::vector<std::shared_ptr<const Look>> looks;
  std::vector<bool> present;
  for (std::size_t i = 0; i < count; ++i) {
    looks.push_back(cast.look(stage, i, middle));
    present.push_back(!is_fixed(stage, i) || stage.timeline().at(i, middle).present);
  }
  if (looks.size() != looks_.size() || present != present_) {
    std::vector<SceneActor> actors;
    for (std::size_t i = 0; i < count; ++i) actors.push_back({looks[i], is_fixed(stage, i)});
    renderer_.set_actors(std::move(actors), poses_around(stage, middle));
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      if (looks[i] != looks_[i]) renderer_.set_look(i, looks[i]);
    }
  }
  looks_ = std::move(looks);
  present_ = std::move(present);
}

void Imager::draw(const Stage& stage, const Lighting& lighting, Duration middle, Frame& frame) {
  renderer_.set_passing_shadow(lighting.shadows(middle));
  renderer_.draw(poses_around(stage, middle));
  const auto rows = exposure_.rows(middle, [&](Duration time) { return lighting.level(time); });
  expose({renderer_.mean(), rows}, spec_.sensor, {seed_, index_, frame.sequence, false}, frame.image);
  exposure_.observe(frame.image, last_drawn_ ? middle - *last_drawn_ : Duration::zero());
  last_drawn_ = middle;
  if (spec_.delivery.jpeg_quality) compress(*spec_.delivery.jpeg_quality, frame.image);
  if (spec_.depth.enabled)
    measure_depth(renderer_.metres(), spec_, {seed_, index_, frame.sequence, true}, frame.depth);
}

RobotTruth Imager::truth_of(const Stage& stage, const Cast& cast, std::size_t robot, Duration middle) const {
  const Duration at = middle + from_seconds(renderer_.row_offset(robot));
  const BodyState state = stage.timeline().at(robot, at);
  RobotTruth truth{.id = stage.robots()[robot].id,
                   .at = start_ + at,
                   .pose = state.pose,
                   .velocity = state.velocity,
                   .present = state.present,
                   .in_view = false,
                   .visible = state.present ? renderer_.visible(robot) : 0.0,
                   .touches = stage.touches(robot, at)};
  if (!state.present) return truth;
  const RobotPicture& picture = cast.picture(robot);
  const Eigen::Vector2d top =
      state.pose.position() - Eigen::Rotation2Dd(state.pose.yaw) * picture.reference_point_m;
  const auto pixel = renderer_.camera().project_map({top.x(), top.y(), picture.surface_height_m});
  truth.in_view = pixel && renderer_.camera().contains(*pixel);
  return truth;
}

}  // namespace skylight::sim
