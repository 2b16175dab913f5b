// The sockets: accept, read, deadlines, write. The only file that knows Boost.Beast and Asio.
//
// One thread runs everything here, so nothing is locked; workers come back to it by posting.
// A request's way: await_request -> read_head -> on_head (the gate) -> read_body -> hand_over -> send.
#include "service/http/front.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <limits>
#include <list>
#include <optional>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>

#include "service/http/gate.hpp"
#include "service/http/lanes.hpp"
#include "service/http/text.hpp"
#include "service/http/wire.hpp"

namespace skylight::http {
namespace {

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
using Parser = beast::http::request_parser<beast::http::string_body>;

constexpr std::size_t kReadBytes = 4096;  // of an idle connection's buffer, once something comes
constexpr std::size_t kLingerBytes = 64 * 1024 * 1024;  // thrown away at most before a connection closes
constexpr std::size_t kWriteBytesPerSecond = 64 * 1024;
constexpr auto kAcceptPause = std::chrono::milliseconds(100);

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

class Connection;

/// What the connections share.
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

namespace {

std::string numeric(const net::ip::address& address) {
  const bool mapped = address.is_v6() && address.to_v6().is_v4_mapped();
  return mapped ? net::ip::make_address_v4(net::ip::v4_mapped, address.to_v6()).to_string()
                : address.to_string();
}

bool is_shortage(const Error& error) {
  return error == net::error::no_descriptors || error.value() == ENFILE || error == net::error::no_memory ||
         error == net::error::no_buffer_space;
}

}  // namespace

// ---- Connection ----

Connection::Connection(Front::Impl& front, std::uint64_t id, Socket socket, std::string remote_address)
    : front_(front),
      id_(id),
      stream_(std::move(socket)),
      // Room for a head of full size, so that the parser's own limit speaks first; bounds trailers too.
      buffer_(front.options().max_header_bytes + kReadBytes),
      remote_address_(std::move(remote_address)) {
  Error ignored;
  stream_.socket().set_option(Tcp::no_delay(true), ignored);
  local_address_ = numeric(stream_.socket().local_endpoint(ignored).address());
}

// Connections that wait for their peer may be cut to make room; the front knows them in the order in which
// they began to wait, which dribbling does not renew.
void Connection::set_phase(Phase phase) {
  const auto waits = [](Phase p) { return p == Phase::idle || p == Phase::request || p == Phase::linger; };
  if (waits(phase_) && !waits(phase)) front_.leave_idle(idle_spot_);
  if (!waits(phase_) && waits(phase)) idle_spot_ = front_.enter_idle(id_);
  phase_ = phase;
}

/// The next step as a completion handler that keeps this connection alive, and closes it where the step
/// throws: nothing would ever wake it again.
template <class Step>
auto Connection::guarded(Step step) {
  return [this, self = shared_from_this(), step = std::move(step)](auto&&... results) mutable {
    if (phase_ == Phase::closed) return;
    try {
      step(results...);
    } catch (const std::exception& thrown) {  // out of memory, say
      front_.log(std::string("http: a connection is closed: ") + thrown.what());
      close();
    }
  };
}

void Connection::await_request() {
  parser_.reset();
  release_body();
  set_phase(Phase::idle);
  if (buffer_.size() > 0) return read_head();  // pipelined
  buffer_.shrink_to_fit();
  stream_.expires_after(front_.options().deadlines.idle);
  stream_.async_read_some(buffer_.prepare(kReadBytes), guarded([this](const Error& error, std::size_t bytes) {
                            if (error) return close();
                            buffer_.commit(bytes);
                            read_head();
                          }));
}

void Connection::read_head() {
  set_phase(Phase::request);
  envelope_ = {};
  parser_.emplace();
  parser_->header_limit(static_cast<std::uint32_t>(front_.options().max_header_bytes));
  parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // the route's is set when it is known
  stream_.expires_after(front_.options().deadlines.head);
  beast::http::async_read_header(stream_, buffer_, *parser_,
                                 guarded([this](const Error& error, std::size_t) { on_head(error); }));
}

Head Connection::head() const {
  const auto& message = parser_->get();
  Head head{.method = view(message.method_string()),
            .target = view(message.target()),
            .http10 = message.version() == 10,
            .local_address = local_address_};
  for (const auto& field : message) head.headers.emplace_back(view(field.name_string()), view(field.value()));
  return head;
}

void Connection::on_head(const Error& error) {
  if (error) return refuse_malformed(error);
  envelope_ = {.head_only = parser_->get().method() == beast::http::verb::head,
               .keep_alive = parser_->keep_alive() && !front_.stopping(),
               .http10 = parser_->get().version() == 10};
  std::optional<Admission> admission;
  try {
    admission = front_.gate().admit(head());
  } catch (const Problem& problem) {
    return refuse(problem.answer());
  }
  on_admission(std::move(*admission));
}

void Connection::on_admission(Admission admission) {
  if (admission.answer) return send_found(*admission.answer);
  if (!admission.has_body) return hand_over(std::move(admission));
  if (!front_.reserve_body(admission.expected_bytes)) {
    Reply busy = problem(503, "", "too many large requests at once");
    busy.headers.emplace_back("Retry-After", "1");
    return refuse(busy);
  }
  reserved_ = admission.expected_bytes;
  parser_->body_limit(admission.max_body_bytes);
  stream_.expires_after(front_.options().deadlines.body);
  if (admission.wants_continue && buffer_.size() == 0) return send_continue(std::move(admission));
  read_body(std::move(admission));
}

void Connection::send_continue(Admission admission) {
  static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
  net::async_write(stream_, net::buffer(kContinue.data(), kContinue.size()),
                   guarded([this, admission = std::move(admission)](const Error& error, std::size_t) mutable {
                     if (error) return close();
                     read_body(std::move(admission));
                   }));
}

void Connection::read_body(Admission admission) {
  beast::http::async_read(
      stream_, buffer_, *parser_,
      guarded([this, admission = std::move(admission)](const Error& error, std::size_t) mutable {
        on_body(error, std::move(admission));
      }));
}

void Connection::on_body(const Error& error, Admission admission) {
  if (!error) return hand_over(std::move(admission));
  if (error != beast::http::error::body_limit) return refuse_malformed(error);
  refuse(problem(413, "", "the body is longer than " + std::to_string(admission.max_body_bytes) + " bytes"));
}

void Connection::hand_over(Admission admission) {
  set_phase(Phase::handler);
  stream_.expires_never();
  ApiRequest request{.method = std::string(view(parser_->get().method_string())),
                     .target = std::move(admission.target),
                     .headers = std::move(admission.headers),
                     .body = std::move(parser_->get().body()),
                     .route = admission.match.route,
                     .path_params = std::move(admission.match.path_params),
                     .remote_address = remote_address_,
                     .envelope = envelope_};
  parser_.reset();
  if (front_.post_job(id_, std::move(request))) return;
  Reply busy = problem(503, "", "too many requests of this kind are waiting; try again");
  busy.headers.emplace_back("Retry-After", "1");
  send(answer_bytes(busy, envelope_));
}

void Connection::on_answer(std::string bytes) {
  guarded([this, &bytes] { send(std::move(bytes)); })();
}

// For a request that is not read to its end: what follows cannot be told from a new request.
void Connection::refuse(const Reply& reply) {
  const bool body_follows = parser_ && !parser_->is_done();
  refused_ = body_follows || reply.status == 400;
  if (refused_) envelope_.keep_alive = false;
  send(answer_bytes(reply, envelope_));
}

void Connection::refuse_malformed(const Error& error) {
  using Http = beast::http::error;
  const bool spoken = error.category() == beast::http::make_error_code(Http::bad_method).category();
  if (!spoken || error == Http::end_of_stream || error == Http::partial_message) return close();
  envelope_.keep_alive = false;
  refused_ = true;
  const bool too_long = error == Http::header_limit || error == Http::buffer_overflow;
  if (!too_long) {
    return send(answer_bytes(problem(400, "Malformed request", "not HTTP: " + error.message()), envelope_));
  }
  const std::string_view seen(static_cast<const char*>(buffer_.data().data()), buffer_.size());
  const bool in_request_line = parser_->get().version() == 0 || parser_->get().method_string().empty();
  const bool target = in_request_line && seen.find("\r\n") == std::string_view::npos;
  const std::string bound = std::to_string(front_.options().max_header_bytes) + " bytes";
  send(answer_bytes(
      problem(target ? 414 : 431, "",
              target ? "the request line is longer than " + bound : "the headers are longer than " + bound),
      envelope_));
}

void Connection::send_found(const StaticFiles::Found& found) {
  std::string bytes = answer_head(found.reply, found.body.size(), envelope_);
  send(std::move(bytes), envelope_.head_only ? std::string_view() : found.body);
}

void Connection::send(std::string bytes, std::string_view tail) {
  set_phase(Phase::answer);
  out_ = std::move(bytes);
  const std::size_t total = out_.size() + tail.size();
  stream_.expires_after(front_.options().deadlines.write +
                        std::chrono::seconds(total / kWriteBytesPerSecond));
  const std::array<net::const_buffer, 2> buffers{net::buffer(out_), net::buffer(tail.data(), tail.size())};
  net::async_write(stream_, buffers, guarded([this](const Error& error, std::size_t) { on_sent(error); }));
}

void Connection::on_sent(const Error& error) {
  std::string().swap(out_);  // a big answer's memory goes at once
  if (error) return close();
  if (!refused_ && !closing_ && envelope_.keep_alive) return await_request();
  if (!refused_) return close();
  // Closing over unread bytes resets the connection, and the peer may lose the answer: let it read first.
  Error ignored;
  stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
  set_phase(Phase::linger);
  parser_.reset();
  buffer_.clear();
  stream_.expires_after(front_.options().deadlines.linger);
  linger(kLingerBytes);
}

void Connection::linger(std::size_t budget) {
  buffer_.clear();
  stream_.async_read_some(buffer_.prepare(buffer_.max_size()),
                          guarded([this, budget](const Error& error, std::size_t bytes) {
                            if (error || bytes >= budget) return close();
                            linger(budget - bytes);
                          }));
}

void Connection::release_body() {
  front_.release_body(reserved_);
  reserved_ = 0;
}

void Connection::close() {
  if (phase_ == Phase::closed) return;
  const auto self = shared_from_this();
  set_phase(Phase::closed);
  release_body();
  stream_.close();
  front_.forget(id_);
}

void Connection::close_when_done() {
  closing_ = true;
  const bool waiting = phase_ == Phase::idle || phase_ == Phase::linger;
  if (waiting || (phase_ == Phase::request && parser_ && !parser_->is_header_done())) close();
}

// ---- Front ----

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
