#include "service/sources/live/v4l2_camera.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <system_error>
#include <utility>

#include <linux/videodev2.h>

namespace skylight::service {
namespace {

constexpr unsigned kBuffers = 4;

std::string words(int error) {
  return std::generic_category().message(error);
}

std::uint32_t fourcc(PixelFormat format) {
  const std::string_view name = to_string(format);
  return v4l2_fourcc(name[0], name[1], name[2], name[3]);
}

std::string fourcc_text(std::uint32_t code) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) {
    const auto letter = static_cast<char>((code >> shift) & 0x7f);
    if (letter > ' ') text += letter;
  }
  return text;
}

std::string format_text(const v4l2_pix_format& format) {
  return std::to_string(format.width) + " x " + std::to_string(format.height) + " " +
         fourcc_text(format.pixelformat);
}

template <class T>
T of_capture() {
  T out{};
  out.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return out;
}

v4l2_buffer mapped_buffer(unsigned index) {
  auto buffer = of_capture<v4l2_buffer>();
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

std::string number_text(double value) {
  std::string text = std::to_string(std::round(value * 100.0) / 100.0);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace

struct V4l2Camera::Filled {
  unsigned index = 0;
  std::size_t bytes = 0;
  std::uint32_t flags = 0;
  Duration stamp{};
  std::uint64_t lost = 0;
  bool bad = false;
};

V4l2Camera::V4l2Camera(V4l2Options options, std::unique_ptr<V4l2System> system)
    : options_(std::move(options)), system_(std::move(system)) {}

V4l2Camera::~V4l2Camera() {
  close();
}

void V4l2Camera::must(unsigned long request, void* argument, const std::string& what) {
  if (const int error = system_->control(fd_, request, argument); error != 0)
    throw SourceError(options_.device + ": " + what + ": " + words(error));
}

void V4l2Camera::open() {
  if (interrupted_) throw SourceError(options_.device + ": interrupted");
  close();
  fd_ = system_->open(options_.device);
  if (fd_ < 0) {
    const int error = -std::exchange(fd_, -1);
    const char* hint = error == EACCES ? " (is the user in the group video?)" : "";
    throw SourceError(options_.device + ": " + words(error) + hint);
  }
  check_capabilities();
  set_format();
  set_frame_rate();
  set_exposure();
  set_gain();
  map_buffers();
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  must(VIDIOC_STREAMON, &type, "does not start");
  streaming_ = true;
  sequence_.reset();
}

void V4l2Camera::check_capabilities() {
  v4l2_capability capability{};
  must(VIDIOC_QUERYCAP, &capability, "no video device");
  const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                  : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0)
    throw SourceError(options_.device + ": no camera that streams (a webcam has a second node for metadata)");
}

void V4l2Camera::set_format() {
  auto format = of_capture<v4l2_format>();
  v4l2_pix_format& pix = format.fmt.pix;
  pix.width = static_cast<std::uint32_t>(options_.size_px.width);
  pix.height = static_cast<std::uint32_t>(options_.size_px.height);
  pix.pixelformat = fourcc(options_.format);
  pix.field = V4L2_FIELD_NONE;
  v4l2_pix_format wanted = pix;
  must(VIDIOC_S_FMT, &format, "takes no format");
  if (pix.width != wanted.width || pix.height != wanted.height || pix.pixelformat != wanted.pixelformat) {
    throw SourceError(options_.device + ": gives " + format_text(pix) + ", asked for " + format_text(wanted) +
                      "; it offers " + offered_formats());
  }
  // A driver states the first plane's rows, and nothing of use for compressed pictures.
  stride_ = options_.format == PixelFormat::mjpg ? 0 : pix.bytesperline;
}

std::string V4l2Camera::offered_formats() {
  std::string out;
  for (unsigned i = 0; i < 64; ++i) {
    auto description = of_capture<v4l2_fmtdesc>();
    description.index = i;
    if (system_->control(fd_, VIDIOC_ENUM_FMT, &description) != 0) break;
    out += (out.empty() ? "" : ", ") + fourcc_text(description.pixelformat);
  }
  return out.empty() ? "no format that it names" : out;
}

// Devices without a choice refuse the call: then what comes is what there is.
void V4l2Camera::set_frame_rate() {
  auto parameters = of_capture<v4l2_streamparm>();
  constexpr std::uint32_t kPerSecond = 1000;
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  interval.numerator = kPerSecond;
  interval.denominator = static_cast<std::uint32_t>(std::lround(options_.frame_rate_hz * kPerSecond));
  if (system_->control(fd_, VIDIOC_S_PARM, &parameters) != 0 || interval.numerator == 0) return;
  const double given = static_cast<double>(interval.denominator) / interval.numerator;
  if (std::abs(given - options_.frame_rate_hz) > 0.05 * options_.frame_rate_hz) {
    throw SourceError(options_.device + ": gives " + number_text(given) +
                      " frames/s at this size and format, asked for " + number_text(options_.frame_rate_hz));
  }
}

bool V4l2Camera::set_control(unsigned id, int value) {
  v4l2_control control{.id = id, .value = value};
  return system_->control(fd_, VIDIOC_S_CTRL, &control) == 0;
}

std::string V4l2Camera::range_of(unsigned id) {
  v4l2_queryctrl query{};
  query.id = id;
  if (system_->control(fd_, VIDIOC_QUERYCTRL, &query) != 0) return "the device has no such control";
  const int unit = id == V4L2_CID_EXPOSURE_ABSOLUTE ? 100 : 1;  // microseconds
  return "allowed " + std::to_string(query.minimum * unit) + " to " + std::to_string(query.maximum * unit);
}

// V4L2_CID_EXPOSURE_ABSOLUTE counts in 100 microseconds (Linux Media User API, "Camera Control Reference").
void V4l2Camera::set_exposure() {
  set_control(V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0);  // in the dark the frame rate would fall
  if (options_.exposure_us) {
    const int wanted = static_cast<int>(std::lround(*options_.exposure_us / 100.0));
    set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
    if (!set_control(V4L2_CID_EXPOSURE_ABSOLUTE, wanted)) {
      throw SourceError(options_.device + ": exposure_us: " + std::to_string(*options_.exposure_us) +
                        " is refused, " + range_of(V4L2_CID_EXPOSURE_ABSOLUTE));
    }
  } else if (!set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY)) {
    set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO);
  }
  v4l2_control control{.id = V4L2_CID_EXPOSURE_ABSOLUTE, .value = 0};
  const bool told = system_->control(fd_, VIDIOC_G_CTRL, &control) == 0 && control.value > 0;
  exposure_ = {.time = told ? control.value * std::chrono::microseconds(100) : Duration{},
               .readout = options_.readout};
  if (options_.exposure_us) exposure_.time = std::chrono::microseconds(*options_.exposure_us);
}

