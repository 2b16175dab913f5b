// Every key of a live camera's source: its range, its unit, and what it is for.
#include "service/config.hpp"
#include "settings/fields.hpp"

namespace skylight::service {

using settings::Fields;

void describe(Fields& fields, V4l2Input& input) {
  fields.field(
      "device", input.device,
      {.pattern = "^/dev/.+",
       .pattern_words = "a path under /dev",
       .required = true,
       .help = "Under /dev/v4l/by-path a camera keeps its name; /dev/video0 is whichever came up first."});
  fields.choice("format", input.format,
                {{"MJPG", PixelFormat::mjpg},
                 {"YUYV", PixelFormat::yuyv},
                 {"UYVY", PixelFormat::uyvy},
                 {"NV12", PixelFormat::nv12},
                 {"GREY", PixelFormat::grey},
                 {"BGR3", PixelFormat::bgr3},
                 {"RGB3", PixelFormat::rgb3}},
                {.help = "Of its pixels, V4L2's name. Their number is that of the intrinsics."});
  fields.field("frame_rate_hz", input.frame_rate_hz, {.min = 0.5, .max = 1000, .unit = "Hz"});
  fields.field("exposure_us", input.exposure_us,
               {.min = 1, .max = 1'000'000, .unit = "us", .help = "Absent: automatic."});
  fields.field("gain", input.gain,
               {.min = 0, .max = 1'000'000, .help = "In the device's own units. Absent: automatic."});
  fields.field(
      "readout_us", input.readout_us,
      {.min = 0,
       .max = 100'000,
       .unit = "us",
       .help = "Of a rolling shutter, from the first row's start to the last one's; 0: global shutter."});
  fields.check(!input.exposure_us || *input.exposure_us * 1e-6 * input.frame_rate_hz <= 1.0, "exposure_us",
               "is longer than the time between two frames (frame_rate_hz)");
}

void describe(Fields& fields, StreamInput& input) {
  fields.field("url", input.url,
               {.max_length = 2000,
                .pattern = "^(rtsp|rtsps|http|https)://[^ ]+$",
                .pattern_words = "an address that begins with rtsp://, rtsps://, http:// or https://",
                .required = true,
                .help = "May carry user and password, which no answer and no log line shows."});
  fields.choice("transport", input.transport, {{"tcp", StreamTransport::tcp}, {"udp", StreamTransport::udp}},
                {.help = "Of RTSP."});
  fields.field("open_timeout_s", input.open_timeout_s,
               {.min = 0.1, .max = 120, .unit = "s", .help = "Until it has answered and sent a picture."});
}

void describe(Fields& fields, PostedInput& input) {
  fields.choice(
      "clock", input.clock, {{"ours", PostedClock::ours}, {"own", PostedClock::own}},
      {.help = "By which the pictures are stamped: this machine's (or one that is synchronised with it), "
               "or one of its own, whose offset is estimated."});
}

void describe(Fields& fields, ReconnectConfig& reconnect) {
  fields.about("How long to wait between attempts: twice as long after each.");
  fields.field("shortest_s", reconnect.shortest_s, {.min = 0.1, .max = 3600, .unit = "s"});
  fields.field("longest_s", reconnect.longest_s, {.min = 0.1, .max = 3600, .unit = "s"});
  fields.check(reconnect.shortest_s <= reconnect.longest_s, "longest_s", "is less than shortest_s");
}

void describe(Fields& fields, CameraSourceConfig& source) {
  fields.about("Where a live camera's frames come from.");
  fields.variant("type", source.input,
                 {{"v4l2", "A camera of this machine (Video4Linux)."},
                  {"stream", "A camera in the network: RTSP or HTTP."},
                  {"posted", "Another program posts them: POST /api/v1/cameras/{id}/frames."}},
                 {.required = true});
  fields.field(
      "latency_s", source.latency_s,
      {.min = -1,
       .max = 10,
       .unit = "s",
       .help = "What is to be subtracted from the time that a picture is given. v4l2, posted: of the stamps. "
               "stream: what the quickest picture takes to come."});
  fields.field(
      "frozen_after_s", source.frozen_after_s,
      {.min = 0,
       .max = 3600,
       .unit = "s",
       .help = "Of pictures equal to the last bit, none of which is tracked; 0: they are tracked as any."});
  fields.field(
      "silence_s", source.silence_s,
      {.min = 0.2, .max = 3600, .unit = "s", .help = "Without a picture for so long it has failed."});
  fields.field("reconnect", source.reconnect);
}

}  // namespace skylight::service
