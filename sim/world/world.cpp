#include "sim/world/world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <box2d/box2d.h>

#include "sim/world/wheels.hpp"

namespace skylight::sim {
namespace {

constexpr double kGravity = 9.81;
constexpr double kWallThickness = 0.5;
constexpr double kDt = std::chrono::duration<double>(World::kStep).count();
constexpr float kBodyFriction = 0.3F;  ///< plastic against plastic or a wall
/// Box2D's floats may stray so far from the exact sums (plus rounding) before they are put right.
constexpr double kStray = 2e-6;
constexpr double kFloatRounding = 2.4e-7;

b2Vec2 to_b2(const Eigen::Vector2d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y())};
}
Eigen::Vector2d from_b2(const b2Vec2& v) {
  return {v.x, v.y};
}

/// Polygons touch through a skin of b2_polygonRadius each; drawn in by it, bodies meet at their true outline.
b2PolygonShape rectangle(const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
  const Eigen::Vector2d half = 0.5 * (max - min) - Eigen::Vector2d::Constant(b2_polygonRadius);
  b2PolygonShape shape;
  shape.SetAsBox(static_cast<float>(std::max(1e-3, half.x())), static_cast<float>(std::max(1e-3, half.y())),
                 to_b2(0.5 * (min + max)), 0.0F);
  return shape;
}
b2CircleShape circle(double radius) {
  b2CircleShape shape;
  shape.m_radius = static_cast<float>(radius);
  return shape;
}

/// Mean distance of a rectangle's points from its middle: the lever of its friction against turning. Integral
/// of sqrt(x^2 + y^2) over |x| <= a, |y| <= b, over 4 a b.
double mean_distance(double a, double b) {
  const double d = std::hypot(a, b);
  return d / 3.0 + a * a / (6.0 * b) * std::log((b + d) / a) + b * b / (6.0 * a) * std::log((a + d) / b);
}

/// A body's centre of mass and angle, summed in double: at a step of 2 ms floats would lose up to a
/// thousandth of a slow motion to rounding.
struct Exact {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double angle = 0.0;
};

struct Body {
  ActorKind kind = ActorKind::thing;
  b2Body* body = nullptr;  ///< none of what hangs above everything
  Exact exact;
  bool present = true;
  bool put_next = false;  ///< put down since the last step
  bool placed = false;    ///< put down before the last step
  double yaw_rate = 0.0;  ///< of a person

  bool moves_freely() const { return body != nullptr && body->GetType() == b2_dynamicBody; }
};

struct Drive {
  const RobotModel* model = nullptr;
  Wheels wheels;
  BodyMotion motors = BodyMotion::Zero();  ///< the motion that the wheels make for; they turn accordingly
  double grip = 1.0;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();  ///< velocity of the centre of mass as the tyres left it
  double spin_before = 0.0;
  Eigen::Vector2d shoved = Eigen::Vector2d::Zero();  ///< what collisions made of it in the last step
  double shoved_spin = 0.0;
};

}  // namespace

struct World::Impl {
  explicit Impl(const RoomSpec& room);
  void add_walls();
  b2Body* make_body(const Pose2& pose, b2BodyType type);
  std::size_t add(Body actor, const Pose2& pose);
  void add_robot(const RobotSpec& spec);
  void add_pushable(b2Body& body, const ObjectSpec& thing) const;
  double floor_factor(const Eigen::Vector2d& at) const;
  void run_motors(Drive& drive, const Command& command) const;
  void push_tyres(Drive& drive, b2Body& body) const;
  void note_shoves(Drive& drive, const b2Body& body) const;
  void sum_exactly(Body& actor, const Exact& before) const;
  void note_touches();
  Pose2 pose(const Body& actor) const;

  b2World b2{b2Vec2(0.0F, 0.0F)};
  RoomSpec room;
  b2Body* walls = nullptr;
  std::vector<Body> actors;
  std::vector<Drive> drives;  ///< of the robots, the first actors
  double tallest = 0.0;       ///< robot
  std::vector<Touch> touches;
};