void V4l2Camera::set_gain() {
  set_control(V4L2_CID_AUTOGAIN, options_.gain ? 0 : 1);  // webcams have none: exposure's automatic does both
  if (options_.gain && !set_control(V4L2_CID_GAIN, *options_.gain)) {
    throw SourceError(options_.device + ": gain: " + std::to_string(*options_.gain) + " is refused, " +
                      range_of(V4L2_CID_GAIN));
  }
}

void V4l2Camera::map_buffers() {
  auto request = of_capture<v4l2_requestbuffers>();
  request.memory = V4L2_MEMORY_MMAP;
  request.count = kBuffers;
  must(VIDIOC_REQBUFS, &request, "gives no buffers");
  for (unsigned i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = mapped_buffer(i);
    must(VIDIOC_QUERYBUF, &buffer, "does not tell its buffers");
    unsigned char* memory = system_->map(fd_, buffer.length, buffer.m.offset);
    if (memory == nullptr) throw SourceError(options_.device + ": its buffers cannot be mapped");
    buffers_.push_back({memory, buffer.length});
    give_back(i);
  }
  if (buffers_.empty()) throw SourceError(options_.device + ": gives no buffers");
}

void V4l2Camera::give_back(unsigned index) {
  v4l2_buffer buffer = mapped_buffer(index);
  must(VIDIOC_QBUF, &buffer, "takes no buffer back");
}

