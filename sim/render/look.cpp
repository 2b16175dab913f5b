#include "sim/render/look.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace skylight::sim {
namespace {

constexpr std::size_t kMaxSolids = 16;

Solid box_around(const std::vector<Solid>& solids) {
  Solid bound;
  bound.min.setConstant(std::numeric_limits<double>::infinity());
  bound.max = -bound.min;
  for (const Solid& solid : solids) {
    bound.min = bound.min.cwiseMin(solid.min);
    bound.max = bound.max.cwiseMax(solid.max);
  }
  return bound;
}

/// Fewer shapes than solids: what lies within another's outline (or sticks out a little) and no higher (or
/// hardly) is part of its shadow anyway.
std::vector<Caster> make_casters(const std::vector<Solid>& solids) {
  constexpr double kBeside = 0.025;  // m
  constexpr double kAbove = 0.02;
  constexpr double kBelow = 0.1;  // legs are no part of a trunk
  std::vector<Solid> left = solids;
  const auto area = [](const Solid& s) { return (s.max - s.min).head<2>().prod(); };
  std::stable_sort(left.begin(), left.end(),
                   [&](const Solid& a, const Solid& b) { return area(a) > area(b); });
  std::vector<Solid> kept;
  for (const Solid& solid : left) {
    const auto part_of = [&](const Solid& other) {
      return ((other.min - solid.min).head<2>().array() <= kBeside).all() &&
             ((solid.max - other.max).head<2>().array() <= kBeside).all() &&
             solid.max.z() <= other.max.z() + kAbove && solid.max.z() >= other.min.z() - kAbove &&
             solid.min.z() >= other.min.z() - kBelow;
    };
    const auto other = std::find_if(kept.begin(), kept.end(), part_of);
    if (other == kept.end()) {
      kept.push_back(solid);
    } else {
      other->min.z() = std::min(other->min.z(), solid.min.z());
    }
  }
  std::vector<Caster> casters;
  for (const Solid& solid : kept) {
    const Eigen::Vector3f middle = (0.5 * (solid.min + solid.max)).cast<float>();
    const Eigen::Vector3f half = (0.5 * (solid.max - solid.min)).cast<float>();
    casters.push_back({solid.kind == SolidKind::cylinder, middle.x(), middle.y(), half.x(), half.y(),
                       static_cast<float>(solid.min.z()), static_cast<float>(solid.max.z())});
  }
  return casters;
}

}  // namespace

Look::Look(Body body) : solids_(std::move(body.solids)), gloss_(body.gloss) {
  if (solids_.empty() || solids_.size() > kMaxSolids)
    throw std::invalid_argument("a body has 1 to 16 solids, not " + std::to_string(solids_.size()));
  std::stable_sort(solids_.begin(), solids_.end(),
                   [](const Solid& a, const Solid& b) { return a.max.z() > b.max.z(); });
  bound_ = box_around(solids_);
  casters_ = make_casters(solids_);
  seen_area_ = {solids_.front().min.head<2>(), solids_.front().max.head<2>()};
  seen_height_ = solids_.front().max.z();
  if (body.decal) lay(*body.decal);
}

/// Extends the picture with the solid's colour to all of its upper side, so that nobody has to ask where it
/// ends.
void Look::lay(const Decal& decal) {
  const auto carrier =
      std::find_if(solids_.begin(), solids_.end(), [](const Solid& s) { return s.carries_picture; });
  if (carrier == solids_.end()) throw std::invalid_argument("a picture, but no solid to carry it");
  plate_ = static_cast<std::size_t>(carrier - solids_.begin());
  plate_gloss_ = decal.gloss;
  metres_per_px_ = decal.metres_per_px;
  const double mpp = decal.metres_per_px;
  const Texture& texture = decal.texture;
  const Eigen::Vector2d middle = 0.5 * (decal.area.min + decal.area.max);
  const Eigen::Vector2d half(0.5 * texture.height_px() * mpp, 0.5 * texture.width_px() * mpp);  // x, y
  const auto reach = (carrier->max.head<2>() - middle).cwiseMax(middle - carrier->min.head<2>());
  const auto extra = [&](int axis) {
    return std::max(0, static_cast<int>(std::ceil((reach[axis] - half[axis]) / mpp - 1e-6)));
  };
  const int above = extra(0);
  const int beside = extra(1);
  const cv::Vec3b plain(cv::saturate_cast<std::uint8_t>(carrier->top_rgb[2]),
                        cv::saturate_cast<std::uint8_t>(carrier->top_rgb[1]),
                        cv::saturate_cast<std::uint8_t>(carrier->top_rgb[0]));
  cv::Mat image(texture.height_px() + 2 * above, texture.width_px() + 2 * beside, CV_8UC3, cv::Scalar(plain));
  for (int r = 0; r < texture.height_px(); ++r) {
    for (int c = 0; c < texture.width_px(); ++c) {
      const Bgr texel = texture.sample(0, static_cast<float>(c), static_cast<float>(r));
      for (int k = 0; k < 3; ++k)
        image.at<cv::Vec3b>(r + above, c + beside)[k] = cv::saturate_cast<std::uint8_t>(texel[k]);
    }
  }
  print_ = Print(image);
  print_origin_ = {0.5 * (image.cols - 1) + middle.y() / mpp, 0.5 * (image.rows - 1) + middle.x() / mpp};
  seen_area_ = decal.area;
  seen_height_ = carrier->max.z();
}

Body body_of(const RobotLook& robot) {
  return {robot.model->solids,
          Decal{.texture = robot.picture, .area = robot.model->plate, .metres_per_px = robot.metres_per_px},
          0.02};
}

}  // namespace skylight::sim
