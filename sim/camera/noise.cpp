#include "sim/camera/noise.hpp"

#include <cmath>

namespace skylight::sim {
namespace {

double grey_per_electron(const SensorSpec& sensor) {
  return 255.0 * sensor.gain / sensor.full_well_e;
}

}  // namespace

std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

NoiseKeys noise_keys(const NoiseStream& stream) {
  const std::uint64_t x =
      mix(mix(mix(stream.seed) ^ (stream.camera * 2 + (stream.depth ? 1 : 0))) ^ stream.sequence);
  return {static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(x >> 32)};
}

double noise_sigma(const SensorSpec& sensor, double mean_grey) {
  if (!sensor.noise) return 0.0;
  const double read = sensor.read_noise_e * grey_per_electron(sensor);
  return std::sqrt(grey_per_electron(sensor) * mean_grey + read * read);
}

void expose(const SensorLight& light, const SensorSpec& sensor, const NoiseStream& stream, cv::Mat& image) {
  image.create(light.mean.size(), CV_8UC3);
  expose_rows(light, sensor, stream, {0, light.mean.rows}, image);
}

void expose_rows(const SensorLight& light, const SensorSpec& sensor, const NoiseStream& stream,
                 const cv::Range& rows, cv::Mat& image) {
  const cv::Mat& mean = light.mean;
  CV_Assert(mean.type() == CV_16UC3 && image.type() == CV_8UC3 && image.size() == mean.size());
  CV_Assert(light.rows.empty() || light.rows.size() == static_cast<std::size_t>(mean.rows));
  const RowFunctions& functions = fast_rows();
  const NoiseKeys keys = noise_keys(stream);
  const double per_electron = sensor.noise ? grey_per_electron(sensor) : 0.0;
  const double read = sensor.read_noise_e * per_electron;
  NoiseRow noise(mean.cols * 3);
  for (int y = rows.start; y < rows.end; ++y) {
    const RowLight at = light.rows.empty() ? RowLight{} : light.rows[static_cast<std::size_t>(y)];
    functions.random(
        noise, static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(noise.words.size() / 2), keys);
    const double unit = at.gain / kNoiseSigma;
    functions.expose({mean.ptr<std::uint16_t>(y), noise.values.data(), image.ptr<std::uint8_t>(y),
                      mean.cols * 3, at.gain * at.light / kGreyOne,
                      static_cast<float>(unit * unit * per_electron * at.light / kGreyOne),
                      static_cast<float>(unit * unit * read * read)});
  }
}

}  // namespace skylight::sim
