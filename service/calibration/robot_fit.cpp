#include "service/calibration/robot_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "service/calibration/least_squares.hpp"
#include "service/calibration/median.hpp"

namespace skylight::calibration {
namespace {

constexpr double kLeastSigma_m = 5e-5;
constexpr double kFarOff = 4.5;  // standard deviations
constexpr int kRounds = 5;
constexpr double kMostInflation = 25.0;
constexpr double kDifference = 1e-6;

struct Look {
  Pose2 at{};          ///< of the picture, on the plane of the height that is tried
  double scale = 1.0;  ///< of that plane against the one that was assumed
};

Look look_at(const RobotRun& run, std::size_t i, double height_m) {
  const SeenRobot& seen = run.seen[i];
  const Eigen::Vector3d camera = run.cameras[seen.camera].map_from_camera().translation();
  return {carried(seen.pose, camera, run.assumed.surface_height_m, height_m),
          (camera.z() - height_m) / (camera.z() - run.assumed.surface_height_m)};
}

// Between two looks, as on an arc of constant curvature: the chord points along the middle heading, and is
// shorter than the way by sin(turn / 2) / (turn / 2).
Eigen::Vector2d way_between(const Look& a, const Look& b, const Eigen::VectorXd& x) {
  const Eigen::Vector2d mounting = x.segment<2>(kAlong);
  const double turn = wrap_angle(b.at.yaw - a.at.yaw);
  const double heading = a.at.yaw - x[kHeading] + 0.5 * turn;
  const Eigen::Vector2d chord = base_of(b.at, mounting) - base_of(a.at, mounting);
  const double stretch = std::abs(turn) > 1e-6 ? 0.5 * turn / std::sin(0.5 * turn) : 1.0;
  return stretch * (Eigen::Rotation2Dd(-heading) * chord);
}

// Looks err by what they erred on the plane that was assumed, so that is where they are compared: else the
// fit would like best the height at which everything shrinks to the point under the camera.
double off_by(const Equation& e, const Eigen::VectorXd& x, const Look& a, const Look& b) {
  const Eigen::Vector2d mounting = x.segment<2>(kAlong);
  switch (e.kind) {
    case EquationKind::spot_x:
    case EquationKind::spot_y:
      return (base_of(a.at, mounting) - x.segment<2>(e.p))[e.kind == EquationKind::spot_y ? 1 : 0] / a.scale;
    case EquationKind::sideways:
      return (way_between(a, b, x).y() - x[kScale] * e.said) / a.scale;
    case EquationKind::forward:
      return (way_between(a, b, x).x() - x[kScale] * e.said) / a.scale;
    case EquationKind::circle:
      return ((base_of(a.at, mounting) - x.segment<2>(e.p)).norm() - x[kRadius]) / a.scale;
    case EquationKind::distance:
      return (x.segment<2>(e.p) - x.segment<2>(e.q)).norm() - e.said;
    case EquationKind::same_x:
      return x[e.p] - x[e.q];
    case EquationKind::same_y:
      return x[e.p + 1] - x[e.q + 1];
    case EquationKind::prior:
      return x[e.p] - e.said;
  }
  return 0.0;
}

double off_by(const Equation& e, const Eigen::VectorXd& x, const RobotRun& run) {
  if (!is_of_looks(e)) return off_by(e, x, Look{}, Look{});
  return off_by(e, x, look_at(run, e.a, x[kHeight]), look_at(run, e.b, x[kHeight]));
}

// The parameters that an equation may hang on.
std::vector<Eigen::Index> touched(const Equation& e) {
  if (e.kind == EquationKind::prior) return {e.p};
  std::vector<Eigen::Index> out;
  if (is_of_looks(e)) out = {kHeight, kAlong, kAcross};
  if (e.kind == EquationKind::sideways || e.kind == EquationKind::forward) {
    out.insert(out.end(), {kHeading, kScale});
    return out;
  }
  out.insert(out.end(), {e.p, e.p + 1});
  if (e.kind == EquationKind::circle) out.push_back(kRadius);
  if (!is_of_looks(e)) out.insert(out.end(), {e.q, e.q + 1});
  return out;
}

struct Rows {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;
};

Rows rows_of(const RobotRun& run, const std::vector<Equation>& equations, const Eigen::VectorXd& x) {
  const auto count = static_cast<Eigen::Index>(equations.size());
  Rows rows{Eigen::MatrixXd::Zero(count, x.size()), Eigen::VectorXd(count)};
  Eigen::VectorXd there = x;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Equation& e = equations[static_cast<std::size_t>(i)];
    rows.residual[i] = off_by(e, x, run);
    for (const Eigen::Index k : touched(e)) {
      there[k] = x[k] + kDifference;
      const double ahead = off_by(e, there, run);
      there[k] = x[k] - kDifference;
      rows.jacobian(i, k) = (ahead - off_by(e, there, run)) / (2.0 * kDifference);
      there[k] = x[k];
    }
  }
  return rows;
}

Eigen::VectorXd weights_of(const std::vector<Equation>& equations) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(equations.size()));
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const Equation& e = equations[static_cast<std::size_t>(i)];
    out[i] = e.used ? 1.0 / (e.sigma * e.sigma) : 0.0;
  }
  return out;
}

void solve(const RobotRun& run, FittedRobot& fit) {
  const Eigen::VectorXd weights = weights_of(fit.equations);
  const auto normal = [&](const Eigen::VectorXd& x) -> std::optional<Normal> {
    const Rows rows = rows_of(run, fit.equations, x);
    Normal out(x.size());
    const Eigen::MatrixXd weighed = weights.asDiagonal() * rows.jacobian;
    out.cost = 0.5 * rows.residual.dot(weights.cwiseProduct(rows.residual));
    out.gradient = weighed.transpose() * rows.residual;
    out.hessian = rows.jacobian.transpose() * weighed;
    return out;
  };
  const auto moved = [](const Eigen::VectorXd& x, const Eigen::VectorXd& step) -> Eigen::VectorXd {
    return x + step;
  };
  minimise(fit.x, normal, moved, {.most_steps = 30, .smallest_gain = 1e-9});
}

