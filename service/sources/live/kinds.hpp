// What a configuration chooses of a live camera.
#pragma once

#include <cstdint>

namespace skylight::service {

/// What a camera may give. The names are V4L2's.
enum class PixelFormat : std::uint8_t { mjpg, yuyv, uyvy, nv12, grey, bgr3, rgb3 };

/// Of RTSP: in its own connection, or beside it, where what is lost is lost.
enum class StreamTransport : std::uint8_t { tcp, udp };

}  // namespace skylight::service
