#include "service/sources/live/v4l2_system.hpp"

#include <array>
#include <cerrno>

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "service/sources/source.hpp"

namespace skylight::service {
namespace {

class Kernel final : public V4l2System {
 public:
  Kernel() : wake_fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (wake_fd_ < 0) throw SourceError("no event descriptor to be had");
  }
  ~Kernel() override { ::close(wake_fd_); }
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;

  int open(const std::string& path) override {
    const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd < 0 ? -errno : fd;
  }
  void close(int fd) override { ::close(fd); }
  int control(int fd, unsigned long request, void* argument) override {
    for (;;) {
      if (::ioctl(fd, request, argument) == 0) return 0;
      if (errno != EINTR) return errno;
    }
  }
  unsigned char* map(int fd, std::size_t length, std::int64_t offset) override {
    void* memory = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
    return memory == MAP_FAILED ? nullptr : static_cast<unsigned char*>(memory);
  }
  void unmap(unsigned char* memory, std::size_t length) override { ::munmap(memory, length); }
  Waited wait(int fd, Duration at_most) override {
    std::array<pollfd, 2> watched{{{fd, POLLIN, 0}, {wake_fd_, POLLIN, 0}}};
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(at_most).count();
    const int count = ::poll(watched.data(), watched.size(), static_cast<int>(ms));
    if (count < 0)
      return errno == EINTR ? Waited::ready : Waited::gone;  // ready: taking it says that it is not
    if (watched[1].revents != 0) return Waited::woken;
    if (count == 0) return Waited::timed_out;
    const bool gone = (watched[0].revents & (POLLHUP | POLLNVAL)) != 0;
    return gone ? Waited::gone : Waited::ready;
  }
  void wake() override {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written =
        ::write(wake_fd_, &one, sizeof one);  // full only where it was woken
  }
  Duration monotonic_now() override {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
  }

 private:
  int wake_fd_;
};

}  // namespace

std::unique_ptr<V4l2System> kernel_v4l2() {
  return std::make_unique<Kernel>();
}

}  // namespace skylight::service
