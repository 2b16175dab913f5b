#include "service/http/server.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include <sys/resource.h>

#include "service/http/front.hpp"
#include "service/http/static_files.hpp"

namespace skylight::http {
namespace {

// Files, cameras and the like beside the connections.
constexpr rlim_t kOtherDescriptors = 256;

void check_range(std::string_view name, std::size_t value, std::size_t least, std::size_t most) {
  if (value >= least && value <= most) return;
  throw std::invalid_argument("http server: " + std::string(name) + " is " + std::to_string(value) +
                              ", allowed are " + std::to_string(least) + " to " + std::to_string(most));
}

void check_deadline(std::string_view name, std::chrono::milliseconds value) {
  if (value.count() > 0 && value <= std::chrono::hours(24)) return;
  throw std::invalid_argument("http server: deadline " + std::string(name) + " is " +
                              std::to_string(value.count()) + " ms, allowed are 1 ms to 24 h");
}

void check(const ServerOptions& options) {
  constexpr std::size_t kGigabyte = std::size_t{1} << 30U;
  check_range("quick_threads", options.quick_threads, 1, 64);
  check_range("slow_threads", options.slow_threads, 1, 64);
  check_range("slow_queue", options.slow_queue, 0, 100'000);
  check_range("max_body_bytes", options.max_body_bytes, 0, kGigabyte);
  check_range("max_bodies_bytes", options.max_bodies_bytes, options.max_body_bytes, 16 * kGigabyte);
  check_range("max_header_bytes", options.max_header_bytes, 1024, 1024 * 1024);
  check_range("max_target_bytes", options.max_target_bytes, 64, 8000);
  check_range("max_connections", options.max_connections, 1, 100'000);
  check_deadline("idle", options.deadlines.idle);
  check_deadline("head", options.deadlines.head);
  check_deadline("body", options.deadlines.body);
  check_deadline("write", options.deadlines.write);
  check_deadline("linger", options.deadlines.linger);
  check_deadline("stop", options.deadlines.stop);
}

// As far as the connections need it, and no further: select() elsewhere in the process breaks above 1024.
void raise_descriptor_limit(const ServerOptions& options) {
  const rlim_t needed = options.max_connections + kOtherDescriptors;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= needed) return;
  limit.rlim_cur = std::min(needed, limit.rlim_max);
  const bool raised = setrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur >= needed;
  if (!raised && options.log) {
    options.log("http: " + std::to_string(limit.rlim_cur) + " file descriptors are too few for " +
                std::to_string(options.max_connections) + " connections");
  }
}

}  // namespace

class Server::Impl {
 public:
  Impl(ServerOptions options, Router router, std::vector<StaticFile> files)
      : options_(std::move(options)), router_(std::move(router)), files_(std::move(files)) {
    check(options_);
    for (const Route& route : router_.routes()) {
      check_range("max_body_bytes of " + route.pattern, route.options.max_body_bytes, 0,
                  options_.max_bodies_bytes);
    }
  }
  ~Impl() { stop(); }

  void start() {
    if (front_) throw std::logic_error("http server: started twice");
    raise_descriptor_limit(options_);
    auto front = std::make_unique<Front>(options_, router_, files_);
    port_ = front->listen();
    front_ = std::move(front);
    thread_ = std::thread([this] { front_->run(); });
  }

  std::uint16_t port() const { return port_; }

  void stop() {
    if (!thread_.joinable()) return;
    front_->stop();
    thread_.join();
    front_.reset();
  }

 private:
  const ServerOptions options_;
  const Router router_;
  const StaticFiles files_;
  std::unique_ptr<Front> front_;
  std::thread thread_;
  std::atomic<std::uint16_t> port_{0};
};

Server::Server(ServerOptions options, Router router, std::vector<StaticFile> files)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(router), std::move(files))) {}
Server::~Server() = default;
void Server::start() {
  impl_->start();
}
std::uint16_t Server::port() const {
  return impl_->port();
}
void Server::stop() {
  impl_->stop();
}

}  // namespace skylight::http
