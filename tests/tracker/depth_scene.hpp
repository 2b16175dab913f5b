// Depth of a floor with boxes on it, drawn without any code of the tracker: a camera that looks straight
// down, and a sensor that errs.
#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <opencv2/core.hpp>

namespace skylight::test {

/// A box with upright sides, its sides along map x and y; what is above it is not seen. Metres.
struct DepthBox {
  double x = 0.0;
  double y = 0.0;
  double length = 0.3;  ///< along x
  double width = 0.3;
  double height = 0.14;
};

struct DepthScene {
  int width_px = 640;
  int height_px = 480;
  double focal_px = 500.0;
  double camera_height_m = 3.0;
  double noise_m = 0.0;  ///< standard deviation of a reading
  /// Of what is read less what is true, metres, by the true depth and the place from -1 to 1 in the picture.
  std::function<double(double z, double x, double y)> error = [](double, double, double) { return 0.0; };
  std::vector<DepthBox> boxes;
  std::uint32_t seed = 1;

  cv::Mat render() const {
    cv::Mat out(height_px, width_px, CV_16UC1);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (int v = 0; v < height_px; ++v) {
      for (int u = 0; u < width_px; ++u) {
        const double z = depth(u, v);
        const double read =
            z + error(z, 2.0 * u / width_px - 1.0, 2.0 * v / height_px - 1.0) + noise_m * normal(random);
        out.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(std::lround(1000.0 * read));
      }
    }
    return out;
  }

  /// Of the first thing on the ray through a pixel: tops only, for the camera sees sides but at the very
  /// edge.
  double depth(int u, int v) const {
    double nearest = camera_height_m;
    for (const DepthBox& box : boxes) {
      const double z = camera_height_m - box.height;
      const double x = (u - (width_px - 1) / 2.0) / focal_px * z;
      const double y = -(v - (height_px - 1) / 2.0) / focal_px * z;
      if (std::abs(x - box.x) <= box.length / 2 && std::abs(y - box.y) <= box.width / 2)
        nearest = std::min(nearest, z);
    }
    return nearest;
  }
};

}  // namespace skylight::test
