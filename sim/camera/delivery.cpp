#include "sim/camera/delivery.hpp"

#include <algorithm>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "sim/camera/exposure.hpp"
#include "sim/camera/noise.hpp"

namespace skylight::sim {
namespace {

constexpr std::uint64_t kDeliveryStreams = 0x64656c6976657279ULL;  ///< apart from the sensor's

/// 0 to 1, 1 excluded: the upper 53 bits.
double share_of(std::uint64_t random) {
  return static_cast<double>(random >> 11) * 0x1p-53;
}

}  // namespace

Delivery::Delivery(const CameraSpec& camera, std::uint64_t seed, std::uint64_t camera_index)
    : camera_(camera), stream_(mix(mix(seed ^ kDeliveryStreams) ^ camera_index)) {}

Delivered Delivery::deliver(std::uint64_t sequence, Duration middle) {
  const DeliverySpec& spec = camera_.delivery;
  const std::uint64_t frame = mix(stream_ ^ sequence);
  Delivered result;
  result.stamp = middle + from_seconds(spec.clock_offset_s) +
                 from_seconds(to_seconds(middle) * spec.clock_drift_ppm * 1e-6);
  result.lost = share_of(mix(frame ^ 1)) < spec.drop_share;
  const Duration end =
      middle + row_delay(camera_, camera_.height_px - 1.0) + from_seconds(0.5 * camera_.exposure_s);
  result.at = end + from_seconds(spec.latency_s) + from_seconds(spec.jitter_s * share_of(mix(frame ^ 2)));
  if (result.lost) return result;
  result.at = latest_ = std::max(latest_, result.at);
  return result;
}

void compress(int quality, cv::Mat& image) {
  std::vector<std::uint8_t> file;
  cv::imencode(".jpg", image, file, {cv::IMWRITE_JPEG_QUALITY, quality});
  image = cv::imdecode(file, cv::IMREAD_COLOR);
}

}  // namespace skylight::sim