World::Impl::Impl(const RoomSpec& room_in) : room(room_in) {
  add_walls();
}

void World::Impl::add_walls() {
  const b2BodyDef definition;
  walls = b2.CreateBody(&definition);
  const Eigen::Vector2d half(0.5 * room.size_m[0], 0.5 * room.size_m[1]);
  const double t = kWallThickness;
  const auto wall = [&](const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
    const b2PolygonShape shape = rectangle(min, max);
    walls->CreateFixture(&shape, 0.0F);
  };
  wall({-half.x() - t, -half.y() - t}, {half.x() + t, -half.y()});
  wall({-half.x() - t, half.y()}, {half.x() + t, half.y() + t});
  wall({-half.x() - t, -half.y()}, {-half.x(), half.y()});
  wall({half.x(), -half.y()}, {half.x() + t, half.y()});
}

b2Body* World::Impl::make_body(const Pose2& pose, b2BodyType type) {
  b2BodyDef definition;
  definition.type = type;
  definition.position = to_b2(pose.position());
  definition.angle = static_cast<float>(pose.yaw);
  definition.allowSleep = false;
  definition.userData.pointer = actors.size() + 1;  // 0: the walls
  return b2.CreateBody(&definition);
}

std::size_t World::Impl::add(Body actor, const Pose2& pose) {
  actor.exact = {pose.position(), pose.yaw};
  if (actor.body != nullptr) actor.exact.centre = from_b2(actor.body->GetWorldCenter());
  if (actor.moves_freely()) {
    const Eigen::Rotation2Dd turn(pose.yaw);
    actor.exact.centre = pose.position() + turn * from_b2(actor.body->GetLocalCenter());
  }
  actors.push_back(actor);
  return actors.size() - 1;
}

void World::Impl::add_robot(const RobotSpec& spec) {
  const RobotModel& model = robot_model(spec.model);
  const Pose2 start{spec.start.x_m, spec.start.y_m,
                    wrap_angle(spec.start.yaw_deg * std::numbers::pi / 180.0)};
  b2Body* body = make_body(start, b2_dynamicBody);
  const auto add_shape = [&](const b2Shape& shape) {
    b2FixtureDef fixture;
    fixture.shape = &shape;
    fixture.friction = kBodyFriction;
    fixture.density = 1.0F;  // replaced below: the mass is known
    body->CreateFixture(&fixture);
  };
  if (model.round_radius_m > 0.0) {
    add_shape(circle(model.round_radius_m));
  } else {
    for (const Rectangle& part : model.footprint) add_shape(rectangle(part.min, part.max));
  }
  b2MassData mass;
  mass.mass = static_cast<float>(model.mass_kg);
  mass.center.Set(static_cast<float>(model.centre_of_mass_x_m), 0.0F);
  mass.I = static_cast<float>(model.yaw_inertia_kgm2 + model.mass_kg * std::pow(model.centre_of_mass_x_m, 2));
  body->SetMassData(&mass);
  for (const Solid& solid : model.solids) tallest = std::max(tallest, solid.max.z());
  add({.kind = ActorKind::robot, .body = body}, start);
  drives.push_back({.model = &model, .wheels = Wheels(model)});
}

/// Mass, and the floor under it: a friction joint is solved together with the contacts, so that what pushes
/// with less than the friction moves nothing.
void World::Impl::add_pushable(b2Body& body, const ObjectSpec& thing) const {
  const double a = 0.5 * thing.size_m[0];
  const double b = 0.5 * thing.size_m[1];
  const bool box = thing.shape == BodyShape::box;
  b2MassData mass;
  mass.mass = static_cast<float>(thing.mass_kg);
  mass.center.SetZero();
  mass.I = static_cast<float>(thing.mass_kg * (box ? (a * a + b * b) / 3.0 : 0.5 * a * a));
  body.SetMassData(&mass);
  b2FrictionJointDef joint;
  joint.Initialize(walls, &body, body.GetWorldCenter());
  const double force = thing.friction * thing.mass_kg * kGravity;
  joint.maxForce = static_cast<float>(force);
  joint.maxTorque = static_cast<float>(force * (box ? mean_distance(a, b) : 2.0 / 3.0 * a));
  joint.collideConnected = true;
  body.GetWorld()->CreateJoint(&joint);
}

