#include "sim/world/world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>
#include <box2d/box2d.h>

namespace skylight::sim {
namespace {

constexpr double kGravity = 9.81;
constexpr double kWallThickness = 0.5;
constexpr double kDt = std::chrono::duration<double>(World::kStep).count();

b2Vec2 to_b2(const Eigen::Vector2d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y())};
}
Eigen::Vector2d from_b2(const b2Vec2& v) {
  return {v.x, v.y};
}

/// Shapes touch through a skin of b2_polygonRadius each; drawn in by it, bodies meet at their true outline.
void set_rectangle(b2PolygonShape& shape, const Eigen::Vector2d& min, const Eigen::Vector2d& max,
                   double skin) {
  const Eigen::Vector2d half = 0.5 * (max - min) - Eigen::Vector2d::Constant(skin);
  shape.SetAsBox(static_cast<float>(std::max(1e-3, half.x())), static_cast<float>(std::max(1e-3, half.y())),
                 to_b2(0.5 * (min + max)), 0.0F);
}

struct RobotBody {
  b2Body* body = nullptr;
  const RobotModel* model = nullptr;
  double v = 0.0;  ///< of the motors, as forward speed and yaw rate; the wheels turn accordingly
  double w = 0.0;
};

}  // namespace

struct World::Impl {
  explicit Impl(double floor_friction_in) : floor_friction(floor_friction_in) {}
  void add_walls(const RoomSpec& room);
  void add_robot(const RobotSpec& spec);
  void drive(RobotBody& robot, const Command& command) const;

  b2World b2{b2Vec2(0.0F, 0.0F)};
  std::vector<RobotBody> robots;
  double floor_friction;
};

void World::Impl::add_walls(const RoomSpec& room) {
  const b2BodyDef definition;
  b2Body* walls = b2.CreateBody(&definition);
  const Eigen::Vector2d half(0.5 * room.size_m[0], 0.5 * room.size_m[1]);
  const double t = kWallThickness;
  const auto wall = [&](const Eigen::Vector2d& min, const Eigen::Vector2d& max) {
    b2PolygonShape shape;
    set_rectangle(shape, min, max, b2_polygonRadius);
    walls->CreateFixture(&shape, 0.0F);
  };
  wall({-half.x() - t, -half.y() - t}, {half.x() + t, -half.y()});
  wall({-half.x() - t, half.y()}, {half.x() + t, half.y() + t});
  wall({-half.x() - t, -half.y()}, {-half.x(), half.y()});
  wall({half.x(), -half.y()}, {half.x() + t, half.y()});
}

void World::Impl::add_robot(const RobotSpec& spec) {
  const RobotModel& model = robot_model(spec.model);
  b2BodyDef definition;
  definition.type = b2_dynamicBody;
  definition.position.Set(static_cast<float>(spec.start.x_m), static_cast<float>(spec.start.y_m));
  definition.angle = static_cast<float>(spec.start.yaw_deg * std::numbers::pi / 180.0);
  definition.allowSleep = false;
  b2Body* body = b2.CreateBody(&definition);
  for (const Rectangle& part : model.footprint) {
    b2PolygonShape shape;
    set_rectangle(shape, part.min, part.max, b2_polygonRadius);
    b2FixtureDef fixture;
    fixture.shape = &shape;
    fixture.friction = 0.3F;  // plastic against plastic or a wall
    fixture.density = 1.0F;   // replaced below: the mass is known
    body->CreateFixture(&fixture);
  }
  b2MassData mass;
  mass.mass = static_cast<float>(model.mass_kg);
  mass.center.Set(static_cast<float>(model.centre_of_mass_x_m), 0.0F);
  mass.I = static_cast<float>(model.yaw_inertia_kgm2 + model.mass_kg * std::pow(model.centre_of_mass_x_m, 2));
  body->SetMassData(&mass);
  robots.push_back({body, &model, 0.0, 0.0});
}

