#include "sim/render/solids.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace skylight::sim {
namespace {

constexpr double kNear = 1e-6;

/// Slab method; the side that is entered last tells the face.
bool intersect_box(const Solid& box, const Ray& ray, Hit& hit) {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  int axis = 2;
  for (int i = 2; i >= 0; --i) {
    if (ray.direction[i] == 0.0) {
      if (ray.origin[i] < box.min[i] || ray.origin[i] > box.max[i]) return false;
      continue;
    }
    const double inverse = 1.0 / ray.direction[i];
    double near = (box.min[i] - ray.origin[i]) * inverse;
    double far = (box.max[i] - ray.origin[i]) * inverse;
    if (near > far) std::swap(near, far);
    if (near > enter) {
      enter = near;
      axis = i;
    }
    leave = std::min(leave, far);
    if (enter > leave || enter >= hit.distance) return false;
  }
  if (enter < kNear) return false;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  normal[axis] = ray.direction[axis] > 0.0 ? -1.0 : 1.0;
  hit = {enter, &box, axis == 2 ? Face::top : Face::side, normal};
  return true;
}

/// A cylinder along `axis`: its caps by their planes, its mantle by the quadratic in the other two axes.
bool intersect_cylinder(const Solid& solid, int axis, const Ray& ray, Hit& hit) {
  const int a = axis == 2 ? 0 : 2;
  const int b = axis == 2 ? 1 : 0;
  const double radius = 0.5 * (solid.max[a] - solid.min[a]);
  const double oa = ray.origin[a] - 0.5 * (solid.min[a] + solid.max[a]);
  const double ob = ray.origin[b] - 0.5 * (solid.min[b] + solid.max[b]);
  const double da = ray.direction[a];
  const double db = ray.direction[b];
  const double qa = da * da + db * db;
  const double qb = oa * da + ob * db;
  const double qc = oa * oa + ob * ob - radius * radius;
  const double discriminant = qb * qb - qa * qc;
  if (qa > 0.0 && discriminant < 0.0) return false;
  bool changed = false;
  if (ray.direction[axis] != 0.0) {
    const bool from_above = ray.direction[axis] < 0.0;
    const double t =
        ((from_above ? solid.max[axis] : solid.min[axis]) - ray.origin[axis]) / ray.direction[axis];
    const double pa = oa + t * da;
    const double pb = ob + t * db;
    if (t > kNear && t < hit.distance && pa * pa + pb * pb <= radius * radius) {
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      normal[axis] = from_above ? 1.0 : -1.0;
      hit = {t, &solid, axis == 2 ? Face::top : Face::side, normal};
      changed = true;
    }
  }
  if (qa > 0.0) {
    const double t = (-qb - std::sqrt(discriminant)) / qa;
    const double along = ray.origin[axis] + t * ray.direction[axis];
    if (t > kNear && t < hit.distance && along >= solid.min[axis] && along <= solid.max[axis]) {
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      normal[a] = (oa + t * da) / radius;
      normal[b] = (ob + t * db) / radius;
      hit = {t, &solid, Face::side, normal};
      changed = true;
    }
  }
  return changed;
}

}  // namespace

bool intersect(const Solid& solid, const Ray& ray, Hit& hit) {
  switch (solid.kind) {
    case SolidKind::cylinder:
      return intersect_cylinder(solid, 2, ray, hit);
    case SolidKind::wheel:
      return intersect_cylinder(solid, 1, ray, hit);
    case SolidKind::box:
      break;
  }
  return intersect_box(solid, ray, hit);
}

bool intersect(std::span<const Solid* const> solids, const Ray& ray, Hit& hit) {
  bool changed = false;
  for (const Solid* solid : solids) {
    // A ray that goes down enters this solid, and all lower ones, no sooner than the height of its top.
    if (ray.direction.z() < 0.0 && (solid->max.z() - ray.origin.z()) / ray.direction.z() >= hit.distance)
      break;
    if (intersect(*solid, ray, hit)) changed = true;
  }
  return changed;
}

bool passes_near(const Solid& solid, const Ray& ray, double margin) {
  double enter = 0.0;
  double leave = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double low = solid.min[i] - margin - ray.origin[i];
    const double high = solid.max[i] + margin - ray.origin[i];
    if (ray.direction[i] == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    const double inverse = 1.0 / ray.direction[i];
    enter = std::max(enter, std::min(low * inverse, high * inverse));
    leave = std::min(leave, std::max(low * inverse, high * inverse));
  }
  return enter <= leave;
}

}  // namespace skylight::sim
