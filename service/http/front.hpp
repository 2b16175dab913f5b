// The sockets, without a word of the library that owns them.
#pragma once

#include <cstdint>
#include <memory>

#include "service/http/router.hpp"
#include "service/http/server.hpp"
#include "service/http/static_files.hpp"

namespace skylight::http {

class Front {
 public:
  /// Keeps references to all three. Starts the workers.
  Front(const ServerOptions& options, const Router& router, const StaticFiles& files);
  /// After run() has returned. Waits for handlers that still run.
  ~Front();
  Front(const Front&) = delete;
  Front& operator=(const Front&) = delete;

  /// The port listened on. Throws std::runtime_error that names host, port and cause.
  std::uint16_t listen();
  /// Serves until stop(); everything but handlers happens on the thread that calls this.
  void run();
  /// From any thread; run() returns when the requests under way are answered or Deadlines::stop is over.
  void stop();

  class Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::http
