// Rays against the solids that robots and walls are made of.
#pragma once

#include <Eigen/Core>

#include "sim/robot_model.hpp"

namespace skylight::sim {

struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  ///< of any length; distances are in units of it
};

enum class Face : std::uint8_t { top, side };

struct Hit {
  double distance = 0.0;
  const Solid* solid = nullptr;  ///< none: nothing was hit
  Face face = Face::top;
  Eigen::Vector3d normal{0.0, 0.0, 1.0};
};

/// The nearest of the solids in front of the ray's origin that is nearer than `hit`; true where `hit`
/// changed. For solids sorted by falling top and rays that go downwards from above, it looks at no more than
/// it must.
bool intersect(const std::vector<Solid>& solids, const Ray& ray, Hit& hit);

}  // namespace skylight::sim
