// The one port: takes connections, checks requests, serves the page's files, hands API requests to workers.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "service/http/message.hpp"
#include "service/http/router.hpp"

namespace skylight::http {

/// A file of the page, read by the caller at the start and served from memory by the front itself, with
/// ETag, 304 and HEAD. No path of a request ever reaches the file system.
struct StaticFile {
  std::string path;          ///< exactly as asked for, decoded: "/", "/assets/app.js"
  std::string content_type;  ///< "text/html; charset=utf-8"; html gets the Content-Security-Policy
  std::string body;
  std::string cache_control = "no-cache";  ///< ask again each time; the ETag makes that cheap
};

/// How long a connection may take; it is cut when the time is up.
struct Deadlines {
  std::chrono::milliseconds idle{
      60'000};  ///< from an answer (or the connecting) to the first byte of the next request
  std::chrono::milliseconds head{10'000};  ///< from there to the end of the headers
  std::chrono::milliseconds body{30'000};  ///< from there to the end of the body
  std::chrono::milliseconds write{
      30'000};  ///< for an answer to be taken, plus a second for each 64 KiB of it
  std::chrono::milliseconds linger{2'000};  ///< to let the peer read an error before the connection closes
  std::chrono::milliseconds stop{1'500};    ///< for requests under way when the server stops
};

struct ServerOptions {
  std::string host = "127.0.0.1";            ///< an address or a name of this machine
  std::uint16_t port = 8080;                 ///< 0: any free one, see Server::port()
  std::size_t quick_threads = 2;             ///< 1 to 64
  std::size_t slow_threads = 1;              ///< 1 to 64
  std::size_t slow_queue = 16;               ///< requests waiting for the slow lane; one more is a 503
  std::size_t max_body_bytes = 1024 * 1024;  ///< a route may set its own
  std::size_t max_bodies_bytes = 256 * 1024 * 1024;  ///< of all requests at once; beyond, a 503
  std::size_t max_header_bytes = 16 * 1024;  ///< request line and headers; trailers too. 1 KiB to 1 MiB
  std::size_t max_target_bytes = 4 * 1024;   ///< 64 to 8000
  std::size_t max_connections =
      1000;  ///< one more cuts the connection that has been idle longest. 1 to 100000
  Deadlines deadlines = {};
  /// Names (without port) that Host may say, besides the loopback names and the address it came in on.
  std::vector<std::string> allowed_hosts = {};
  /// Origins ("https://lab.example:8443") that may write, besides the page served here.
  std::vector<std::string> allowed_origins = {};
  /// Told of what an operator should know (an exception in a handler, no more file descriptors). From any
  /// thread, one line, without its end. None: dropped.
  std::function<void(const std::string&)> log = {};
};

class Server {
 public:
  /// Throws std::invalid_argument for options outside their ranges and for two files of one path.
  Server(ServerOptions options, Router router, std::vector<StaticFile> files);
  /// Stops.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Listens and returns. Throws std::runtime_error ("cannot listen on 127.0.0.1:8080: Address already in
  /// use"). Once only.
  void start();
  /// The port that it listens on; 0 before start().
  std::uint16_t port() const;
  /// Takes no more connections, lets the requests under way finish (Deadlines::stop), closes the rest.
  /// Waits for handlers that are running; requests that wait for a worker are dropped. May be called twice.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skylight::http
