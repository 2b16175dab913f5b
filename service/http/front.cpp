// Accepting, and what is decided over all connections.
#include "service/http/front.hpp"

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <utility>

#include <boost/asio/post.hpp>

#include "service/http/connection.hpp"

namespace skylight::http {
namespace {

constexpr auto kAcceptPause = std::chrono::milliseconds(100);

bool is_shortage(const Error& error) {
  return error == net::error::no_descriptors || error.value() == ENFILE || error == net::error::no_memory ||
         error == net::error::no_buffer_space;
}

}  // namespace

Front::Impl::Impl(const ServerOptions& options, const Router& router, const StaticFiles& files)
    : options_(options),
      gate_(options, router, files),
      quick_(options.quick_threads, options.max_connections, options.log),
      slow_(options.slow_threads, options.slow_queue, options.log) {}

std::uint16_t Front::Impl::listen() {
  const bool v6 = options_.host.find(':') != std::string::npos;
  const std::string where =
      (v6 ? '[' + options_.host + ']' : options_.host) + ':' + std::to_string(options_.port);
  const auto check = [&where](const Error& error) {
    if (error) throw std::runtime_error("cannot listen on " + where + ": " + error.message());
  };
  Error error;
  Tcp::resolver resolver(io_);
  const auto found =
      resolver.resolve(options_.host, std::to_string(options_.port), Tcp::resolver::passive, error);
  check(error);
  const auto v4 = std::find_if(found.begin(), found.end(),
                               [](const auto& one) { return one.endpoint().address().is_v4(); });
  const Tcp::endpoint endpoint = (v4 == found.end() ? found.begin() : v4)->endpoint();
  check(acceptor_.open(endpoint.protocol(), error));
  check(acceptor_.set_option(Acceptor::reuse_address(true), error));
  check(acceptor_.bind(endpoint, error));
  check(acceptor_.listen(Acceptor::max_listen_connections, error));
  const Tcp::endpoint bound = acceptor_.local_endpoint(error);
  check(error);
  return bound.port();
}

void Front::Impl::run() {
  accept_next();
  while (!io_.stopped()) {
    try {
      io_.run();
      break;
    } catch (const std::exception& thrown) {  // what no connection is to blame for; the others go on
      log(std::string("http: ") + thrown.what());
    }
  }
  close_all();
}

void Front::Impl::log(const std::string& line) const noexcept {
  try {
    if (options_.log) options_.log(line);
  } catch (...) {  // a log that fails must not end the server
  }
}

void Front::Impl::accept_next() {
  acceptor_.async_accept(io_.get_executor(),
                         [this](const Error& error, Socket socket) { on_accept(error, std::move(socket)); });
}

void Front::Impl::on_accept(const Error& error, Socket socket) {
  if (stopping_) return;
  if (is_shortage(error)) {
    cut_idlest();
    return pause_accepting(error.message());
  }
  if (!error) {  // else the peer was gone before it was taken
    told_of_shortage_ = false;
    try {
      take(std::move(socket));
    } catch (const std::exception& thrown) {
      return pause_accepting(thrown.what());
    }
  }
  accept_next();
}

void Front::Impl::take(Socket socket) {
  Error gone;
  const std::string remote = numeric(socket.remote_endpoint(gone).address());
  if (gone) return;
  if (connections_.size() < options_.max_connections || cut_idlest()) {
    const std::uint64_t id = next_id_++;
    const auto connection = std::make_shared<Connection>(*this, id, std::move(socket), remote);
    connections_.emplace(id, connection);
    return connection->start();
  }
  Reply busy = problem(503, "", "all connections are taken");
  busy.headers.emplace_back("Retry-After", "1");
  const std::string bytes = answer_bytes(busy, {});
  socket.non_blocking(true, gone);
  socket.write_some(net::buffer(bytes), gone);  // fits into an empty send buffer, or is lost
}

// Accepting again at once would spin: the connection that could not be taken is still waiting.
void Front::Impl::pause_accepting(const std::string& why) {
  if (!told_of_shortage_) log("http: cannot take connections for now: " + why);
  told_of_shortage_ = true;
  timer_.expires_after(kAcceptPause);
  timer_.async_wait([this](const Error& error) {
    if (!error && !stopping_) accept_next();
  });
}

bool Front::Impl::cut_idlest() {
  if (idle_.empty()) return false;
  const auto found = connections_.find(idle_.front());
  if (found != connections_.end()) found->second->close();
  return true;
}

void Front::Impl::forget(std::uint64_t id) {
  connections_.erase(id);
  if (stopping_ && connections_.empty()) io_.stop();
}

bool Front::Impl::reserve_body(std::size_t bytes) {
  if (bytes > options_.max_bodies_bytes - body_bytes_) return false;
  body_bytes_ += bytes;
  return true;
}

bool Front::Impl::post_job(std::uint64_t id, ApiRequest request) {
  WorkerLane& lane = request.route->options.lane == Lane::quick ? quick_ : slow_;
  WorkerLane::Job job{.request = std::move(request), .done = [this, id](std::string answer) {
                        net::post(io_, [this, id, bytes = std::move(answer)]() mutable {
                          const auto found = connections_.find(id);
                          if (found != connections_.end()) found->second->on_answer(std::move(bytes));
                        });
                      }};
  return lane.post(job);
}

void Front::Impl::stop() {
  net::post(io_, [this] { begin_stop(); });
}

void Front::Impl::begin_stop() {
  if (stopping_) return;
  stopping_ = true;
  Error ignored;
  acceptor_.close(ignored);
  const auto open = connections_;  // closing takes them out of the map
  for (const auto& [id, connection] : open) connection->close_when_done();
  if (connections_.empty()) return io_.stop();
  timer_.expires_after(options_.deadlines.stop);
  timer_.async_wait([this](const Error& error) {
    if (!error) io_.stop();
  });
}

void Front::Impl::close_all() {
  const auto open = connections_;
  for (const auto& [id, connection] : open) connection->close();
}

Front::Front(const ServerOptions& options, const Router& router, const StaticFiles& files)
    : impl_(std::make_unique<Impl>(options, router, files)) {}
Front::~Front() = default;
std::uint16_t Front::listen() {
  return impl_->listen();
}
void Front::run() {
  impl_->run();
}
void Front::stop() {
  impl_->stop();
}

}  // namespace skylight::http
