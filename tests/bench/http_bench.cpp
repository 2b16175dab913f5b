// REST reads over loopback: plain sockets with keep-alive, one request under way per connection.
#include <atomic>
#include <memory>
#include <stdexcept>
#include <thread>

#include <arpa/inet.h>
#include <benchmark/benchmark.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "service/http/server.hpp"
#include "service/routes/context.hpp"
#include "tests/bench/recording.hpp"

namespace skylight::bench {
namespace {

using service::Pipeline;

/// Plays a recording until it is told to stop.
class PlayedFrames final : public service::FrameSource {
 public:
  PlayedFrames(const Recording& recording, const std::atomic<bool>& stop) : player_(recording), stop_(stop) {}
  std::optional<Frame> next() override { return stop_ ? std::nullopt : std::optional(player_.next()); }

 private:
  Player player_;
  const std::atomic<bool>& stop_;
};

/// The pose routes over a pipeline that has tracked ten robots and then come to rest.
class PoseServer {
 public:
  PoseServer()
      : pipeline_(make_pipeline(stop_)),
        store_({}),
        context_{.pipeline = *pipeline_, .appearances = store_, .default_method = {}} {
    context_.horizon = std::chrono::hours(24);  // the last poses stay good while they are asked for
    pipeline_->start();
    wait_for_poses();
    stop_ = true;
    http::Router router;
    service::add_pose_routes(router, context_);
    server_ = std::make_unique<http::Server>(http::ServerOptions{.port = 0}, std::move(router),
                                             std::vector<http::StaticFile>{});
    server_->start();
  }
  std::uint16_t port() const { return server_->port(); }

 private:
  static std::unique_ptr<Pipeline> make_pipeline(const std::atomic<bool>& stop) {
    const Recording& room = recording(10);
    Tracker tracker({room.camera});
    for (const RobotSpec& spec : room.robots) tracker.add(spec);
    return std::make_unique<Pipeline>(
        service::PipelineParts{.source = std::make_shared<PlayedFrames>(room, stop),
                               .cameras = {{"ceiling", room.camera}},
                               .tracker = std::move(tracker)},
        service::PipelineOptions{});
  }

  void wait_for_poses() const {
    for (int tries = 0; tries < 3000; ++tries) {
      const auto snapshot = pipeline_->snapshot();
      if (snapshot->robots.at(0).view.state == TrackState::tracking) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    throw std::runtime_error("the robots were not tracked within 30 s");
  }

  std::atomic<bool> stop_{false};
  std::unique_ptr<Pipeline> pipeline_;
  service::AppearanceStore store_;
  service::RouteContext context_;
  std::unique_ptr<http::Server> server_;  // last: it stops before what its routes read goes
};

class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const int on = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("cannot connect");
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void ask(const std::string& request) const {
    if (send(socket_, request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size()))
      throw std::runtime_error("cannot send");
  }

  /// One answer by its Content-Length; throws where it is not a 200.
  std::string answer() {
    for (;;) {
      const std::size_t head = unread_.find("\r\n\r\n");
      if (head != std::string::npos) {
        const std::size_t end = head + 4 + length_of(unread_.substr(0, head));
        if (unread_.size() >= end) {
          const std::string whole = unread_.substr(0, end);
          unread_.erase(0, end);
          if (whole.compare(0, 12, "HTTP/1.1 200") != 0) throw std::runtime_error(whole);
          return whole;
        }
      }
      char bytes[4096];
      const ssize_t count = recv(socket_, bytes, sizeof bytes, 0);
      if (count <= 0) throw std::runtime_error("the connection ended");
      unread_.append(bytes, static_cast<std::size_t>(count));
    }
  }

 private:
  static std::size_t length_of(const std::string& head) {
    const std::size_t at = head.find("Content-Length: ");
    if (at == std::string::npos) throw std::runtime_error("an answer without Content-Length");
    return std::stoul(head.substr(at + 16));
  }

  int socket_;
  std::string unread_;
};

// Each round asks once on every connection, then takes the answers.
void read_over_http(benchmark::State& state, const std::string& path) {
  static PoseServer server;
  std::vector<std::unique_ptr<Client>> clients;
  for (std::int64_t i = 0; i < state.range(0); ++i)
    clients.push_back(std::make_unique<Client>(server.port()));
  const std::string request = "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  try {
    clients[0]->ask(request);
    const std::string first = clients[0]->answer();
    if (first.find("\"pose\":{") == std::string::npos) throw std::runtime_error("no pose in " + first);
    state.counters["answer_bytes"] = static_cast<double>(first.size());
    for (auto _ : state) {
      for (const auto& client : clients) client->ask(request);
      for (const auto& client : clients) client->answer();
    }
  } catch (const std::exception& error) {
    state.SkipWithError(error.what());
  }
  state.counters["requests_per_s"] = benchmark::Counter(
      static_cast<double>(state.iterations() * state.range(0)), benchmark::Counter::kIsRate);
}

void http_get_pose(benchmark::State& state) {
  read_over_http(state, "/api/v1/robots/waffle0/pose");
}
void http_get_poses_of_10(benchmark::State& state) {
  read_over_http(state, "/api/v1/poses");
}
BENCHMARK(http_get_pose)
    ->ArgName("connections")
    ->Arg(1)
    ->Arg(16)
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(http_get_poses_of_10)
    ->ArgName("connections")
    ->Arg(1)
    ->Arg(16)
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace skylight::bench
