// A kernel with one camera that does what a test says. It holds whoever uses it to the protocol: buffers are
// asked for, mapped, queued and taken in turn, and given back before the descriptor is closed.
#pragma once

#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "service/sources/live/v4l2_system.hpp"

namespace skylight::service::test {

/// What the device is, and what happened to it.
struct Device {
  struct Filled {
    std::vector<unsigned char> bytes;
    Duration stamp{};
    std::uint32_t sequence = 0;
    std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
    int error = 0;  ///< instead of a buffer
  };

  int open_error = 0;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY};
  std::uint32_t width = 4, height = 2;  ///< the only size that it gives
  std::uint32_t stride = 4;
  double frame_rate_hz = 30.0;
  std::map<std::uint32_t, int> controls;                ///< those that it has, with their values
  std::map<std::uint32_t, std::pair<int, int>> ranges;  ///< beyond which it refuses
  Duration monotonic = std::chrono::seconds(5000);
  std::deque<std::vector<Filled>> turns;  ///< what is there each time that somebody has waited

  int opened = 0, closed = 0, mapped = 0, unmapped = 0;
  bool streaming = false;
  bool woken = false;
};

class FakeV4l2 final : public V4l2System {
 public:
  explicit FakeV4l2(std::shared_ptr<Device> device) : device_(std::move(device)) {}

  int open(const std::string&) override {
    if (device_->open_error != 0) return -device_->open_error;
    ++device_->opened;
    return 42;
  }
  void close(int) override {
    EXPECT_FALSE(device_->streaming) << "closed while it streams";
    EXPECT_EQ(device_->mapped, device_->unmapped) << "closed with buffers mapped";
    ++device_->closed;
    memory_.clear();
    queued_.clear();
  }
  unsigned char* map(int, std::size_t length, std::int64_t offset) override {
    EXPECT_EQ(length, kLength);
    ++device_->mapped;
    return memory_.at(static_cast<std::size_t>(offset)).data();
  }
  void unmap(unsigned char*, std::size_t) override { ++device_->unmapped; }
  Waited wait(int, Duration) override {
    EXPECT_TRUE(device_->streaming);
    if (device_->woken) return Waited::woken;
    if (device_->turns.empty()) return Waited::timed_out;
    ready_.assign(device_->turns.front().begin(), device_->turns.front().end());
    device_->turns.pop_front();
    return Waited::ready;
  }
  void wake() override { device_->woken = true; }
  Duration monotonic_now() override { return device_->monotonic; }

  int control(int, unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = device_->capabilities;
        return 0;
      case VIDIOC_ENUM_FMT:
        return enumerate(*static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_S_FMT:
        return set_format(static_cast<v4l2_format*>(argument)->fmt.pix);
      case VIDIOC_S_PARM:
        static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {
            1000, static_cast<std::uint32_t>(device_->frame_rate_hz * 1000)};
        return 0;
      case VIDIOC_QUERYCTRL:
        return query(*static_cast<v4l2_queryctrl*>(argument));
      case VIDIOC_S_CTRL:
        return set(*static_cast<v4l2_control*>(argument));
      case VIDIOC_G_CTRL:
        return get(*static_cast<v4l2_control*>(argument));
      default:
        return stream(request, argument);
    }
  }

 private:
  static constexpr std::size_t kLength = 64;

  int enumerate(v4l2_fmtdesc& description) const {
    if (description.index >= device_->formats.size()) return EINVAL;
    description.pixelformat = device_->formats[description.index];
    return 0;
  }
  // A driver adjusts what it cannot give instead of refusing it.
  int set_format(v4l2_pix_format& pix) const {
    bool known = false;
    for (const std::uint32_t format : device_->formats) known = known || format == pix.pixelformat;
    if (!known) pix.pixelformat = device_->formats.front();
    pix.width = device_->width;
    pix.height = device_->height;
    pix.bytesperline = device_->stride;
    return 0;
  }
  int query(v4l2_queryctrl& query) const {
    const auto range = device_->ranges.find(query.id);
    if (range == device_->ranges.end()) return EINVAL;
    query.minimum = range->second.first;
    query.maximum = range->second.second;
    return 0;
  }
  int set(const v4l2_control& control) const {
    const auto at = device_->controls.find(control.id);
    if (at == device_->controls.end()) return EINVAL;
    const auto range = device_->ranges.find(control.id);
    if (range != device_->ranges.end() &&
        (control.value < range->second.first || control.value > range->second.second))
      return ERANGE;
    at->second = control.value;
    return 0;
  }
  int get(v4l2_control& control) const {
    const auto at = device_->controls.find(control.id);
    if (at == device_->controls.end()) return EINVAL;
    control.value = at->second;
    return 0;
  }
  int stream(unsigned long request, void* argument) {
    switch (request) {
      case VIDIOC_REQBUFS:
        memory_.assign(static_cast<v4l2_requestbuffers*>(argument)->count,
                       std::vector<unsigned char>(kLength));
        return 0;
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        buffer.length = kLength;
        buffer.m.offset = buffer.index;
        return 0;
      }
      case VIDIOC_QBUF:
        queued_.push_back(static_cast<v4l2_buffer*>(argument)->index);
        EXPECT_LE(queued_.size(), memory_.size()) << "given back twice";
        return 0;
      case VIDIOC_DQBUF:
        return take(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
      case VIDIOC_STREAMOFF:
        device_->streaming = request == VIDIOC_STREAMON;
        return 0;
      default:
        return ENOTTY;
    }
  }
  int take(v4l2_buffer& buffer) {
    if (ready_.empty()) return EAGAIN;
    const Device::Filled filled = ready_.front();
    ready_.pop_front();
    if (filled.error != 0) return filled.error;
    EXPECT_FALSE(queued_.empty()) << "no buffer was given back";
    if (queued_.empty()) return EAGAIN;
    buffer.index = queued_.front();
    queued_.pop_front();
    std::memcpy(memory_[buffer.index].data(), filled.bytes.data(), filled.bytes.size());
    buffer.bytesused = static_cast<std::uint32_t>(filled.bytes.size());
    buffer.flags = filled.flags;
    buffer.sequence = filled.sequence;
    buffer.timestamp.tv_sec = filled.stamp / std::chrono::seconds(1);
    buffer.timestamp.tv_usec = filled.stamp % std::chrono::seconds(1) / std::chrono::microseconds(1);
    return 0;
  }

  std::shared_ptr<Device> device_;
  std::vector<std::vector<unsigned char>> memory_;
  std::deque<std::uint32_t> queued_;
  std::deque<Device::Filled> ready_;
};

}  // namespace skylight::service::test
