#include "sim/camera/depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <opencv2/core/utility.hpp>

namespace skylight::sim {
namespace {

constexpr int kChunk = 64;  ///< pixels that are looked at together for an edge

/// A jump of depth from one pixel to the next that a time of flight camera mixes up, and no slope of a floor:
/// more than 10 mm + 1.5 % of the distance.
struct MixedEdge {
  static bool between(float a, float b) {
    return std::abs(a - b) > 0.01F + 0.015F * std::min(a, b) && a > 0.0F && b > 0.0F;
  }
};

/// Whether something left of `near` and farther away is hidden behind it from the second eye, by half a pixel
/// or more. `shift`: baseline times focal length and factor, px m.
bool hides(float far, float near, float shift) {
  return shift * (far - near) > 0.5F * far * near && near > 0.0F;
}

/// Drops what the thing whose left edge is at column `x` hides from the second eye.
void drop_shadow(const float* z, int x, float shift, std::uint16_t* out) {
  for (int at = x - 1; at >= 0; --at) {
    const float width = shift * (1.0F / z[x] - (z[at] > 0.0F ? 1.0F / z[at] : 0.0F));
    if (static_cast<float>(x - at) - 0.5F >= width) break;
    out[at] = 0;
  }
}

void drop_shadows(const float* z, int count, float shift, std::uint16_t* out) {
  for (int begin = 1; begin < count; begin += kChunk) {
    const int end = std::min(begin + kChunk, count);
    int edges = 0;
    for (int x = begin; x < end; ++x) {
      edges |= static_cast<int>(shift * (z[x - 1] - z[x]) > 0.5F * z[x - 1] * z[x]) &
               static_cast<int>(z[x] > 0.0F);
    }
    if (edges == 0) continue;
    for (int x = begin; x < end; ++x) {
      if (hides(z[x - 1], z[x], shift)) drop_shadow(z, x, shift, out);
    }
  }
}

/// Drops the pixels within `reach` of the edge before (x, y), along its row or its column.
void drop_beside(cv::Mat& depth, int x, int y, int reach) {
  auto* out = depth.ptr<std::uint16_t>(y);
  for (int at = std::max(0, x - reach); at < std::min(depth.cols, x + reach); ++at) out[at] = 0;
}
void drop_above(cv::Mat& depth, int x, int y, int reach) {
  for (int at = std::max(0, y - reach); at < std::min(depth.rows, y + reach); ++at)
    depth.ptr<std::uint16_t>(at)[x] = 0;
}

void drop_mixed(const cv::Mat& metres, int y, int reach, cv::Mat& depth) {
  const auto* z = metres.ptr<float>(y);
  const auto* above = metres.ptr<float>(std::max(0, y - 1));
  for (int begin = 1; begin < metres.cols; begin += kChunk) {
    const int end = std::min(begin + kChunk, metres.cols);
    int edges = 0;
    for (int x = begin; x < end; ++x) {
      const float left = std::abs(z[x] - z[x - 1]);
      const float up = std::abs(z[x] - above[x]);
      edges |= static_cast<int>(std::max(left, up) > 0.01F);
    }
    if (edges == 0) continue;
    for (int x = begin - (begin == 1 ? 1 : 0); x < end; ++x) {
      if (x > 0 && MixedEdge::between(z[x - 1], z[x])) drop_beside(depth, x, y, reach);
      if (MixedEdge::between(above[x], z[x])) drop_above(depth, x, y, reach);
    }
  }
}

/// How far things throw holes into a camera's depth.
struct Holes {
  explicit Holes(const CameraSpec& camera) {
    if (!camera.depth.noise || !(camera.depth.holes > 0.0)) return;
    const double baseline = depth_law(camera.depth).baseline_m;
    if (baseline > 0.0) {
      shift = static_cast<float>(camera.depth.holes * baseline * camera.fx_px);
    } else {
      reach = static_cast<int>(std::lround(camera.depth.holes));
    }
  }
  float shift = 0.0F;  ///< of a second eye, px m; 0: there is none
  int reach = 0;       ///< px that mix across a jump; 0: none
};

/// A number from -1 to 1 that is this camera's in every frame.
double camera_number(const NoiseStream& stream, std::uint64_t which) {
  const std::uint64_t x = mix(mix(stream.seed ^ 0x64657074685f6d6dULL) ^ (2 * stream.camera + which));
  return static_cast<double>(x >> 11) * 0x1p-52 - 1.0;
}

/// The parts of a row's work that are the same for all rows.
DepthRow depth_row(const DepthSpec& spec, const NoiseStream& stream) {
  DepthRow row{};
  row.factor = 1000.0F;
  row.levels = 1.0F;
  row.max_range = static_cast<float>(std::min(1000.0 * spec.max_range_m, 65534.0));
  if (!spec.noise) return row;
  const DepthLaw law = depth_law(spec);
  const double unit = 1000.0 / kNoiseSigma;
  const double growth = unit * law.growth;
  const auto set_sigma = [&](double constant, double linear, double square) {
    row.sigma[0] = static_cast<float>(unit * law.floor_m + growth * constant);
    row.sigma[1] = static_cast<float>(growth * linear);
    row.sigma[2] = static_cast<float>(growth * square);
  };
  row.in_disparity = spec.model != DepthModel::time_of_flight;
  row.levels = static_cast<float>(row.in_disparity ? 1e6 / spec.step_mm : 1.0 / spec.step_mm);
  switch (spec.model) {
    case DepthModel::structured_light:
      set_sigma(0.16, -0.8, 1.0);  // (z - 0.4)^2
      break;
    case DepthModel::stereo:
      set_sigma(0.0, 0.0, 1.0);
      break;
    case DepthModel::time_of_flight:
      set_sigma(0.0, 1.0, 0.0);
      row.offset = static_cast<float>(11.0 * camera_number(stream, 0));
      row.factor = static_cast<float>(1000.0 + camera_number(stream, 1));
      break;
  }
  return row;
}

}  // namespace

DepthLaw depth_law(const DepthSpec& spec) {
  DepthLaw law;
  switch (spec.model) {
    case DepthModel::structured_light:
      law = {0.0012, 0.0019, 0.075};
      break;
    case DepthModel::stereo:
      law = {0.0, 0.08 / (424.0 * 0.050), 0.050};
      break;
    case DepthModel::time_of_flight:
      law = {0.0, 0.017 / 3.86, 0.0};
      break;
  }
  law.floor_m = spec.noise_floor_m.value_or(law.floor_m);
  law.growth = spec.noise_growth.value_or(law.growth);
  return law;
}

double depth_sigma(const DepthSpec& spec, double z_m) {
  const DepthLaw law = depth_law(spec);
  switch (spec.model) {
    case DepthModel::structured_light:
      return law.floor_m + law.growth * (z_m - 0.4) * (z_m - 0.4);
    case DepthModel::stereo:
      return law.floor_m + law.growth * z_m * z_m;
    case DepthModel::time_of_flight:
      break;
  }
  return law.floor_m + law.growth * z_m;
}

void measure_depth(const cv::Mat& metres, const CameraSpec& camera, const NoiseStream& stream,
                   cv::Mat& depth) {
  CV_Assert(metres.type() == CV_32FC1);
  depth.create(metres.size(), CV_16UC1);
  const RowFunctions& functions = fast_rows();
  const NoiseKeys keys = noise_keys(stream);
  const Holes holes(camera);
  cv::parallel_for_(cv::Range(0, metres.rows), [&](const cv::Range& rows) {
    NoiseRow noise(metres.cols);
    DepthRow row = depth_row(camera.depth, stream);
    row.noise = noise.values.data();
    row.count = metres.cols;
    const auto blocks = static_cast<std::uint32_t>(noise.words.size() / 2);
    for (int y = rows.start; y < rows.end; ++y) {
      if (camera.depth.noise) functions.random(noise, static_cast<std::uint32_t>(y) * blocks, keys);
      row.metres = metres.ptr<float>(y);
      row.out = depth.ptr<std::uint16_t>(y);
      functions.depth(row);
      if (holes.shift > 0.0F) drop_shadows(row.metres, row.count, holes.shift, row.out);
    }
  });
  for (int y = 0; holes.reach > 0 && y < metres.rows; ++y) drop_mixed(metres, y, holes.reach, depth);
}

}  // namespace skylight::sim
