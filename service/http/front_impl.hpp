// What the connections share: the listening socket, who is connected, who waits, and the workers.
//
// One thread runs everything here, so nothing is locked; workers come back to it by posting.
#pragma once

#include <chrono>
#include <list>
#include <string>
#include <unordered_map>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/basic_stream.hpp>

#include "service/http/front.hpp"
#include "service/http/gate.hpp"
#include "service/http/lanes.hpp"

namespace skylight::http {

namespace net = boost::asio;
namespace beast = boost::beast;
using Tcp = net::ip::tcp;
using Executor = net::io_context::executor_type;
using Stream = beast::basic_stream<Tcp, Executor>;
using Socket = Stream::socket_type;
using Acceptor = net::basic_socket_acceptor<Tcp, Executor>;
using Timer = net::basic_waitable_timer<std::chrono::steady_clock,
                                        net::wait_traits<std::chrono::steady_clock>, Executor>;
using Error = boost::system::error_code;

class Connection;

class Front::Impl {
 public:
  Impl(const ServerOptions& options, const Router& router, const StaticFiles& files);
  std::uint16_t listen();  ///< throws std::runtime_error
  void run();              ///< until stop()
  void stop();             ///< from any thread

  const ServerOptions& options() const { return options_; }
  const Gate& gate() const { return gate_; }
  bool stopping() const { return stopping_; }
  void log(const std::string& line) const noexcept;

  using IdleSpot = std::list<std::uint64_t>::iterator;
  IdleSpot enter_idle(std::uint64_t id) { return idle_.insert(idle_.end(), id); }
  void leave_idle(IdleSpot spot) { idle_.erase(spot); }
  void forget(std::uint64_t id);
  bool reserve_body(std::size_t bytes);
  void release_body(std::size_t bytes) { body_bytes_ -= bytes; }
  bool post_job(std::uint64_t id, ApiRequest request);

 private:
  void accept_next();
  void on_accept(const Error& error, Socket socket);
  void take(Socket socket);
  void pause_accepting(const std::string& why);
  bool cut_idlest();
  void begin_stop();
  void close_all();

  const ServerOptions& options_;
  Gate gate_;
  net::io_context io_{1};
  Acceptor acceptor_{io_};
  Timer timer_{io_};
  std::unordered_map<std::uint64_t, std::shared_ptr<Connection>> connections_;
  std::list<std::uint64_t> idle_;  // the longest idle in front
  std::uint64_t next_id_ = 0;
  std::size_t body_bytes_ = 0;
  bool stopping_ = false;
  bool told_of_shortage_ = false;
  // Last, so that the workers end first: they post to io_.
  WorkerLane quick_;
  WorkerLane slow_;
};

}  // namespace skylight::http
