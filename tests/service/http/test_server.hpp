// A server with a handful of routes that show what reached them.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "service/http/server.hpp"

namespace skylight::http::test {

/// Holds handlers until it is opened.
class Barrier {
 public:
  void open();
  void pass();                        ///< waits until it is open
  void wait_until_inside(int count);  ///< until that many have come to it

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  int inside_ = 0;
};

/// Routes: GET /api/echo/{id}, POST and PUT /api/echo (JSON), POST /api/form (forms), PUT /api/picture
/// (image/png, 4 MiB), DELETE /api/echo/{id}, GET /api/big (8 MiB), GET /api/throw/{how},
/// GET /api/wait (quick) and /api/slow (slow lane) behind the barrier, GET /api/empty (204), GET /api/own
/// (its own headers). Files: "/", "/text", "/app.js".
class TestServer {
 public:
  explicit TestServer(ServerOptions options = {});
  ~TestServer();
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;

  std::uint16_t port() const { return server_->port(); }
  Barrier& barrier() { return barrier_; }
  Server& server() { return *server_; }
  std::string log() const;

 private:
  Router routes();

  Barrier barrier_;
  mutable std::mutex log_mutex_;
  std::string log_;
  std::unique_ptr<Server> server_;
};

}  // namespace skylight::http::test
