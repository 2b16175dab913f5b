// Rays against the solids that robots and walls are made of.
#pragma once

#include <limits>
#include <span>

#include <Eigen/Core>

#include "sim/scenario/robot_model.hpp"

namespace skylight::sim {

struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  ///< of any length; distances are in units of it
};

enum class Face : std::uint8_t { top, side };

struct Hit {
  double distance = std::numeric_limits<double>::infinity();  ///< nothing further than this counts
  const Solid* solid = nullptr;                               ///< none: nothing was hit
  Face face = Face::top;
  Eigen::Vector3d normal{0.0, 0.0, 1.0};
};

/// Whether the ray meets the solid nearer than `hit`, which is then replaced.
bool intersect(const Solid& solid, const Ray& ray, Hit& hit);

/// The nearest of all solids that is nearer than `hit`. They must be sorted by falling top: for rays that go
/// down, those below what was hit already are not looked at.
bool intersect(std::span<const Solid* const> solids, const Ray& ray, Hit& hit);

/// Whether the ray comes within `margin` (metres) of the solid's bounding box, in front of its origin.
bool passes_near(const Solid& solid, const Ray& ray, double margin);

}  // namespace skylight::sim