// How much the residuals of one kind scatter, and how alike neighbours are: of a first-order autoregression
// with correlation r, n values tell as much of a mean as n (1 - r) / (1 + r) independent ones (Bayley and
// Hammersley, "The 'effective' number of independent observations in an autocorrelated time series", 1946).
void weigh(const std::vector<double>& off, FittedRobot& fit) {
  for (std::size_t kind = 0; kind <= static_cast<std::size_t>(EquationKind::circle); ++kind) {
    std::vector<double> sizes;
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (static_cast<std::size_t>(fit.equations[i].kind) != kind) continue;
      members.push_back(i);
      sizes.push_back(std::abs(off[i]));
    }
    if (members.empty()) continue;
    const double spread = std::max(kLeastSigma_m, 1.4826 * median(sizes));
    double products = 0.0;
    double squares = 0.0;
    double used = 0.0;
    std::optional<std::size_t> before;
    for (const std::size_t i : members) {
      Equation& e = fit.equations[i];
      e.used = std::abs(off[i]) <= kFarOff * spread;
      if (!e.used) continue;
      if (before && fit.equations[*before].stretch == e.stretch) products += off[*before] * off[i];
      squares += off[i] * off[i];
      ++used;
      before = i;
    }
    const double r = squares > 0.0 ? std::clamp(products / squares, 0.0, 0.95) : 0.0;
    const double sigma = std::max(kLeastSigma_m, std::sqrt(squares / std::max(1.0, used)));
    const double inflation = std::min(kMostInflation, (1.0 + r) / (1.0 - r));
    for (const std::size_t i : members)
      fit.equations[i].sigma = fit.equations[i].noise = sigma * std::sqrt(inflation);
  }
}

// What the camera's error does to the equations: d(residual) / d(camera's parameters).
Eigen::MatrixXd by_camera(const RobotRun& run, const FittedRobot& fit, std::size_t camera) {
  Eigen::MatrixXd out =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(fit.equations.size()), kCameraParameters);
  const double height = fit.x[kHeight];
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    const Equation& e = fit.equations[static_cast<std::size_t>(i)];
    if (!e.used || !is_of_looks(e) || run.seen[e.a].camera != camera) continue;
    const Look at[2] = {look_at(run, e.a, height), look_at(run, e.b, height)};
    for (const int which : {0, 1}) {
      if (which == 1 && e.b == e.a) continue;
      const auto pose = pose_by_camera(run.cameras[camera], at[which].at.position(), height);
      if (!pose) continue;
      Eigen::RowVector3d by_pose;
      for (int k = 0; k < 3; ++k) {
        double side[2];
        for (const int way : {0, 1}) {
          Look there[2] = {at[0], at[1]};
          Pose2& moved = there[which].at;
          (k == 0 ? moved.x : k == 1 ? moved.y : moved.yaw) += way == 0 ? kDifference : -kDifference;
          if (e.b == e.a) there[1] = there[0];
          side[way] = off_by(e, fit.x, there[0], there[1]);
        }
        by_pose[k] = (side[0] - side[1]) / (2.0 * kDifference);
      }
      out.row(i) += by_pose * *pose;
    }
  }
  return out;
}

void find_covariance(const RobotRun& run, FittedRobot& fit) {
  const Rows rows = rows_of(run, fit.equations, fit.x);
  const Eigen::VectorXd weights = weights_of(fit.equations);
  const Eigen::MatrixXd weighed = weights.asDiagonal() * rows.jacobian;
  const Eigen::MatrixXd hessian = rows.jacobian.transpose() * weighed;
  const Eigen::MatrixXd gain = hessian.ldlt().solve(weighed.transpose());
  Eigen::VectorXd variance(weights.size());
  for (Eigen::Index i = 0; i < variance.size(); ++i)
    variance[i] = std::pow(fit.equations[static_cast<std::size_t>(i)].noise, 2);
  fit.covariance = gain * variance.asDiagonal() * gain.transpose();
  fit.covariance(kAlong, kAlong) += kPlaceError_m * kPlaceError_m;
  fit.covariance(kAcross, kAcross) += kPlaceError_m * kPlaceError_m;
  fit.covariance(kHeading, kHeading) += kHeadingError_rad * kHeadingError_rad;
  for (std::size_t camera = 0; camera < run.uncertainty.size(); ++camera) {
    const Eigen::MatrixXd by = gain * by_camera(run, fit, camera);
    fit.covariance += by * run.uncertainty[camera].covariance * by.transpose();
  }
}

}  // namespace

double residual(const Equation& equation, const FittedRobot& fit, const RobotRun& run) {
  return off_by(equation, fit.x, run);
}

FittedRobot fit_equations(const RobotRun& run, const std::vector<Stretch>& stretches,
                          const OdometryPath& odometry) {
  FittedRobot fit;
  fit.equations = equations_of(run, stretches, odometry);
  fit.x = Eigen::VectorXd::Zero(place_of(stretches.size()));
  for (const Equation& e : fit.equations) {
    if (e.kind == EquationKind::prior) fit.x[e.p] = e.said;
  }
  for (int round = 0; round < kRounds; ++round) {
    solve(run, fit);
    std::vector<double> off;
    for (const Equation& e : fit.equations) off.push_back(off_by(e, fit.x, run));
    weigh(off, fit);
  }
  solve(run, fit);
  find_covariance(run, fit);
  return fit;
}

}  // namespace skylight::calibration
