#include "service/http/seam.hpp"

#include <algorithm>
#include <cstring>
#include <exception>
#include <string_view>

#include <httplib.h>

#include "service/http/text.hpp"

// process_request() is no public interface: it changes between versions. Read its source before raising this.
static_assert(std::string_view(CPPHTTPLIB_VERSION) == "0.11.4", "the seam is written for cpp-httplib 0.11.4");
#if !defined(CPPHTTPLIB_OPENSSL_SUPPORT) || !defined(CPPHTTPLIB_ZLIB_SUPPORT) || \
    !defined(CPPHTTPLIB_BROTLI_SUPPORT)
#error "compile with pkg-config's flags: without them httplib::Request has another size than in the library"
#endif

namespace skylight::http {
namespace {

/// What the library takes for a socket: a request in memory, and room for the answer.
class MemoryStream : public httplib::Stream {
 public:
  explicit MemoryStream(std::string_view request) : rest_(request) {}
  std::string take_answer() { return std::move(answer_); }

  using httplib::Stream::write;
  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  ssize_t read(char* to, size_t size) override {
    const std::size_t count = std::min(size, rest_.size());
    std::memcpy(to, rest_.data(), count);
    rest_.remove_prefix(count);
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, size_t size) override {
    answer_.append(from, size);
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  void get_local_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }  // passes for below FD_SETSIZE

 private:
  std::string_view rest_;
  std::string answer_;
};

// The library undoes a percent-encoding in header values too, which no standard asks for.
std::string shield_percent(std::string_view value) {
  std::string out;
  for (const char c : value) out += c == '%' ? std::string_view("%25") : std::string_view(&c, 1);
  return out;
}

// Encoded anew, because the library's reading of a raw query differs ("a=b=c", a second '?', %u0041). The
// body stays with us: without Content-Length the library does not ask for it, so its bounds for forms and
// its multipart parser never come into play.
std::string request_text(const ApiRequest& request) {
  std::string out = request.method + ' ';
  for (const std::string& segment : request.target.segments) out += '/' + percent_encode(segment);
  char mark = '?';
  for (const auto& [name, value] : request.target.query) {
    out += mark + percent_encode(name) + '=' + percent_encode(value);
    mark = '&';
  }
  out += " HTTP/1.1\r\n";
  for (const auto& [name, value] : request.headers) out += name + ": " + shield_percent(value) + "\r\n";
  return out + "\r\n";
}

Reply internal_error() {
  return problem(500, "", "The server failed on this request; its log says why.");
}

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(),
      [](char c) {
        return has_control({&c, 1});
      },
      ' ');
  return text;
}

}  // namespace

class Seam::Library : public httplib::Server {
 public:
  explicit Library(Log log);
  std::string answer(const ApiRequest& request);
  void report(const ApiRequest& request, const std::string& what) const noexcept;

 private:
  Request to_request(const httplib::Request& parsed) const;
  Reply run() const;
  Reply run_handler(const Request& request) const;
  void fill(httplib::Response& response, Reply reply) const;

  Log log_;
  const ApiRequest* current_ = nullptr;
};

Seam::Library::Library(Log log) : log_(std::move(log)) {
  // Before routing: the front has found the route already, and the library's own are regular expressions,
  // tried one after the other.
  set_pre_routing_handler([this](const httplib::Request& parsed, httplib::Response& response) {
    fill(response, run_handler(to_request(parsed)));
    return HandlerResponse::Handled;
  });
  // For what the library itself refuses or throws: its defaults are an empty body, and the exception's text.
  set_error_handler(HandlerWithResponse([this](const httplib::Request&, httplib::Response& response) {
    if (response.body.empty()) fill(response, problem(response.status, "", "The request was refused."));
    return HandlerResponse::Handled;
  }));
  set_exception_handler(
      [this](const httplib::Request&, httplib::Response& response, const std::exception_ptr& /*thrown*/) {
        report(*current_, "an exception outside the handler");
        fill(response, internal_error());
      });
  set_post_routing_handler([this](const httplib::Request&, httplib::Response& response) {
    response.headers.erase("Keep-Alive");     // the library's numbers, not the front's
    response.headers.erase("Accept-Ranges");  // added to HEAD; there are no ranges here
    if (is_bodiless(response.status)) response.headers.erase("Content-Length");
    if (current_->envelope.keep_alive && current_->envelope.http10) {
      response.headers.emplace("Connection", "keep-alive");
    }
  });
}

void Seam::Library::report(const ApiRequest& request, const std::string& what) const noexcept {
  try {
    if (log_) log_(one_line(request.method + ' ' + request.target.path + ": " + what));
  } catch (...) {  // a log that fails must not take the answer with it
  }
}

Request Seam::Library::to_request(const httplib::Request& parsed) const {
  Request request;
  request.method = parsed.method == "HEAD" ? "GET" : parsed.method;
  request.path = parsed.path;
  request.path_params = current_->path_params;
  request.query = parsed.params;
  for (const auto& [name, value] : parsed.headers) {
    const std::string lower = lower_case(name);  // the library adds REMOTE_ADDR and the like
    const bool passed =
        std::find(std::begin(kPassedHeaders), std::end(kPassedHeaders), lower) != std::end(kPassedHeaders);
    if (passed) request.headers.emplace(lower, value);
  }
  request.body = current_->body;
  request.remote_address = current_->remote_address;
  return request;
}

Reply Seam::Library::run_handler(const Request& request) const {
  std::string what = "an exception of unknown type";
  try {
    Reply reply = current_->route->handler(request);
    if (reply.status >= 200 && reply.status <= 599) return reply;
    what = "the handler answered with status " + std::to_string(reply.status);
  } catch (const Problem& thrown) {
    return thrown.answer();
  } catch (const std::exception& thrown) {
    what = thrown.what();
  } catch (...) {  // any type may be thrown; the text above says so
  }
  report(*current_, what);
  return internal_error();
}

void Seam::Library::fill(httplib::Response& response, Reply reply) const {
  response.status = reply.status;
  if (is_bodiless(reply.status)) reply.body.clear();
  for (auto& [name, value] : answer_headers(reply, !reply.body.empty()))
    response.headers.emplace(name, value);
  response.body = std::move(reply.body);
}

std::string Seam::Library::answer(const ApiRequest& request) {
  current_ = &request;
  const std::string text = request_text(request);
  MemoryStream stream(text);
  bool closed = false;
  process_request(stream, !request.envelope.keep_alive, closed, nullptr);
  std::string bytes = stream.take_answer();
  if (bytes.empty()) {
    report(request, "no answer");
    bytes = answer_bytes(internal_error(), request.envelope);
  }
  return bytes;
}

Seam::Seam(Log log) : library_(std::make_unique<Library>(std::move(log))) {}
Seam::~Seam() = default;

std::string Seam::answer(const ApiRequest& request) noexcept {
  try {
    return library_->answer(request);
  } catch (const std::exception& thrown) {
    library_->report(request, thrown.what());
  } catch (...) {
    library_->report(request, "an exception of unknown type");
  }
  return answer_bytes(internal_error(), {.head_only = request.method == "HEAD"});
}

}  // namespace skylight::http
