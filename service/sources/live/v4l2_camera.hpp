// A camera of this machine, through Video4Linux's streaming interface with mapped buffers (Linux Media User
// API, "Streaming I/O (Memory Mapping)").
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "service/clock.hpp"
#include "service/sources/live/driver.hpp"
#include "service/sources/live/exposure.hpp"
#include "service/sources/live/picture_bytes.hpp"
#include "service/sources/live/v4l2_system.hpp"

namespace skylight::service {

struct V4l2Options {
  std::string device{};  ///< by preference under /dev/v4l/by-path: video0 is whichever came up first
  PixelFormat format = PixelFormat::mjpg;
  cv::Size size_px{};
  double frame_rate_hz = 30.0;
  std::optional<int> exposure_us{};  ///< none: automatic
  std::optional<int> gain{};         ///< in the device's own units; none: automatic
  Duration readout{};                ///< of a rolling shutter, first row to last; 0: global, or unknown
  Duration silence = std::chrono::seconds(2);  ///< without a picture for so long the camera has failed
  Clock clock = system_now;
};

/// Frames are dated by the driver's stamps, brought to the exposure's midpoint (exposure.hpp) and from
/// CLOCK_MONOTONIC to Unix time; where a driver does not stamp by that clock, by their arrival. The exposure
/// time is that of the configuration, or the one that the device tells when it is opened; where it tells
/// none, 0. Gaps in the driver's sequence numbers are lost pictures; so are those that are overtaken while
/// one is decoded, since only the newest is.
class V4l2Camera final : public CameraDriver {
 public:
  V4l2Camera(V4l2Options options, std::unique_ptr<V4l2System> system);
  ~V4l2Camera() override;
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

  /// Throws SourceError: no such device, no camera, busy, what was asked for is not to be had (with what is).
  void open() override;
  Shot read() override;
  void close() override;
  void interrupt() override;

 private:
  struct Buffer {
    unsigned char* memory = nullptr;
    std::size_t length = 0;
  };
  struct Filled;  ///< a buffer that the driver has filled

  void check_capabilities();
  void set_format();
  std::string offered_formats();
  void set_frame_rate();
  void set_exposure();
  void set_gain();
  void map_buffers();
  void give_back(unsigned index);
  bool take(Filled& filled);
  std::uint64_t lost_before(std::uint32_t sequence);
  Shot picture_of(const Filled& filled);
  Time instant_of(const Filled& filled, Time arrived, Duration monotonic) const;
  void must(unsigned long request, void* argument, const std::string& what);
  bool set_control(unsigned id, int value);
  std::string range_of(unsigned id);

  V4l2Options options_;
  std::unique_ptr<V4l2System> system_;
  int fd_ = -1;
  bool streaming_ = false;
  std::size_t stride_ = 0;
  Exposure exposure_;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> sequence_;
  std::atomic<bool> interrupted_{false};
};

}  // namespace skylight::service
