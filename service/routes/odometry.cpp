// What robots say of their own motion.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "service/routes/context.hpp"
#include "service/simulator_desk.hpp"

namespace skylight::service {

enum class ReadingKind : std::uint8_t { odometry, command };

/// One reading in a request's body.
struct ReadingBody {
  std::optional<double> stamp;
  double v_mps = 0.0;
  double side_mps = 0.0;
  double w_radps = 0.0;
  std::optional<std::array<double, 9>> covariance;
  ReadingKind kind = ReadingKind::odometry;
};

namespace {

constexpr std::size_t kMostReadings = 1000;

// A base follows what it is told after a while, and not at all where it is held: five times as uncertain as
// what its wheels say, which is BodyVelocity's default.
constexpr double kCommandedWorse = 5.0;

Covariance3 matrix(const std::array<double, 9>& rows) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
}

bool is_covariance(const std::array<double, 9>& rows) {
  const Covariance3 c = matrix(rows);
  return (c - c.transpose()).cwiseAbs().maxCoeff() <= 1e-6 * c.cwiseAbs().maxCoeff() &&
         c.diagonal().minCoeff() > 0.0 && c.llt().info() == Eigen::Success;
}

OdometryReading reading_of(const ReadingBody& body) {
  OdometryReading out;
  if (body.stamp) out.stamp = from_unix_seconds(*body.stamp);
  out.velocity.forward = body.v_mps;
  out.velocity.sideways = body.side_mps;
  out.velocity.yaw_rate = body.w_radps;
  if (body.covariance) {
    out.velocity.covariance = matrix(*body.covariance);
  } else if (body.kind == ReadingKind::command) {
    out.velocity.covariance *= kCommandedWorse * kCommandedWorse;
  }
  return out;
}

}  // namespace

void describe(settings::Fields& fields, ReadingBody& body) {
  fields.about("How fast a robot goes by its own account, in its own frame.");
  fields.field("stamp", body.stamp,
               {.min = 0, .max = 7'258'118'400.0, .unit = "s", .help = "By the robot's own clock."});
  fields.field("v_mps", body.v_mps,
               {.min = -50, .max = 50, .unit = "m/s", .required = true, .help = "Forward."});
  fields.field("side_mps", body.side_mps, {.min = -50, .max = 50, .unit = "m/s", .help = "To the left."});
  fields.field("w_radps", body.w_radps,
               {.min = -100, .max = 100, .unit = "rad/s", .required = true, .help = "Counter-clockwise."});
  fields.field("covariance", body.covariance,
               {.min = -1e4, .max = 1e4, .help = "3 x 3, row by row, of v_mps, side_mps, w_radps."});
  fields.choice("kind", body.kind, {{"odometry", ReadingKind::odometry}, {"command", ReadingKind::command}},
                {.help = "What the wheels say, or what the base was told to do."});
  fields.check(!body.covariance || is_covariance(*body.covariance), "covariance",
               "is not symmetric and positive definite");
}

namespace {

std::vector<OdometryReading> readings_of(const http::Request& request) {
  const settings::Document document = body_document(request);
  if (document.root.kind != settings::Node::Kind::array)
    return {reading_of(read_body<ReadingBody>(document))};
  const std::size_t count = document.root.children.size();
  if (count == 0 || count > kMostReadings) {
    throw http::Problem(422, "The body is refused",
                        "body: " + std::to_string(count) + " readings, allowed: 1 to 1000");
  }
  std::vector<OdometryReading> out;
  for (const ReadingBody& body : read_body<std::vector<ReadingBody>>(document))
    out.push_back(reading_of(body));
  return out;
}

http::Reply post_odometry(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const Time received = context.pipeline.now();
  const auto snapshot = context.pipeline.snapshot();
  const RobotSnapshot& robot = robot_of(request, *snapshot);
  const auto readings = readings_of(request);
  OdometryReceipt receipt = context.pipeline.odometry().hear(robot.view.id, readings, received);
  if (std::holds_alternative<WindowFilterConfig>(robot.spec->filter)) {
    receipt.ignored += std::exchange(receipt.accepted, 0);
    receipt.reason = "this robot's filter, window, does not use odometry";
  }
  return json_reply(
      {{"robot", robot.view.id},
       {"accepted", receipt.accepted},
       {"ignored", receipt.ignored},
       {"reason", receipt.ignored > 0 ? Json(receipt.reason) : Json(nullptr)},
       {"clock_offset_s", receipt.clock_offset ? Json(to_seconds(*receipt.clock_offset)) : Json(nullptr)}},
      202);
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json odometry_json(const std::string& robot, Time stamp, const std::optional<Pose2>& pose,
                   const std::array<double, 3>& twist) {
  return {{"robot", robot},
          {"stamp", unix_seconds(stamp)},
          {"frame", "odom"},
          {"pose", pose ? Json{{"x", number(pose->x)}, {"y", number(pose->y)}, {"yaw", number(pose->yaw)}}
                        : Json(nullptr)},
          {"twist",
           {{"v_mps", number(twist[0])}, {"side_mps", number(twist[1])}, {"w_radps", number(twist[2])}}}};
}

[[noreturn]] void refuse_silent(const std::string& robot) {
  throw http::Problem(404, "No odometry", "robot '" + robot + "' has not reported its odometry yet");
}

// Of a simulated robot what its wheels say, whoever posts something for it: a program that stands in for the
// robot reads it here and posts it.
http::Reply get_odometry(const http::Request& request, const RouteContext& context) {
  check_query(request, {});
  const std::string& id = request.path_param("id");
  if (const auto live = context.simulator != nullptr ? context.simulator->running().live : nullptr) {
    const auto& robots = live->shows().robots();
    if (std::any_of(robots.begin(), robots.end(), [&](const auto& robot) { return robot.id == id; })) {
      const auto report = live->odometry(id);
      if (!report) refuse_silent(id);
      return json_reply(
          odometry_json(id, report->at, report->pose, {report->v_mps, report->side_mps, report->w_radps}));
    }
  }
  const auto snapshot = context.pipeline.snapshot();
  robot_of(request, *snapshot);
  const auto said = context.pipeline.odometry().newest(id);
  if (!said) refuse_silent(id);
  return json_reply(odometry_json(id, said->at, {}, {said->forward, said->sideways, said->yaw_rate}));
}

}  // namespace

void add_odometry_routes(http::Router& router, const RouteContext& context) {
  const auto bound = [&context](auto handler) {
    return [&context, handler](const http::Request& request) { return handler(request, context); };
  };
  router.add("GET", "/api/v1/robots/{id}/odometry", bound(get_odometry));
  router.add("POST", "/api/v1/robots/{id}/odometry", bound(post_odometry));
}

}  // namespace skylight::service
