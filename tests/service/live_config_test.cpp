// How live cameras are configured, and which contradictions are refused.
#include <gtest/gtest.h>

#include "service/config.hpp"
#include "settings/fields.hpp"

namespace skylight::service {
namespace {

Config read(const std::string& text) {
  return settings::read<Config>(settings::parse(text, "my.json"));
}

/// A configuration whose camera `c` has this source (without: none), and these further keys.
std::string with_source(const std::string& source, const std::string& further = {}) {
  const std::string camera =
      R"({"id": "c", "overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [1000, 800]})";
  return R"({"source": {"type": "cameras"}, "cameras": [)" + camera +
         (source.empty() ? "" : ", \"source\": " + source) + "}]" + further + "}";
}

std::string refusal(const std::string& text) {
  try {
    read(text);
  } catch (const settings::Error& error) {
    const std::string what = error.what();
    return what.substr(what.find(' ') + 1);
  }
  return "accepted";
}

TEST(LiveConfig, EachKindOfSourceIsRead) {
  const auto source = [](const std::string& text) {
    return read(with_source(text)).cameras.at(0).source.value();
  };
  const auto v4l2 =
      source(R"({"type": "v4l2", "device": "/dev/video0", "format": "YUYV", "exposure_us": 500})");
  EXPECT_EQ(std::get<V4l2Input>(v4l2.input).format, PixelFormat::yuyv);
  EXPECT_EQ(std::get<V4l2Input>(v4l2.input).exposure_us, 500);
  EXPECT_FALSE(std::get<V4l2Input>(v4l2.input).gain) << "automatic";
  const auto stream =
      source(R"({"type": "stream", "url": "rtsp://cam/1", "transport": "udp", "latency_s": 0.1})");
  EXPECT_EQ(std::get<StreamInput>(stream.input).transport, StreamTransport::udp);
  EXPECT_EQ(stream.latency_s, 0.1);
  EXPECT_EQ(stream.frozen_after_s, 2.0);
  EXPECT_EQ(stream.reconnect.longest_s, 10.0);
  const auto posted = source(R"({"type": "posted", "clock": "own", "frozen_after_s": 0})");
  EXPECT_EQ(std::get<PostedInput>(posted.input).clock, PostedClock::own);
}

TEST(LiveConfig, ASourceThatIsNotUsedIsNoContradiction) {
  // The same file serves to play a recording or a scenario.
  EXPECT_EQ(refusal(R"({"cameras": [{"id": "c", "source": {"type": "posted"}, "overhead": {"height_m": 4,
                        "metres_per_pixel": 0.004, "size_px": [1000, 800]}}]})"),
            "accepted");
}

TEST(LiveConfig, WhatIsMissingOrContradictsIsNamed) {
  const std::pair<std::string, std::string> refused[] = {
      {R"({"source": {"type": "cameras"}})", "source.type: is cameras, and there are none in cameras"},
      {with_source(""), "cameras[0].source: is missing: source.type is cameras"},
      {with_source("{}"), "cameras[0].source.type: is missing: one of v4l2, stream or posted"},
      {with_source(R"({"type": "v4l2"})"),
       "cameras[0].source.device: is missing: Under /dev/v4l/by-path a camera keeps its name; /dev/video0 is "
       "whichever came up first."},
      {with_source(R"({"type": "v4l2", "device": "video0"})"),
       "cameras[0].source.device: \"video0\" is not a path under /dev"},
      {with_source(R"({"type": "v4l2", "device": "/dev/video0", "frame_rate_hz": 60, "exposure_us": 20000})"),
       "cameras[0].source.exposure_us: is longer than the time between two frames (frame_rate_hz)"},
      {with_source(R"({"type": "stream", "url": "file:///etc/passwd"})"),
       "cameras[0].source.url: \"file:///etc/passwd\" is not an address that begins with rtsp://, rtsps://, "
       "http:// "
       "or https://"},
      {with_source(R"({"type": "posted", "reconnect": {"shortest_s": 5, "longest_s": 1}})"),
       "cameras[0].source.reconnect.longest_s: is less than shortest_s"},
      {with_source(R"({"type": "posted", "frozen_after_s": -1})"),
       "cameras[0].source.frozen_after_s: -1 is out of range, allowed 0 to 3600 s"},
      {with_source(R"({"type": "posted"})", R"(, "appearances": [{"id": "a", "cut_from_frame": {"camera": "c",
                    "box_px": [0, 0, 9, 9]}}])"),
       "appearances[0].cut_from_frame: contradicts source.type cameras, whose first frame is another one "
       "each time: "
       "draw the box over the API (POST /api/v1/appearances)"},
  };
  for (const auto& [text, what] : refused) EXPECT_EQ(refusal(text), what) << text;
}

TEST(LiveConfig, TwoCamerasCannotHaveOneDevice) {
  const std::string camera =
      R"({"overhead": {"height_m": 4, "metres_per_pixel": 0.004, "size_px": [10, 8]},
          "source": {"type": "v4l2", "device": "/dev/video0"}, "id": ")";
  EXPECT_EQ(
      refusal(R"({"source": {"type": "cameras"}, "cameras": [)" + camera + "a\"}, " + camera + "b\"}]}"),
      "cameras[1].source.device: \"/dev/video0\" is the device of cameras[0] too");
}

}  // namespace
}  // namespace skylight::service
