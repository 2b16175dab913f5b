#include "tracker/depth/whereabouts.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

namespace skylight {
namespace {

// Rings about the middle, in standard deviations, and what of a normal distribution in two dimensions lies
// nearer to each than to the others: exp(-r^2 / 2) of it lies beyond r.
constexpr int kAround = 8;
struct Ring {
  double radius;
  double share;
};
constexpr std::array<Ring, 3> kRings{{{1.0, 0.558}, {2.0, 0.281}, {3.0, 0.044}}};
constexpr double kMiddle = 0.117;
constexpr double kAll = 1.0 - 1e-6;

}  // namespace

Whereabouts whereabouts(const FloorDepth& floor, const cv::Mat& depth, const Surface& surface,
                        const Pose2& pose, const Eigen::Matrix2d& covariance) {
  Whereabouts out;
  const auto ask = [&](const Eigen::Vector2d& off, double share) {
    const SurfaceLook look = look_at(floor, depth, surface, {pose.x + off.x(), pose.y + off.y(), pose.yaw});
    if (skylight::covered(look, floor.config())) out.covered += share;
    if (empty(look)) out.empty += share;
  };
  ask({0.0, 0.0}, kMiddle);
  const Eigen::Matrix2d root = covariance.llt().matrixL();
  for (const Ring& ring : kRings) {
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kAround;
      ask(root * Eigen::Vector2d(ring.radius * std::cos(angle), ring.radius * std::sin(angle)),
          ring.share / kAround);
    }
  }
  return out;
}

bool covered(const Whereabouts& whereabouts) {
  return whereabouts.covered > 0.5 * (1.0 - whereabouts.empty);
}

bool gone(const Whereabouts& whereabouts) {
  return whereabouts.empty >= kAll;
}

}  // namespace skylight