/// Motors, then tyres: the impulses at the two wheels that would make the body roll without slip within this
/// step, cut to what the tyres can give.
void World::Impl::drive(RobotBody& robot, const Command& command) const {
  const RobotModel& m = *robot.model;
  const auto towards = [](double from, double to, double most) {
    return from + std::clamp(to - from, -most, most);
  };
  robot.v = towards(robot.v, std::clamp(command.v_mps, -m.max_speed_mps, m.max_speed_mps),
                    m.max_acceleration_mps2 * kDt);
  robot.w = towards(robot.w, std::clamp(command.w_radps, -m.max_yaw_rate_radps, m.max_yaw_rate_radps),
                    m.max_yaw_acceleration_radps2 * kDt);

  // Velocity error of the axle's middle in the robot frame: along, across, yaw rate.
  b2Body& body = *robot.body;
  const Eigen::Vector2d velocity =
      from_b2(body.GetLocalVector(body.GetLinearVelocityFromLocalPoint(b2Vec2(0.0F, 0.0F))));
  const Eigen::Vector3d error(robot.v - velocity.x(), -velocity.y(),
                              robot.w - static_cast<double>(body.GetAngularVelocity()));
  // An impulse (jx, jy) at the axle and a turning impulse l about it change that velocity by
  //   jx / m,   jy / m + r (l + jy r) / I,   (l + jy r) / I     with r from the centre of mass to the axle.
  const double r = -m.centre_of_mass_x_m;
  const double spin = m.yaw_inertia_kgm2 * error.z();  // l + jy r
  const double jx = m.mass_kg * error.x();
  const double jy = m.mass_kg * (error.y() - r * error.z());
  const double l = spin - jy * r;
  const double arm = 0.5 * m.wheel_separation_m;
  const double grip = 0.5 * m.mass_kg * kGravity * m.wheel_load * floor_friction * kDt;
  for (const double side : {1.0, -1.0}) {  // left, right
    Eigen::Vector2d impulse(0.5 * (jx - side * l / arm), 0.5 * jy);
    const double used = std::hypot(impulse.x() / m.rolling_friction, impulse.y() / m.lateral_friction);
    if (used > grip) impulse *= grip / used;
    const b2Vec2 at = body.GetWorldPoint(b2Vec2(0.0F, static_cast<float>(side * arm)));
    body.ApplyLinearImpulse(body.GetWorldVector(to_b2(impulse)), at, true);
  }
}

World::World(const RoomSpec& room, const std::vector<RobotSpec>& robots)
    : impl_(std::make_unique<Impl>(room.floor.friction)) {
  impl_->add_walls(room);
  for (const RobotSpec& robot : robots) impl_->add_robot(robot);
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

void World::step(const std::vector<Command>& commands) {
  for (std::size_t i = 0; i < impl_->robots.size(); ++i) impl_->drive(impl_->robots[i], commands.at(i));
  impl_->b2.Step(static_cast<float>(kDt), 12, 6);
  for (RobotBody& robot : impl_->robots) {
    // A float angle loses digits as it grows; a robot that circles for a day must not.
    const float angle = robot.body->GetAngle();
    if (std::abs(angle) > 20.0F) {
      robot.body->SetTransform(robot.body->GetPosition(),
                               static_cast<float>(wrap_angle(static_cast<double>(angle))));
    }
  }
}

std::size_t World::robot_count() const {
  return impl_->robots.size();
}

BodyState World::state(std::size_t robot) const {
  const b2Body& body = *impl_->robots.at(robot).body;
  const b2Vec2 velocity = body.GetLinearVelocityFromLocalPoint(b2Vec2(0.0F, 0.0F));
  return {{body.GetPosition().x, body.GetPosition().y, wrap_angle(static_cast<double>(body.GetAngle()))},
          {velocity.x, velocity.y, body.GetAngularVelocity()}};
}

Eigen::Vector2d World::wheel_speeds(std::size_t robot) const {
  const RobotBody& body = impl_->robots.at(robot);
  const double difference = 0.5 * body.model->wheel_separation_m * body.w;
  return {body.v - difference, body.v + difference};
}

bool World::in_contact(std::size_t robot) const {
  for (const b2ContactEdge* edge = impl_->robots.at(robot).body->GetContactList(); edge != nullptr;
       edge = edge->next) {
    if (edge->contact->IsTouching()) return true;
  }
  return false;
}

}  // namespace skylight::sim