// False where none is filled.
bool V4l2Camera::take(Filled& filled) {
  v4l2_buffer buffer = mapped_buffer(0);
  const int error = system_->control(fd_, VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return false;
  if (error == ENODEV) throw SourceError(options_.device + ": unplugged");
  if (error != 0) throw SourceError(options_.device + ": reading fails: " + words(error));
  if (buffer.index >= buffers_.size())
    throw SourceError(options_.device + ": names a buffer that it never gave");
  filled.index = buffer.index;
  filled.bytes = std::min<std::size_t>(buffer.bytesused, buffers_[buffer.index].length);
  filled.flags = buffer.flags;
  filled.stamp =
      std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec);
  filled.bad = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  filled.lost += lost_before(buffer.sequence);
  return true;
}

// The sequence is 32 bits and wraps; one that goes back has begun anew.
std::uint64_t V4l2Camera::lost_before(std::uint32_t sequence) {
  const auto gap = static_cast<std::int32_t>(sequence - sequence_.value_or(sequence - 1));
  sequence_ = sequence;
  return gap > 1 ? static_cast<std::uint64_t>(gap - 1) : 0;
}

Shot V4l2Camera::read() {
  Filled filled;
  do {
    if (interrupted_) throw SourceError(options_.device + ": interrupted");
    switch (system_->wait(fd_, options_.silence)) {
      case V4l2System::Waited::ready:
        break;
      case V4l2System::Waited::timed_out:
        throw SourceError(options_.device + ": no picture for " + number_text(to_seconds(options_.silence)) +
                          " s");
      case V4l2System::Waited::woken:
        throw SourceError(options_.device + ": interrupted");
      case V4l2System::Waited::gone:
        throw SourceError(options_.device + ": unplugged");
    }
  } while (!take(filled));
  // While the last one was decoded more may have come: only the newest counts.
  for (Filled newer = filled; take(newer); filled = newer) {
    give_back(filled.index);
    ++newer.lost;
  }
  Shot picture = picture_of(filled);
  give_back(filled.index);
  return picture;
}

Shot V4l2Camera::picture_of(const Filled& filled) {
  const Duration monotonic = system_->monotonic_now();
  Shot picture{.arrived = options_.clock(), .lost = filled.lost};
  picture.captured = instant_of(filled, picture.arrived, monotonic);
  if (filled.bad || filled.bytes == 0) {
    picture.unreadable = "the driver marks it as damaged";
    return picture;
  }
  try {
    picture.image =
        decode_raw({buffers_[filled.index].memory, filled.bytes}, options_.format, options_.size_px, stride_);
  } catch (const SourceError& error) {
    picture.unreadable = error.what();
  }
  return picture;
}

Time V4l2Camera::instant_of(const Filled& filled, Time arrived, Duration monotonic) const {
  if ((filled.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) return arrived;
  const bool start = (filled.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  return exposure_midpoint(arrived - (monotonic - filled.stamp),
                           start ? StampSource::start_of_exposure : StampSource::end_of_frame, exposure_);
}

void V4l2Camera::close() {
  if (fd_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (std::exchange(streaming_, false)) system_->control(fd_, VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) system_->unmap(buffer.memory, buffer.length);
  buffers_.clear();
  system_->close(std::exchange(fd_, -1));
}

void V4l2Camera::interrupt() {
  interrupted_ = true;
  system_->wake();
}

}  // namespace skylight::service
