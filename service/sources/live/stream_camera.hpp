// A camera in the network: RTSP, or HTTP (MJPEG, MPEG-TS, ...), decoded by FFmpeg's libraries.
//
// They are used directly, not through OpenCV: there the transport of RTSP is one environment variable for the
// whole process, a wait cannot be ended, decoding errors stay hidden, and threads in the decoder keep
// pictures back.
#pragma once

#include <memory>
#include <string>

#include "service/clock.hpp"
#include "service/sources/live/driver.hpp"
#include "service/sources/live/kinds.hpp"

namespace skylight::service {

struct StreamOptions {
  std::string url{};  ///< rtsp://, rtsps://, http:// or https://; may carry user and password
  StreamTransport transport = StreamTransport::tcp;  ///< of RTSP
  Duration open_timeout = std::chrono::seconds(10);
  Duration silence = std::chrono::seconds(5);  ///< without a picture for so long the stream has failed
  Clock clock = system_now;
};

/// Pictures carry the stream's presentation times as stamps. MJPEG over HTTP has none: its pictures are dated
/// by their arrival. A picture that the decoder calls damaged counts as unreadable. Files on this machine
/// cannot be reached, by no redirection either.
class StreamCamera final : public CameraDriver {
 public:
  explicit StreamCamera(StreamOptions options);
  ~StreamCamera() override;
  StreamCamera(const StreamCamera&) = delete;
  StreamCamera& operator=(const StreamCamera&) = delete;

  void open() override;
  Shot read() override;
  void close() override;
  void interrupt() override;

 private:
  class Stream;
  std::unique_ptr<Stream> stream_;
};

/// The address without user and password, for messages.
std::string without_password(const std::string& url);

}  // namespace skylight::service