double World::Impl::floor_factor(const Eigen::Vector2d& at) const {
  const auto covers = [&](const FrictionZone& zone) {
    return at.x() >= zone.min_m[0] && at.x() <= zone.max_m[0] && at.y() >= zone.min_m[1] &&
           at.y() <= zone.max_m[1];
  };
  const auto& zones = room.floor.friction_zones;
  const auto last = std::find_if(zones.rbegin(), zones.rend(), covers);
  return last == zones.rend() ? room.floor.friction : last->friction;
}

void World::Impl::run_motors(Drive& drive, const Command& command) const {
  const RobotModel& m = *drive.model;
  const auto run = [&](double& motor, double to, double most, double acceleration) {
    motor += std::clamp(std::clamp(to, -most, most) - motor, -acceleration * kDt, acceleration * kDt);
  };
  run(drive.motors.x(), command.v_mps, m.max_speed_mps, m.max_acceleration_mps2);
  run(drive.motors.y(), command.side_mps, m.max_side_speed_mps, m.max_acceleration_mps2);
  run(drive.motors.z(), command.w_radps, m.max_yaw_rate_radps, m.max_yaw_acceleration_radps2);
}

/// The impulses at the wheels that would make the body roll without slip within this step, cut to what the
/// tyres can give. What pushed the body in the last step is taken to push on: a robot that is pushed with
/// less than its grip stands.
void World::Impl::push_tyres(Drive& drive, b2Body& body) const {
  const auto motion_of = [&](const Eigen::Vector2d& centre_velocity, double spin) {
    const Eigen::Vector2d local = from_b2(body.GetLocalVector(to_b2(centre_velocity)));
    return BodyMotion(local.x(), local.y() - spin * drive.model->centre_of_mass_x_m, spin);
  };
  const BodyMotion now =
      motion_of(from_b2(body.GetLinearVelocity()), static_cast<double>(body.GetAngularVelocity()));
  const BodyMotion change = drive.motors - now - motion_of(drive.shoved, drive.shoved_spin);
  const auto impulses = drive.wheels.impulses(change);
  const double load = drive.model->mass_kg * kGravity * drive.model->wheel_load / drive.wheels.count();
  for (int i = 0; i < drive.wheels.count(); ++i) {
    const b2Vec2 at = body.GetWorldPoint(to_b2(drive.wheels.place(i)));
    const double factor = floor_factor(from_b2(at)) * drive.grip;
    const Eigen::Vector2d impulse =
        drive.wheels.within_grip(impulses[static_cast<std::size_t>(i)], load * factor * kDt);
    body.ApplyLinearImpulse(body.GetWorldVector(to_b2(impulse)), at, true);
  }
  drive.before = from_b2(body.GetLinearVelocity());
  drive.spin_before = static_cast<double>(body.GetAngularVelocity());
}

void World::Impl::note_shoves(Drive& drive, const b2Body& body) const {
  drive.shoved = from_b2(body.GetLinearVelocity()) - drive.before;
  drive.shoved_spin = static_cast<double>(body.GetAngularVelocity()) - drive.spin_before;
}

