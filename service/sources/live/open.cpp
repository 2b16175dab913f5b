#include "service/sources/live/open.hpp"

#include <utility>

#include "service/sources/live/posted_camera.hpp"
#include "service/sources/live/stream_camera.hpp"
#include "service/sources/live/v4l2_camera.hpp"

namespace skylight::service {
namespace {

/// Makes the driver of one camera.
struct Opener {
  const CameraConfig& camera;
  const CameraSourceConfig& source;
  cv::Size size_px;
  const Clock& clock;
  PostedCameras& posted;

  Duration silence() const { return from_seconds(source.silence_s); }

  std::unique_ptr<CameraDriver> operator()(const V4l2Input& input) const {
    return std::make_unique<V4l2Camera>(V4l2Options{.device = input.device,
                                                    .format = input.format,
                                                    .size_px = size_px,
                                                    .frame_rate_hz = input.frame_rate_hz,
                                                    .exposure_us = input.exposure_us,
                                                    .gain = input.gain,
                                                    .readout = std::chrono::microseconds(input.readout_us),
                                                    .silence = silence(),
                                                    .clock = clock},
                                        kernel_v4l2());
  }
  std::unique_ptr<CameraDriver> operator()(const StreamInput& input) const {
    return std::make_unique<StreamCamera>(StreamOptions{.url = input.url,
                                                        .transport = input.transport,
                                                        .open_timeout = from_seconds(input.open_timeout_s),
                                                        .silence = silence(),
                                                        .clock = clock});
  }
  std::unique_ptr<CameraDriver> operator()(const PostedInput& input) const {
    auto pictures = std::make_shared<PostedPictures>(PostedOptions{
        .size_px = size_px, .synchronised = input.clock == PostedClock::ours, .silence = silence()});
    posted[camera.id] = pictures;
    return std::make_unique<PostedCamera>(std::move(pictures));
  }
};

std::string kind_of(const CameraSourceConfig& source) {
  constexpr const char* kKinds[] = {"v4l2", "stream", "posted"};
  return kKinds[source.input.index()];
}

FeedOptions feed_options(const CameraSourceConfig& source, cv::Size size_px, const Clock& clock) {
  FeedOptions options;
  options.kind = kind_of(source);
  options.size_px = size_px;
  options.latency = from_seconds(source.latency_s);
  options.frozen_after = from_seconds(source.frozen_after_s);
  options.shortest_rest = from_seconds(source.reconnect.shortest_s);
  options.longest_rest = from_seconds(source.reconnect.longest_s);
  options.clock = clock;
  return options;
}

}  // namespace

OpenedCameras open_cameras(const Config& config, const Clock& clock) {
  OpenedCameras out;
  std::vector<LiveCameras::Camera> cameras;
  for (const CameraConfig& camera : config.cameras) {
    const CameraSourceConfig& source = camera.source.value();
    const Intrinsics intrinsics = camera_model(camera).intrinsics();
    const cv::Size size_px(intrinsics.width_px, intrinsics.height_px);
    const Opener opener{camera, source, size_px, clock, out.posted};
    LiveCameras::Camera& live = cameras.emplace_back();
    live.options = feed_options(source, size_px, clock);
    live.driver = std::visit(opener, source.input);
  }
  out.source = std::make_shared<LiveCameras>(std::move(cameras));
  return out;
}

}  // namespace skylight::service
