#include "tracker/detect/local_projection.hpp"

#include <array>

namespace skylight {

std::optional<LocalProjection> LocalProjection::at(const CameraModel& camera, const Eigen::Vector2d& centre_m,
                                                   double height_m, double reach_m) {
  const double e = reach_m;
  std::array<std::array<Pixel, 3>, 3> node;  // [x][y]
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const auto pixel =
          camera.pixel_from_map({centre_m.x() + (i - 1) * e, centre_m.y() + (j - 1) * e, height_m});
      if (!pixel) return std::nullopt;
      node[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = *pixel;
    }
  }
  LocalProjection local;
  local.centre_m = centre_m;
  local.origin_px = node[1][1];
  local.jacobian.col(0) = (node[2][1] - node[0][1]) / (2 * e);
  local.jacobian.col(1) = (node[1][2] - node[1][0]) / (2 * e);
  local.xx = (node[2][1] - 2 * node[1][1] + node[0][1]) / (2 * e * e);
  local.yy = (node[1][2] - 2 * node[1][1] + node[1][0]) / (2 * e * e);
  local.xy = (node[2][2] - node[2][0] - node[0][2] + node[0][0]) / (4 * e * e);
  if (!(std::abs(local.jacobian.determinant()) > 1e-6)) return std::nullopt;
  return local;
}

}  // namespace skylight