/// Carries the exact sums on by what Box2D did, but for its rounding, and puts its floats right where they
/// have strayed. A float angle loses digits as it grows: it is kept small.
void World::Impl::sum_exactly(Body& actor, const Exact& before) const {
  b2Body& body = *actor.body;
  const auto moved = [](double from, double to, double velocity) {
    const double by = kDt * velocity;
    const double rest = to - from - by;
    return std::abs(rest) > kStray + kFloatRounding * std::abs(to) ? to - from : by;
  };
  const Eigen::Vector2d centre = from_b2(body.GetWorldCenter());
  const auto angle = static_cast<double>(body.GetAngle());
  const Eigen::Vector2d velocity = from_b2(body.GetLinearVelocity());
  actor.exact.centre.x() += moved(before.centre.x(), centre.x(), velocity.x());
  actor.exact.centre.y() += moved(before.centre.y(), centre.y(), velocity.y());
  actor.exact.angle += moved(before.angle, angle, static_cast<double>(body.GetAngularVelocity()));
  const double off = std::max((actor.exact.centre - centre).lpNorm<Eigen::Infinity>() -
                                  kFloatRounding * centre.lpNorm<Eigen::Infinity>(),
                              std::abs(actor.exact.angle - angle) - kFloatRounding * std::abs(angle));
  if (off <= kStray && std::abs(angle) < 4.0) return;
  actor.exact.angle = wrap_angle(actor.exact.angle);
  const Pose2 right = pose(actor);
  body.SetTransform(to_b2(right.position()), static_cast<float>(right.yaw));
}

void World::Impl::note_touches() {
  touches.clear();
  for (b2Contact* contact = b2.GetContactList(); contact != nullptr; contact = contact->GetNext()) {
    if (!contact->IsTouching()) continue;
    const auto actor = [](const b2Fixture* fixture) {
      const auto number = const_cast<b2Fixture*>(fixture)->GetBody()->GetUserData().pointer;
      return number == 0 ? kWall : static_cast<std::size_t>(number - 1);
    };
    const std::size_t a = actor(contact->GetFixtureA());
    const std::size_t b = actor(contact->GetFixtureB());
    touches.push_back({std::min(a, b), std::max(a, b)});
  }
  std::sort(touches.begin(), touches.end());
  touches.erase(std::unique(touches.begin(), touches.end()), touches.end());
}

Pose2 World::Impl::pose(const Body& actor) const {
  Eigen::Vector2d at = actor.exact.centre;
  if (actor.moves_freely())
    at -= Eigen::Rotation2Dd(actor.exact.angle) * from_b2(actor.body->GetLocalCenter());
  return {at.x(), at.y(), wrap_angle(actor.exact.angle)};
}

