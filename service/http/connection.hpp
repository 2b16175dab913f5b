// One peer's socket: read, deadlines, write.
//
// A request's way: await_request -> read_head -> on_head (the gate) -> read_body -> hand_over -> send.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "service/http/front_impl.hpp"
#include "service/http/wire.hpp"

namespace skylight::http {

/// As people write it; one of IPv4 that came over IPv6 as the former.
std::string numeric(const net::ip::address& address);

/// One peer. Here later: the WebSocket upgrade and MJPEG take the stream over in on_head(); TLS makes
/// Stream a parameter.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Front::Impl& front, std::uint64_t id, Socket socket, std::string remote_address);
  void start() { await_request(); }
  void close();            ///< at once
  void close_when_done();  ///< idle: at once; else after the answer
  void on_answer(std::string bytes);

 private:
  using Parser = beast::http::request_parser<beast::http::string_body>;
  enum class Phase { idle, request, handler, answer, linger, closed };

  void await_request();
  void read_head();
  void on_head(const Error& error);
  Head head() const;
  void on_admission(Admission admission);
  void send_continue(Admission admission);
  void read_body(Admission admission);
  void on_body(const Error& error, Admission admission);
  void hand_over(Admission admission);
  void refuse(const Reply& reply);
  void refuse_malformed(const Error& error);
  void send_found(const StaticFiles::Found& found);
  void send(std::string bytes, std::string_view tail = {});
  void on_sent(const Error& error);
  void linger(std::size_t budget);
  void set_phase(Phase phase);
  void release_body();
  template <class Step>
  auto guarded(Step step);

  Front::Impl& front_;
  const std::uint64_t id_;
  Stream stream_;
  beast::flat_buffer buffer_;
  std::optional<Parser> parser_;
  std::string out_;
  std::string remote_address_;
  std::string local_address_;
  Envelope envelope_;
  std::size_t reserved_ = 0;  // bytes of body, counted by the front
  bool refused_ = false;      // the rest of what the peer sends is thrown away
  bool closing_ = false;
  Phase phase_ = Phase::closed;
  Front::Impl::IdleSpot idle_spot_;
};

}  // namespace skylight::http
