// The few system calls that a V4L2 camera needs, so that a test can be the kernel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "tracker/types.hpp"

namespace skylight::service {

class V4l2System {
 public:
  enum class Waited : std::uint8_t { ready, timed_out, woken, gone };

  virtual ~V4l2System() = default;

  /// Read and write, not blocking. A descriptor, or the negative errno.
  virtual int open(const std::string& path) = 0;
  virtual void close(int fd) = 0;
  /// ioctl, again after EINTR. 0, or the errno.
  virtual int control(int fd, unsigned long request, void* argument) = 0;
  /// mmap shared; null on failure.
  virtual unsigned char* map(int fd, std::size_t length, std::int64_t offset) = 0;
  virtual void unmap(unsigned char* memory, std::size_t length) = 0;
  /// Until there is a buffer to take (or an error to be told by taking it).
  virtual Waited wait(int fd, Duration at_most) = 0;
  /// From another thread, for good: every wait() returns `woken`.
  virtual void wake() = 0;
  /// CLOCK_MONOTONIC, by which buffers are stamped.
  virtual Duration monotonic_now() = 0;
};

/// The kernel. Throws SourceError where it gives no event descriptor.
std::unique_ptr<V4l2System> kernel_v4l2();

}  // namespace skylight::service
