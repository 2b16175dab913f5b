#include "sim/camera/exposure.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace skylight::sim {
namespace {

constexpr int kLevelSamples = 8;  ///< over the exposure, for a light that changes
constexpr int kJudgedEvery = 16;  ///< px between the places that auto-exposure looks at
constexpr double kDarkest = 1.0;  ///< grey level that it takes a black picture for

/// Mean of sin(2 pi f t) over `exposure_s` around `middle_s`.
double mean_sine(double frequency_hz, double middle_s, double exposure_s) {
  const double x = std::numbers::pi * frequency_hz * exposure_s;
  const double attenuation = x > 0.0 ? std::sin(x) / x : 1.0;
  return attenuation * std::sin(2.0 * std::numbers::pi * frequency_hz * middle_s);
}

double mean_grey(const cv::Mat& image) {
  std::int64_t sum = 0;
  std::int64_t count = 0;
  for (int y = kJudgedEvery / 2 % image.rows; y < image.rows; y += kJudgedEvery) {
    const auto* row = image.ptr<cv::Vec3b>(y);
    for (int x = kJudgedEvery / 2 % image.cols; x < image.cols; x += kJudgedEvery) {
      sum += row[x][0] + row[x][1] + row[x][2];
      count += 3;
    }
  }
  return static_cast<double>(sum) / static_cast<double>(count);
}

}  // namespace

Duration row_delay(const CameraSpec& camera, double row) {
  if (camera.shutter == Shutter::global || camera.height_px < 2) return Duration{0};
  const double last = camera.height_px - 1;
  return from_seconds((row - 0.5 * last) / last * camera.readout_s);
}

ExposureControl::ExposureControl(const CameraSpec& camera, const FlickerSpec& flicker)
    : camera_(camera), flicker_(flicker) {}

RowLight ExposureControl::light(Duration row_middle, const Level& level) const {
  double mean_level = 0.0;
  for (int i = 0; i < kLevelSamples; ++i) {
    const double share = (i + 0.5) / kLevelSamples - 0.5;
    mean_level += level(row_middle + from_seconds(share * camera_.exposure_s)) / kLevelSamples;
  }
  const double flicker =
      1.0 + flicker_.depth * mean_sine(flicker_.frequency_hz, to_seconds(row_middle), camera_.exposure_s);
  return {static_cast<float>(mean_level * flicker * std::min(1.0, factor_)),
          static_cast<float>(std::max(1.0, factor_))};
}

std::vector<RowLight> ExposureControl::rows(Duration middle, const Level& level) const {
  const auto count = static_cast<std::size_t>(camera_.height_px);
  if (camera_.shutter == Shutter::global) return std::vector<RowLight>(count, light(middle, level));
  std::vector<RowLight> rows(count);
  for (std::size_t y = 0; y < count; ++y)
    rows[y] = light(middle + row_delay(camera_, static_cast<double>(y)), level);
  return rows;
}

void ExposureControl::observe(const cv::Mat& image, Duration dt) {
  CV_Assert(image.type() == CV_8UC3);
  const AutoExposureSpec& spec = camera_.auto_exposure;
  if (!spec.enabled || image.empty()) return;
  const double share = spec.lag_s > 0.0 ? 1.0 - std::exp(-to_seconds(dt) / spec.lag_s) : 1.0;
  factor_ *= std::pow(spec.target_grey / std::max(mean_grey(image), kDarkest), share);
  factor_ = std::clamp(factor_, 1.0 / spec.max_factor, spec.max_factor);
}

}  // namespace skylight::sim
