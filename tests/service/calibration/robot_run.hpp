// A robot that stands, turns and drives exactly as asked, seen by cameras as a tracker with given errors sees
// it.
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "service/calibration/robot.hpp"
#include "service/evaluation/random.hpp"

namespace skylight::test {

struct Piece {
  double v_mps = 0.0;
  double w_radps = 0.0;
  double for_s = 0.0;
};

struct RunPlan {
  Pose2 start{-2.0, -1.0, 0.0};
  std::vector<Piece> pieces{};
  double rate_hz = 10.0;
  std::vector<CameraModel> truth{};       ///< where the cameras truly hang
  std::vector<CameraModel> calibrated{};  ///< what the tracker knows; empty: the truth
  std::vector<CameraUncertainty> told{};
  calibration::RobotGeometry geometry{0.141, {0.02, -0.01, 0.0}};  ///< true
  calibration::RobotGeometry assumed{0.141, {0.02, -0.01, 0.0}};
  double place_sigma_m = 1e-4;
  double yaw_sigma_rad = 1e-3;
  Eigen::Vector3d picture_error{0.0, 0.0,
                                0.0};  ///< the same in every look, along the picture's axes, and of its yaw
  double odometry_scale = 1.0;         ///< true way over what it says; 0: no odometry
  double odometry_clock_s = 0.0;
  std::uint64_t seed = 1;
};

/// The pose after `time_s` of a piece: an exact arc.
inline Pose2 driven(const Pose2& from, const Piece& piece, double time_s) {
  const double turn = piece.w_radps * time_s;
  const double chord = std::abs(turn) > 1e-9 ? std::sin(0.5 * turn) / (0.5 * turn) : 1.0;
  const double way = piece.v_mps * time_s * chord;
  return {from.x + way * std::cos(from.yaw + 0.5 * turn), from.y + way * std::sin(from.yaw + 0.5 * turn),
          wrap_angle(from.yaw + turn)};
}

/// The picture's middle and its way up, as the calibrated camera has them on the plane that is assumed: the
/// true points' pixels by the true camera, back to the plane by the other.
inline std::optional<Pose2> seen_by(const CameraModel& truth, const CameraModel& calibrated,
                                    const Pose2& base, const calibration::RobotGeometry& geometry,
                                    double assumed_height_m) {
  Eigen::Vector2d seen[2];
  for (const int i : {0, 1}) {
    const Eigen::Vector2d on_robot =
        geometry.mounting.position() +
        Eigen::Rotation2Dd(geometry.mounting.yaw) * Eigen::Vector2d(i == 0 ? -0.05 : 0.05, 0.0);
    const Eigen::Vector2d at = base.position() + Eigen::Rotation2Dd(base.yaw) * on_robot;
    const auto pixel = truth.pixel_from_map({at.x(), at.y(), geometry.surface_height_m});
    if (!pixel || !truth.sees(*pixel)) return std::nullopt;
    const auto back = calibrated.plane_from_pixel(*pixel, assumed_height_m);
    if (!back) return std::nullopt;
    seen[i] = *back;
  }
  const Eigen::Vector2d middle = 0.5 * (seen[0] + seen[1]);
  const Eigen::Vector2d up = seen[1] - seen[0];
  return Pose2{middle.x(), middle.y(), std::atan2(up.y(), up.x())};
}

/// `places` receives where the robot stood at the beginning and at the end.
inline calibration::RobotRun robot_run(const RunPlan& plan, std::vector<Pose2>* places = nullptr) {
  calibration::RobotRun run{.cameras = plan.calibrated.empty() ? plan.truth : plan.calibrated,
                            .uncertainty = plan.told,
                            .assumed = plan.assumed};
  service::Random random(plan.seed);
  Pose2 from = plan.start;
  double begun = 0.0;
  double next = 0.0;
  if (places != nullptr) places->assign({from});
  for (const Piece& piece : plan.pieces) {
    for (; next < begun + piece.for_s - 1e-9; next += 1.0 / plan.rate_hz) {
      const Pose2 base = driven(from, piece, next - begun);
      const Time captured{from_seconds(1e6 + next)};
      if (plan.odometry_scale > 0.0)
        run.odometry.push_back({.at = Time{from_seconds(1e6 + next + plan.odometry_clock_s)},
                                .forward = piece.v_mps / plan.odometry_scale,
                                .yaw_rate = piece.w_radps});
      for (std::size_t camera = 0; camera < plan.truth.size(); ++camera) {
        auto seen = seen_by(plan.truth[camera], run.cameras[camera], base, plan.geometry,
                            plan.assumed.surface_height_m);
        const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
        if (!seen) continue;
        const Eigen::Vector2d same = Eigen::Rotation2Dd(seen->yaw) * plan.picture_error.head<2>();
        seen->x += plan.place_sigma_m * noise.x() + same.x();
        seen->y += plan.place_sigma_m * noise.y() + same.y();
        seen->yaw = wrap_angle(seen->yaw + plan.yaw_sigma_rad * noise.z() + plan.picture_error.z());
        run.seen.push_back({captured, camera, *seen});
      }
    }
    from = driven(from, piece, piece.for_s);
    begun += piece.for_s;
  }
  if (places != nullptr) places->push_back(from);
  return run;
}

}  // namespace skylight::test
