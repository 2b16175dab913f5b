#include "tracker/depth/height_check.hpp"

#include <algorithm>
#include <cmath>

namespace skylight {

HeightCheck::Answer HeightCheck::add(const SurfaceLook& look, double surface_height_m,
                                     const FloorDepth& floor) {
  const DepthConfig& config = floor.config();
  if (at_wrong_height(look, surface_height_m, config)) {
    if (!passed_) *this = {};
    return Answer::wrong;
  }
  if (passed_) return Answer::right;
  const double lasting = floor.fit().uneven_m;
  const double noise = std::max(look.sigma_m * look.sigma_m - lasting * lasting, 0.0);
  ++looks_;
  off_m_ += (look.height_m - surface_height_m - off_m_) / looks_;
  noise_variance_ += (noise - noise_variance_) / looks_;
  const double limit = std::max(config.tolerance_m, config.sigmas * lasting);
  const bool last = looks_ >= kMostLooks;
  const double sure = last ? 0.0 : config.sigmas * std::sqrt(noise_variance_ / looks_);
  passed_ = std::abs(off_m_) + sure <= limit;
  if (passed_) return Answer::right;
  if (!last) return Answer::open;
  *this = {};
  return Answer::wrong;
}

}  // namespace skylight
