#include "service/http/connection.hpp"

#include <array>
#include <limits>
#include <utility>

#include <boost/asio/write.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/read.hpp>

#include "service/http/text.hpp"

namespace skylight::http {
namespace {

constexpr std::size_t kReadBytes = 4096;  // of an idle connection's buffer, once something comes
constexpr std::size_t kLingerBytes = 64 * 1024 * 1024;  // thrown away at most before a connection closes
constexpr std::size_t kWriteBytesPerSecond = 64 * 1024;

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

std::string numeric(const net::ip::address& address) {
  const bool mapped = address.is_v6() && address.to_v6().is_v4_mapped();
  return mapped ? net::ip::make_address_v4(net::ip::v4_mapped, address.to_v6()).to_string()
                : address.to_string();
}

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

}  // namespace skylight::http