World::World(const RoomSpec& room, const std::vector<RobotSpec>& robots)
    : impl_(std::make_unique<Impl>(room)) {
  for (const RobotSpec& robot : robots) impl_->add_robot(robot);
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

std::size_t World::add_thing(const ObjectSpec& thing) {
  const Pose2 pose{thing.x_m, thing.y_m, wrap_angle(thing.yaw_deg * std::numbers::pi / 180.0)};
  Body actor;
  if (thing.bottom_m <= impl_->tallest) {
    actor.body = impl_->make_body(pose, thing.pushable ? b2_dynamicBody : b2_staticBody);
    const Eigen::Vector2d half(0.5 * thing.size_m[0], 0.5 * thing.size_m[1]);
    const b2PolygonShape box = rectangle(-half, half);
    const b2CircleShape round = circle(half.x());
    b2FixtureDef fixture;
    fixture.shape = thing.shape == BodyShape::box ? static_cast<const b2Shape*>(&box) : &round;
    fixture.friction = kBodyFriction;
    fixture.density = 1.0F;
    actor.body->CreateFixture(&fixture);
    if (thing.pushable) impl_->add_pushable(*actor.body, thing);
  }
  return impl_->add(actor, pose);
}

std::size_t World::add_person() {
  b2Body* body = impl_->make_body({}, b2_kinematicBody);
  const b2CircleShape feet = circle(kPersonRadius);
  body->CreateFixture(&feet, 0.0F);
  body->SetEnabled(false);
  return impl_->add({.kind = ActorKind::person, .body = body, .present = false}, {});
}

void World::step(const std::vector<Command>& commands) {
  Impl& my = *impl_;
  for (std::size_t i = 0; i < my.drives.size(); ++i) {
    const bool stands = my.actors[i].present;
    my.run_motors(my.drives[i], stands ? commands.at(i) : Command{});
    if (stands) my.push_tyres(my.drives[i], *my.actors[i].body);
  }
  std::vector<Exact> before;
  before.reserve(my.actors.size());
  for (const Body& actor : my.actors) {
    if (actor.body == nullptr) {
      before.emplace_back();
    } else {
      before.push_back({from_b2(actor.body->GetWorldCenter()), static_cast<double>(actor.body->GetAngle())});
    }
  }
  my.b2.Step(static_cast<float>(kDt), 12, 6);
  for (std::size_t i = 0; i < my.actors.size(); ++i) {
    Body& actor = my.actors[i];
    actor.placed = std::exchange(actor.put_next, false);
    if (!actor.present || !actor.moves_freely()) continue;
    if (i < my.drives.size()) my.note_shoves(my.drives[i], *actor.body);
    my.sum_exactly(actor, before[i]);
  }
  my.note_touches();
}

void World::walk(std::size_t person, const std::optional<Pose2>& to) {
  Body& actor = impl_->actors.at(person);
  if (!to) return take_away(person);
  if (!actor.present) put_down(person, *to);
  actor.yaw_rate = wrap_angle(to->yaw - actor.exact.angle) / to_seconds(kStep);
  actor.body->SetLinearVelocity(
      to_b2((to->position() - from_b2(actor.body->GetPosition())) / to_seconds(kStep)));
  actor.exact = {to->position(), to->yaw};
}

void World::take_away(std::size_t actor) {
  Body& body = impl_->actors.at(actor);
  body.present = false;
  if (body.body != nullptr) body.body->SetEnabled(false);
  if (actor < impl_->drives.size()) impl_->drives[actor].motors.setZero();
}

void World::put_down(std::size_t actor, const Pose2& pose) {
  Body& body = impl_->actors.at(actor);
  body.present = true;
  body.put_next = true;
  body.exact = {pose.position(), pose.yaw};
  if (actor < impl_->drives.size()) {
    Drive& drive = impl_->drives[actor];
    drive.motors.setZero();
    drive.shoved.setZero();
    drive.shoved_spin = 0.0;
  }
  if (body.body == nullptr) return;
  if (body.moves_freely())
    body.exact.centre += Eigen::Rotation2Dd(pose.yaw) * from_b2(body.body->GetLocalCenter());
  body.body->SetTransform(to_b2(pose.position()), static_cast<float>(pose.yaw));
  body.body->SetLinearVelocity({0.0F, 0.0F});
  body.body->SetAngularVelocity(0.0F);
  body.body->SetEnabled(true);
}

void World::set_grip(std::size_t robot, double factor) {
  impl_->drives.at(robot).grip = factor;
}

void World::push(std::size_t actor, const Eigen::Vector2d& impulse_ns) {
  Body& body = impl_->actors.at(actor);
  if (body.present && body.body != nullptr) body.body->ApplyLinearImpulseToCenter(to_b2(impulse_ns), true);
}

std::size_t World::robot_count() const {
  return impl_->drives.size();
}
std::size_t World::actor_count() const {
  return impl_->actors.size();
}

BodyState World::state(std::size_t actor) const {
  const Body& body = impl_->actors.at(actor);
  BodyState state{.pose = impl_->pose(body), .present = body.present, .placed = body.placed};
  if (body.body == nullptr || !body.present) return state;
  const b2Vec2 velocity = body.body->GetLinearVelocityFromLocalPoint(b2Vec2(0.0F, 0.0F));
  const double yaw_rate =
      body.kind == ActorKind::person ? body.yaw_rate : static_cast<double>(body.body->GetAngularVelocity());
  state.velocity = {velocity.x, velocity.y, yaw_rate};
  return state;
}

Eigen::Vector4d World::wheel_speeds(std::size_t robot) const {
  const Drive& drive = impl_->drives.at(robot);
  return drive.wheels.speeds(drive.motors);
}

bool World::in_contact(std::size_t actor) const {
  return std::any_of(impl_->touches.begin(), impl_->touches.end(),
                     [&](const Touch& touch) { return touch.a == actor || touch.b == actor; });
}

const std::vector<Touch>& World::touches() const {
  return impl_->touches;
}

}  // namespace skylight::sim
